#pragma once

// What the motion and the loads of a scene make of the geometric stiffness of its bodies. Internal to `dynamics`.

#include "dynamics/relative/tree.hpp"

#include <functional>
#include <vector>

namespace flexboom {

/// Geometric stiffness of every body in one state. Loads count where their places move with a flexible body; what acts
/// on the frame itself is in its motion.
class LoadedBodies {
 public:
  using Where = std::function<PlaceMotionInSpace(const Place&)>;

  /// `where` a place is and how it moves, in that state.
  LoadedBodies(const Multibody&, Where where);

  /// Motion of the BRF of a body, BRF axes: angular velocity [rad/s], acceleration of the origin less gravity [m/s^2],
  /// angular acceleration [rad/s^2]. And the accelerations of its coordinates.
  void move(size_t body, const Eigen::Vector3d& omega, const Eigen::Vector3d& acceleration,
            const Eigen::Vector3d& angular_acceleration, const Eigen::VectorXd& q_ddot);
  /// Coordinates of a body; empty: zeros.
  void bend(size_t body, const Eigen::VectorXd& q);
  /// One load per joint.
  void push_by_joints(const std::vector<JointLoad>&);
  void push_by_loads(double t);
  void push_by_springs();

  std::vector<StiffeningEffect> effects() const;

 private:
  bool counts(const Place&) const;
  /// A force [N] and a torque [N m], inertial axes.
  void push(const Place&, const Eigen::Vector3d& force, const Eigen::Vector3d& torque);

  const Multibody& scene_;
  Where where_;
  std::vector<Eigen::MatrixXd> K_;
  std::vector<double> shortening_;  // of the markers [m], the largest
};

}  // namespace flexboom
