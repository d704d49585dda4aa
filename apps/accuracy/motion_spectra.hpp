#pragma once

#include "apps/accuracy/motion_record.hpp"
#include "apps/simulate/simulate.hpp"

#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// A mode that a run leaves out, and how much its motion by the run is, by what the body does with those that are kept.
struct ShakenMode {
  double frequency = 0;  // [rad/s]
  double effect = 0;     // relative
};

/// How strongly the motion of a run moves modes that it leaves out.
///
/// A sprung mass, an unbalanced rotor or another boom may shake a body at the frequency of one of its modes. What such
/// a mode does back is not known, for it is left out: it is driven one way. The accelerations of the body's frame drive
/// it, and the loads of what is joined to the body. A vibration that goes on all the time shows as a peak in their
/// spectra. What holds a body shifts its frequencies, so a mode is held against all peaks that are near it.
class MotionSpectra {
 public:
  /// Of a scene as it was flown. All of them live as long.
  MotionSpectra(const Scene& flown, const SimulatedMotion& run, const RunHooks& hooks)
      : flown_(flown), run_(run), hooks_(hooks) {}

  /// As it begins and ends, the run vibrates no faster. Nothing in it turns at more than half of this: what goes with
  /// the square of a turn is twice as fast [rad/s].
  double fastest() const;

  /// The modes of a body beyond `shown` [rad/s]. `all`: the body of the scene with as many modes as there are. Those
  /// beyond these are taken to be like the last. The first call flies the scene again.
  /// @throws InputError, NumericalError as that flight.
  std::vector<ShakenMode> shaken_beyond(const ReducedBody& all, double shown) const;

 private:
  struct Sizes;

  const MotionRecord& record(double slowest) const;
  Sizes sizes_of(const std::string& body, const MotionRecord&) const;

  const Scene& flown_;
  const SimulatedMotion& run_;
  const RunHooks& hooks_;
  mutable double fastest_ = -1;  // not known yet
  mutable std::optional<MotionRecord> record_;
};

}  // namespace flexboom
