#include "dynamics/methods/followers.hpp"

#include "dynamics/numerics/rotation.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Ref;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

/// d(rotation vector)/dt - omega, omega in body axes (Bortz 1971).
Vector3d turning(const Vector3d& theta, const Vector3d& omega) {
  const double a = theta.norm();
  const double c = a < 1e-2 ? (1 + a * a / 60) / 12 : (1 - 0.5 * a / std::tan(0.5 * a)) / (a * a);
  return 0.5 * theta.cross(omega) + c * theta.cross(theta.cross(omega));
}

/// What the middle point adds to the polynomial of the others.
template <class Row>
double roughness(const Row& row) {
  return std::abs(row.dot(collocation::middle_difference()));
}

}  // namespace

Followers::Followers(SplitProblem& problem, const ErrorScale& scale)
    : problem_(problem),
      layout_(problem.layout()),
      scale_(scale),
      turns_(layout_.turns.size()),
      falls_(layout_.roots.size()),
      energies_(layout_.size - layout_.energies),
      power_(Rows::Zero(energies_.size(), points)),
      remainder_(power_),
      power_coefficients_(power_),
      is_split_(static_cast<size_t>(energies_.size()), 0),
      linear_(Rows::Zero(3 * std::ssize(turns_), points)) {}

void Followers::set_start(const VectorXd& y) {
  energies_ = y.tail(energies_.size());
  for (size_t i = 0; i < turns_.size(); ++i) turns_[i].start = y.segment<4>(layout_.turns[i].attitude);
}

void Followers::start(double t, const VectorXd& y) {
  power_coefficients_.setZero();
  std::ranges::fill(is_split_, 0);
  set_start(y);
  for (Turning& turn : turns_) turn.coefficients.setZero();
  for (size_t i = 0; i < falls_.size(); ++i) {
    const FloatingBodies all = problem_.floating(i, t, y.data());
    Falling& fall = falls_[i];
    fall.com = y.segment<3>(layout_.roots[i].position) + all.centre.position;
    fall.velocity = y.segment<3>(layout_.roots[i].velocity) + all.centre.velocity;
    fall.coefficients.setZero();
    if (i == 0 && !started_) angular_momentum_ = all.angular_momentum;
  }
  started_ = true;
}

void Followers::go_on(const CollocatedStep& step, const VectorXd& y) {
  power_.col(0) = power_.col(degree).eval();
  remainder_.col(0) = remainder_.col(degree).eval();
  set_start(y);
  for (Falling& fall : falls_) {
    fall.com += step.length * fall.velocity + fall.way(step.length, 1);
    fall.velocity += fall.speed(step.length, 1);
    fall.acceleration.col(0) = fall.acceleration.col(degree).eval();
  }
}

void Followers::take(int j, const VectorXd& y, const VectorXd& y_dot) {
  power_.col(j) = y_dot.tail(energies_.size());
  remainder_.col(j) = power_.col(j);
  if (power_of_x_.size() > 0) remainder_.col(j).noalias() -= power_of_x_ * y.head(power_of_x_.cols());
  if (!layout_.outside_pushes) return;
  for (size_t i = 0; i < falls_.size(); ++i) falls_[i].acceleration.col(j) = problem_.outside_acceleration(i);
}

void Followers::forget() {
  for (Falling& fall : falls_) fall.acceleration.rightCols<degree>().colwise() = fall.acceleration.col(0).eval();
}

void Followers::take_turn(const CollocatedStep& step, size_t turn, const Rows& all_linear) {
  const Vectors omega = step.X.middleRows<3>(layout_.turns[turn].omega);
  const Vectors linear = all_linear.middleRows<3>(3 * static_cast<Eigen::Index>(turn));
  Turning& t = turns_[turn];
  Vectors theta = linear;
  for (int round = 0; round < 20; ++round) {
    for (int j = 0; j < points; ++j) t.rate.col(j) = turning(theta.col(j), omega.col(j));
    t.coefficients.noalias() = t.rate * collocation::coefficients();
    double change = 0;
    for (int j = 1; j < points; ++j) {
      const Vector3d next =
          linear.col(j) + step.length * (t.coefficients * collocation::integrals(collocation::node(j)));
      change = std::max(change, (next - theta.col(j)).norm());
      theta.col(j) = next;
    }
    if (change <= 1e-16) break;
  }
}

void Followers::follow(const CollocatedStep& step) {
  const auto& to_coefficients = collocation::coefficients();
  for (Eigen::Index i = 0; i < power_.rows(); ++i) {
    const bool is_split = power_of_x_.size() > 0 && roughness(remainder_.row(i)) < roughness(power_.row(i));
    is_split_[static_cast<size_t>(i)] = is_split;
    power_coefficients_.row(i).noalias() = (is_split ? remainder_ : power_).row(i) * to_coefficients;
  }
  if (turns_.empty()) return;
  integral_.resize(step.linear->size());
  for (int j = 1; j < points; ++j) {
    step.linear->combine((*step.grid)[static_cast<size_t>(j)], 1, step.Z.col(0), step.M, integral_);
    linear_.col(j).noalias() = step.length * (step.linear->omega_modes.lazyProduct(integral_));
  }
  for (size_t i = 0; i < turns_.size(); ++i) take_turn(step, i, linear_);
  for (Falling& fall : falls_) fall.coefficients.noalias() = fall.acceleration * to_coefficients;
}

