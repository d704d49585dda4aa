#pragma once

#include "apps/accuracy/motion_record.hpp"
#include "apps/simulate/simulate.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// A mode that a run leaves out, and how much its motion by the run is, by what the body does with those that are kept.
struct ShakenMode {
  double frequency = 0;  // [rad/s]
  double effect = 0;     // relative
};

/// As it begins and ends, a run vibrates no faster. Nothing in it turns at more than half of this: what goes with the
/// square of a turn is twice as fast [rad/s].
double fastest_motion(const SimulatedMotion& run);

/// How strongly the motion of a run moves modes that it leaves out.
///
/// A sprung mass, an unbalanced rotor or another boom may shake a body at the frequency of one of its modes. What such
/// a mode does back is not known, for it is left out: it is driven one way. The accelerations of the body's frame drive
/// it, and the loads of what is joined to the body. A vibration that goes on all the time shows as a peak in their
/// spectra. What holds a body shifts its frequencies, so a mode is held against all peaks that are near it.
class MotionSpectra {
 public:
  /// Flies a scene once more, as it was flown. `slowest`: of the vibrations that count [rad/s]. The run lives as long.
  /// @throws InputError, NumericalError as that flight.
  MotionSpectra(const Scene& flown, const SimulatedMotion& run, double slowest, const RunHooks&);

  /// The modes of a body beyond `shown` [rad/s]. `all`: the body of the scene with as many modes as there are. Those
  /// beyond these are taken to be like the last.
  std::vector<ShakenMode> shaken_beyond(const ReducedBody& all, double shown) const;

 private:
  struct Sizes;

  Sizes sizes_of(const std::string& body) const;

  const SimulatedMotion& run_;
  double fastest_;              // [rad/s]
  bool has_rates_, has_loads_;  // among the outputs that count
  MotionRecord record_;
};

}  // namespace flexboom
