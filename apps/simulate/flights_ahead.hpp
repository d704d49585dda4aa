#pragma once

#include "apps/simulate/simulate.hpp"
#include "fem/base/blas_threads.hpp"

#include <atomic>
#include <future>
#include <list>
#include <optional>
#include <string>

namespace flexboom {

/// Flights that are wanted soon, or perhaps, and that other cores fly meanwhile. What comes out is what run_once gives.
/// A guess that was wrong costs time of those cores, and of this one where both make bodies ready.
class FlightsAhead {
 public:
  FlightsAhead() = default;
  FlightsAhead(const FlightsAhead&) = delete;
  FlightsAhead& operator=(const FlightsAhead&) = delete;
  ~FlightsAhead() { give_up(); }

  /// Begins this flight, if it is not begun. A machine with one core begins none. `refine` and `max_steps` as of
  /// run_once.
  void begin(const Scene&, const RunHooks&, int refine = 0, long max_steps = 0);

  /// Ends those that were begun: nobody will ask for them.
  void give_up();

  /// A flight that was flown and may be wanted again.
  void keep(const Scene&, Run);

  /// The flight of this scene that was begun or kept, if there is one. @throws NumericalError where it failed.
  std::optional<Run> take(const Scene&, const RunHooks&, int refine = 0);

 private:
  struct Flight {
    std::string made_of;
    std::future<Run> run;
  };

  std::atomic<bool> stop_ = false;
  std::optional<OneBlasThread> alone_;  // as long as any is begun
  std::list<Flight> begun_;
  std::string kept_made_of_;
  std::optional<Run> kept_;
};

/// run_once, or what was flown ahead.
Run fly(const Scene&, const RunHooks&, int refine = 0, long max_steps = 0);

/// As the members of RunHooks::ahead, where there is one.
void fly_ahead(const Scene&, const RunHooks&, int refine = 0, long max_steps = 0);
void give_up_ahead(const RunHooks&);
void keep_flown(const Scene&, Run, const RunHooks&);

}  // namespace flexboom
