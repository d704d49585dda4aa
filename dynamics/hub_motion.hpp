#pragma once

#include "dynamics/integrator.hpp"
#include "dynamics/stop_search.hpp"

#include <Eigen/Core>

#include <optional>

namespace flexboom {

/// What follows p and u within a step of exponential collocation: attitude, motion of the mass centre and with it the
/// hub's place, dissipated energy. Within a step it acts back in a field of gravity only. With a fixed hub the energy
/// alone.
class HubMotion {
 public:
  HubMotion(const System&, const ErrorScale&, Workspace&);

  /// A step starts at y; or the next one, at y, where this one ended.
  void start(const Eigen::VectorXd& y);
  void go_on(const CollocatedStep&, const Eigen::VectorXd& y);

  /// At point j: the power that is lost [W], and gravity at the mass centre at the time t [s] and y.
  void take(int j, double power, double t, const Eigen::VectorXd& y);

  /// Gravity is everywhere as at the start.
  void forget();

  /// By p and u of the points, and what was taken at them.
  void follow(const CollocatedStep&);

  /// Sets attitude and dissipated energy at a fraction c of the step, `at` its functions there.
  void turn(const CollocatedStep&, const GridPoint& at, double c, Eigen::Ref<Eigen::VectorXd> y);

  /// Sets position and velocity there, by p, u and attitude of y (after `turn`): forces between the bodies do not move
  /// the mass centre.
  void place(const CollocatedStep&, double c, Eigen::Ref<Eigen::VectorXd> y) const;

  /// Of the step, in units of the one allowed; z_error: of z at its end, left: time to the end of the flight [s].
  double error(const CollocatedStep&, const Eigen::Ref<const Eigen::VectorXd>& z_error, double left) const;

  /// What only the outside could change is as it was at the start: angular momentum. A wrong attitude is turned, a
  /// wrong rate is made faster or slower, each by its size; where there is a momentum, mostly the attitude, for that
  /// acts back on nothing. Returns what it added to omega (hub axes) [rad/s].
  Eigen::Vector3d keep_momentum(Eigen::VectorXd& y) const;

 private:
  static constexpr int degree = collocation::degree;
  static constexpr int points = collocation::points;
  using Points = Eigen::Matrix<double, points, 1>;
  using Vectors = Eigen::Matrix<double, 3, points>;

  const System& system_;
  const Layout& layout_;
  const ErrorScale& scale_;
  Workspace& work_;
  Eigen::Vector4d attitude_ = Eigen::Vector4d::UnitX();
  double dissipated_ = 0;
  Eigen::Vector3d com_ = Eigen::Vector3d::Zero(), com_velocity_ = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> angular_momentum_;
  Eigen::VectorXd integral_;  // of z

  /// What gravity has done to the mass centre at a fraction c of a step: its way and its velocity.
  Eigen::Vector3d fallen(const CollocatedStep&, double c) const;
  Eigen::Vector3d faster(const CollocatedStep&, double c) const;

  // At the points, and the polynomials through them.
  Points power_ = Points::Zero(), power_coefficients_ = Points::Zero();
  Vectors turning_ = Vectors::Zero(), turning_coefficients_ = Vectors::Zero();
  Vectors gravity_ = Vectors::Zero(), gravity_coefficients_ = Vectors::Zero();
};

}  // namespace flexboom
