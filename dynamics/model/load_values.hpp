#pragma once

// What the loads of a scene are at an instant. Internal to `dynamics`.

#include "dynamics/model/multibody.hpp"
#include "dynamics/numerics/spatial.hpp"

namespace flexboom {

struct ForceAndTorque {
  spatial::Vec3<double> force, torque;  // [N], [N m]
};

/// Zero where there is no function.
inline ForceAndTorque load_in_own_axes(const Load& load, double t) {
  const auto at = [t](const std::function<double(double)>& f) { return f ? f(t) : 0.0; };
  return {{at(load.force[0]), at(load.force[1]), at(load.force[2])},
          {at(load.torque[0]), at(load.torque[1]), at(load.torque[2])}};
}

}  // namespace flexboom
