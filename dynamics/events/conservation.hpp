#pragma once

#include "dynamics/events/flight.hpp"
#include "dynamics/model/energy_ledger.hpp"
#include "dynamics/model/multibody.hpp"

#include <Eigen/Core>

namespace flexboom {

/// Bodies that turn by a hundredth of a radian per second have this energy [J]; `inertia`: traces about their origins.
double slow_energy(double inertia);
/// The share of it that is round-off: nothing moves.
inline constexpr double nothing = 1e-20;

/// Does something join bodies to the inertial frame?
bool is_held(const Multibody&);

/// Does nothing from outside push the bodies, so that their momenta are kept?
bool is_isolated(const Multibody&);

/// How well a flight keeps its energy and its momenta, over its outputs.
class Conservation {
 public:
  /// `before`: of a flight that this one goes on.
  Conservation(const std::vector<ReducedBody>&, const MotionScales& before);

  /// The next moment.
  void add(const Balance&);

  const MotionScales& largest() const { return largest_; }
  double energy_balance() const;  // largest change of the total by the largest energy
  double momentum_drift() const;  // largest change of both momenta, each by its scale

 private:
  double mass_, inertia_;  // of all bodies, the trace about each one's own origin: what makes a motion slow
  MotionScales largest_;
  bool begun_ = false;
  double first_total_ = 0, gap_ = 0, dP_ = 0, dH_ = 0;
  Eigen::Vector3d P_, H_;
};

}  // namespace flexboom
