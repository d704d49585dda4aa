#pragma once

#include "apps/simulate/simulate.hpp"

#include <Eigen/Core>

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

  /// Nothing in the run vibrates or turns faster, nor does what goes with the square of a turn [rad/s].
  double fastest() const;

  /// The modes of a body beyond `shown` [rad/s]. `all`: the body of the scene with as many modes as there are. Those
  /// beyond these are taken to be like the last. The first call flies the scene again.
  /// @throws InputError, NumericalError as that flight.
  std::vector<ShakenMode> shaken_beyond(const ReducedBody& all, double shown) const;

 private:
  /// Some parts of the run, with rows as close as its fastest vibrations want.
  struct Record {
    SimulatedMotion motion;
    double slowest = 0;             // that these parts are long enough for [rad/s]
    double step = 0;                // of their rows [s]
    size_t samples = 0;             // in each
    std::vector<size_t> windows{};  // their first rows
    std::vector<double> lasting{};  // until the next one begins [s]
    /// Per body and part: acceleration and angular acceleration of the BRF, its axes, six columns.
    std::vector<std::vector<Eigen::MatrixXd>> accelerations{};

    void add_accelerations();
  };
  /// What drives the modes of a body.
  struct Driven {
    std::vector<Eigen::MatrixXd> signals{};  // per part: its accelerations, then force and torque at each marker, BRF
                                             // axes: six columns each
    std::vector<std::string> markers{};      // where something is joined to the body
  };
  struct Sizes;

  const Record& record(double slowest) const;
  Driven driven(const ReducedBody&, const Record&) const;
  Sizes sizes_of(const std::string& body, const Record&) const;

  const Scene& flown_;
  const SimulatedMotion& run_;
  const RunHooks& hooks_;
  mutable double fastest_ = -1;  // not known yet
  mutable std::optional<Record> record_;
};

}  // namespace flexboom
