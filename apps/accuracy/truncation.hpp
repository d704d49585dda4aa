#pragma once

// The part of an error budget of modes that are left out. Internal to `apps`.

#include "apps/accuracy/modes_beyond.hpp"
#include "apps/accuracy/repeats.hpp"

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace flexboom {

/// What modes that a run leaves out change in its outputs. Their flight is the longest of the repeats. So it is begun
/// before it is measured, and other parts of the budget are measured meanwhile.
class Truncation {
 public:
  /// The scene, and as its run has it, which both may change until this is measured. `still`: what nothing moves.
  Truncation(Measuring&, const Scene& scene, const Scene& flown, const Run&, const StillKinds& still);

  /// Finds the modes and begins their flight; anew where the run has changed.
  void look();

  /// Enters it into the budget, where the modes were found.
  void measure();

 private:
  /// Modes left out, and whether they are flown with fewer digits than the run.
  struct Beyond {
    Scene scene;
    bool has_few_digits = false;
    std::optional<Scene> kept{};  // the run with the elements of that scene, where it has finer ones
  };

  void take(const ShakenModes& shaken = {}, double least = 0);
  std::optional<Beyond> modes_beyond(const ShakenModes&, double least);
  Finding found();
  double per_change(const std::string& output) const;
  bool are_borne(const std::vector<OutputDifference>& changes) const;

  Measuring& m_;
  const Scene &scene_, &flown_;
  const Run& run_;
  const StillKinds& still_;
  std::set<std::string> slow_{};  // rates that converge as loads do
  double slow_per_change_ = 2;    // their truncation for what the modes beyond change
  std::string seen_;              // the scene as flown when it was looked at
  std::optional<Beyond> beyond_{};
  bool are_found_ = true;
};

}  // namespace flexboom
