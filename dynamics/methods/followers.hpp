#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/methods/stop_search.hpp"
#include "dynamics/relative/split.hpp"

#include <Eigen/Core>

#include <vector>

namespace flexboom {

/// What follows x within a step of exponential collocation: attitudes, energies, and the mass centre of what floats,
/// with it the place of its root.
class Followers {
 public:
  Followers(SplitProblem&, const ErrorScale&);

  /// From the next start on, powers are `of_x` x and a remainder, a row per energy; `of_z` z is the same of the modes.
  /// What vibrates with x is integrated as x is, the remainder by its polynomial. In steps where the remainder is
  /// rougher than the whole, the polynomial is that of the whole. Empty: all is remainder.
  void split_powers(const Eigen::MatrixXd& of_x, const Eigen::MatrixXd& of_z) {
    power_of_x_ = of_x, power_of_z_ = of_z;
  }

  /// A step starts at (t, y); or the next one, at y, where this one ended.
  void start(double t, const Eigen::VectorXd& y);
  void go_on(const CollocatedStep&, const Eigen::VectorXd& y);

  /// After a derivative at point j and y.
  void take(int j, const Eigen::VectorXd& y, const Eigen::VectorXd& y_dot);

  /// Mass centres are accelerated everywhere as at the start.
  void forget();

  /// By x of the points, and what was taken at them.
  void follow(const CollocatedStep&);

  /// Sets attitudes and energies at a fraction c of the step, `at` its functions there.
  void turn(const CollocatedStep&, const GridPoint& at, double c, Eigen::Ref<Eigen::VectorXd> y);

  /// Sets positions and velocities there, by x and attitudes of y (after `turn`): forces between the bodies do not move
  /// the mass centre.
  void place(const CollocatedStep&, double c, Eigen::Ref<Eigen::VectorXd> y);

  /// Of the step, in units of the one allowed; z_error: of z at its end, left: time to the end of the flight [s].
  double error(const CollocatedStep&, const Eigen::Ref<const Eigen::VectorXd>& z_error, double left) const;

  /// What only the outside could change is as it was at the start: angular momentum. A wrong attitude is turned, a
  /// wrong rate is made faster or slower, each by its size. Where there is a momentum, it is mostly the attitude that
  /// is turned, for that acts back on nothing. Returns what it added to omega of the first root [rad/s].
  Eigen::Vector3d keep_momentum(double t, Eigen::VectorXd& y);

 private:
  static constexpr int degree = collocation::degree;
  static constexpr int points = collocation::points;
  using Vectors = Eigen::Matrix<double, 3, points>;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, points>;

  struct Turning {
    Eigen::Vector4d start = Eigen::Vector4d::UnitX();
    Vectors rate = Vectors::Zero(), coefficients = Vectors::Zero();  // at the points; the polynomial through them
  };
  struct Falling {
    Eigen::Vector3d com = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();  // at the start
    Vectors acceleration = Vectors::Zero(), coefficients = Vectors::Zero();

    /// Way and velocity that the outside has added at a fraction c of a step.
    Eigen::Vector3d way(double length, double c) const {
      return length * length * (coefficients * collocation::double_integrals(c));
    }
    Eigen::Vector3d speed(double length, double c) const { return length * (coefficients * collocation::integrals(c)); }
  };

  void set_start(const Eigen::VectorXd& y);
  void take_turn(const CollocatedStep&, size_t turn, const Rows& linear);

  SplitProblem& problem_;
  const SplitLayout& layout_;
  const ErrorScale& scale_;
  std::vector<Turning> turns_;
  std::vector<Falling> falls_;
  Eigen::VectorXd energies_;                     // at the start
  Rows power_, remainder_, power_coefficients_;  // a row per energy
  Eigen::MatrixXd power_of_x_, power_of_z_;
  std::vector<char> is_split_;        // in this step, per energy
  Rows linear_;                       // integrals of omega at the points, three rows per turn
  Eigen::Vector3d angular_momentum_;  // at the very first start
  bool started_ = false;
  Eigen::VectorXd integral_;  // of z
};

}  // namespace flexboom
