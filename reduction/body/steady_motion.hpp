#pragma once

#include <Eigen/Core>

#include <vector>

namespace flexboom {

/// How a body moves for long: the motion whose prestress its shapes are made for.
struct SteadyMotion {
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();          // angular velocity of the BRF, its axes [rad/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  // of its origin, gravity subtracted, its axes [m/s^2]
  std::vector<Eigen::Vector3d> turns;  // axes through the origin, BRF, about which its joint lets it turn freely
};

}  // namespace flexboom
