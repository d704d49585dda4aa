#pragma once

#include "dynamics/events/flight.hpp"
#include "dynamics/model/multibody.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

namespace flexboom {

/// Does something join bodies to the inertial frame?
bool is_held(const Multibody&);

/// Does nothing from outside push the bodies, so that their momenta are kept?
bool is_isolated(const Multibody&);

/// How well a flight keeps its energy and its momenta, over its outputs.
class Conservation {
 public:
  /// `before`: of a flight that this one goes on.
  Conservation(const std::vector<ReducedBody>&, const MotionScales& before);

  /// The next moment: `total` is kept, `size` its largest part [J]. A balance has momenta and their scales.
  template <class AnyBalance>
  void add(double total, double size, const AnyBalance& b) {
    if (!begun_) first_total_ = total, P_ = b.momentum, H_ = b.angular_momentum;
    begun_ = true;
    gap_ = std::max(gap_, std::abs(total - first_total_));
    dP_ = std::max(dP_, (b.momentum - P_).norm());
    dH_ = std::max(dH_, (b.angular_momentum - H_).norm());
    largest_.energy = std::max(largest_.energy, size);
    largest_.shaking = std::max(largest_.shaking, b.shaking());
    largest_.momentum = std::max(largest_.momentum, b.momentum_scale);
    largest_.angular_momentum = std::max(largest_.angular_momentum, b.angular_momentum_scale);
  }

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