void Followers::turn(const CollocatedStep& step, const GridPoint& at, double c, Ref<VectorXd> y) {
  const auto I = collocation::integrals(c);
  y.tail(energies_.size()) = energies_;
  y.tail(energies_.size()).noalias() += step.length * (power_coefficients_.lazyProduct(I));
  const bool any_split = std::ranges::find(is_split_, 1) != is_split_.end();
  if (turns_.empty() && !any_split) return;
  integral_.resize(step.linear->size());
  step.linear->combine(at, 1, step.Z.col(0), step.M, integral_);
  for (Eigen::Index i = 0; i < energies_.size() && any_split; ++i)
    if (is_split_[static_cast<size_t>(i)] != 0)
      y[y.size() - energies_.size() + i] += step.length * power_of_z_.row(i).dot(integral_);
  for (size_t i = 0; i < turns_.size(); ++i) {
    const auto omega = step.linear->omega_modes.middleRows<3>(3 * static_cast<Eigen::Index>(i));
    const Vector3d theta = step.length * (omega.lazyProduct(integral_) + turns_[i].coefficients * I);
    y.segment<4>(layout_.turns[i].attitude) = quaternion_product(turns_[i].start, quaternion_of(theta));
  }
}

void Followers::place(const CollocatedStep& step, double c, Ref<VectorXd> y) {
  const double h = step.length;
  for (size_t i = 0; i < falls_.size(); ++i) {
    const MassCentre centre = problem_.mass_centre(i, step.start + c * h, y.data());
    const Falling& fall = falls_[i];
    y.segment<3>(layout_.roots[i].velocity) = fall.velocity + fall.speed(h, c) - centre.velocity;
    y.segment<3>(layout_.roots[i].position) = fall.com + h * c * fall.velocity + fall.way(h, c) - centre.position;
  }
}

double Followers::error(const CollocatedStep& step, const Ref<const VectorXd>& z_error, double left) const {
  const collocation::Values& d = collocation::middle_difference();
  const double weight = step.length * collocation::middle_polynomial().dot(collocation::integrals(1));
  const auto in_units = [this](double error, int entry) { return error / (scale_.tolerance * scale_.scale[entry]); };
  double error = 0;
  for (Eigen::Index i = 0; i < energies_.size(); ++i) {
    const double rough = roughness((is_split_[static_cast<size_t>(i)] != 0 ? remainder_ : power_).row(i));
    error = std::max(error, in_units(rough * weight, layout_.energies + static_cast<int>(i)));
  }
  for (size_t i = 0; i < turns_.size(); ++i) {
    // What a rate keeps of the error turns it: until the end, or until momentum takes it back.
    const double kept =
        step.linear->drift_modes.middleRows<3>(3 * static_cast<Eigen::Index>(i)).lazyProduct(z_error).norm();
    const double lasts = layout_.momentum_is_kept && layout_.turns[i].is_root ? step.length : left;
    const double turned = kept * lasts + (turns_[i].rate * d).norm() * weight;
    error = std::max(error, in_units(0.5 * turned, layout_.turns[i].attitude));
  }
  for (size_t i = 0; i < falls_.size(); ++i) {  // the speed of the mass centre carries it away
    const double fallen = (falls_[i].acceleration * d).norm() * weight * left;
    error = std::max(error, in_units(fallen, layout_.roots[i].position));
  }
  return error;
}

Vector3d Followers::keep_momentum(double t, VectorXd& y) {
  if (!layout_.momentum_is_kept) return Vector3d::Zero();
  const SplitLayout::Root& root = layout_.roots.front();
  const double rate = 0.01 * scale_.scale[root.omega], angle = 2 * scale_.scale[root.attitude];
  const FloatingBodies all = problem_.floating(0, t, y.data());
  auto attitude = y.segment<4>(root.attitude);
  const Matrix3d A = rotation_matrix(attitude), &J = all.inertia;
  const Vector3d& H = all.angular_momentum;
  const Vector3d lost = angular_momentum_ - H;
  // The least (added / rate)^2 + (turned / angle)^2 for which J added + turned x H = lost.
  const Matrix3d W =
      rate * rate * J * J.transpose() + angle * angle * (H.squaredNorm() * Matrix3d::Identity() - H * H.transpose());
  const Vector3d pull = W.ldlt().solve(lost);
  Vector3d added = A.transpose() * (rate * rate * J.transpose() * pull);
  y.segment<3>(root.omega) += added;
  attitude = quaternion_product(attitude, quaternion_of(A.transpose() * (angle * angle * H.cross(pull))));
  return added;
}

}  // namespace flexboom
