#pragma once

#include "apps/sweep/quantities.hpp"
#include "apps/sweep/variation.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// How a run of a sweep ended.
enum class RunStatus : std::uint8_t { ok, input, numerical, crashed };
inline constexpr std::array<std::string_view, 4> run_status_names = {"ok", "input", "numerical", "crashed"};

struct RunOutcome {
  size_t run = 0;
  RunStatus status = RunStatus::ok;
  std::string message;  // of a run that failed
  double seconds = 0;
  std::vector<double> quantities;         // NaN: could not be computed
  std::optional<OutputTable> trajectory;  // where they are kept
};

/// Simulates the runs of a sweep, without files and without error budgets.
class SweepRunner {
 public:
  /// Prepares the bodies of the scene as it stands: runs that do not change them find them ready.
  /// `loads`: force and torque of every joint are outputs. @throws InputError, NumericalError.
  SweepRunner(SceneSource, SweepValues, bool loads, bool keep_trajectories);

  /// Names of the outputs of the scene as it stands, and of those that runs looked at have besides.
  const std::vector<std::string>& columns() const { return columns_; }
  /// Looks at the first `runs` runs.
  void look_for_columns(size_t runs);
  const Scene& scene() const { return scene_; }

  void measure(std::vector<Quantity> quantities) { quantities_ = std::move(quantities); }

  /// Never throws because of the run.
  RunOutcome run(size_t run);

 private:
  RunHooks hooks();
  Scene scene_of_run(size_t run) const;
  void settle();
  void set_options(Scene&) const;
  Run simulate(const Scene&);
  void note_columns(Scene);

  SceneSource source_;
  SweepValues values_;
  bool loads_, keep_trajectories_;
  Scene scene_;
  std::optional<double> digits_share_;  // of every run, where the scene as it stands needs more than are asked for
  std::vector<Quantity> quantities_;
  std::vector<std::string> columns_;
  PreparedBodies bodies_;
};

}  // namespace flexboom
