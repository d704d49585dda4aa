#pragma once

#include "dynamics/model/hub_with_booms.hpp"
#include "dynamics_testing.hpp"

#include <vector>

/// The spacecraft of meshes/sport.toml.
namespace flexboom::testing {

/// SPORT's hub (eq. 20 of the paper, symmetric part).
inline ReducedBody sport_hub() {
  const Eigen::Matrix3d J{
      {0.10477, 0.003148, 0.00098475}, {0.003148, 0.05858, -0.001259}, {0.00098475, -0.001259, 0.134942}};
  return rigid_body("hub", 8.5, Eigen::Vector3d::Zero(), J);
}

/// SPORT's booms (Table 1), stowed along y, with shapes of eq. 14 in the planes of their hinges.
inline std::vector<Appendage> sport_booms(int modes) {
  const auto boom = [modes](const char* name, double length, double diameter, double P1, const Eigen::Vector3d& point,
                            const Eigen::Vector3d& outward) {
    Appendage a{eq14::reduced_body(round_boom(length, diameter), modes, eq14::Planes::xy, name), {}};
    apply_damping(a.body, {"modal", 0.05});
    a.hinge = {name, point, Eigen::Vector3d::UnitY(), outward, sport_mechanism(P1)};
    return a;
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  return {boom("efield_plus", 0.295, 0.005, 0.35, {0.116, -0.151, 0.029}, x),
          boom("efield_minus", 0.295, 0.005, 0.35, {-0.111, -0.151, 0.029}, -x),
          boom("sip", 0.302, 0.010, 0.25, {0.091, -0.151, -0.053}, -z),
          boom("slp", 0.146, 0.005, 0.31, {0.069, -0.151, 0.053}, z)};
}

}  // namespace flexboom::testing
