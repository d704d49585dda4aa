#include "dynamics/hub_motion.hpp"

#include "dynamics/rotation.hpp"

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

Vector4d quaternion_of(const Vector3d& theta) {
  const double half = 0.5 * theta.norm();
  const double s = half < 1e-4 ? 0.5 * (1 - half * half / 6) : 0.5 * std::sin(half) / half;
  Vector4d q;
  q << std::cos(half), s * theta;
  return q;
}

}  // namespace

HubMotion::HubMotion(const System& system, const ErrorScale& scale, Workspace& work)
    : system_(system), layout_(system.layout()), scale_(scale), work_(work) {}

void HubMotion::start(const VectorXd& y) {
  power_coefficients_.setZero(), turning_coefficients_.setZero(), gravity_coefficients_.setZero();
  dissipated_ = y[layout_.dissipated()];
  if (system_.fixed_hub()) return;
  attitude_ = y.segment<4>(layout_.attitude());
  const Whole whole = system_.whole(y, work_);
  const Matrix3d A = rotation_matrix(attitude_);
  com_ = y.segment<3>(layout_.position()) + A * whole.mass_centre;
  com_velocity_ = y.segment<3>(layout_.velocity()) + A * whole.velocity;
  if (!angular_momentum_) angular_momentum_ = A * whole.angular_momentum;
}

void HubMotion::go_on(const CollocatedStep& step, const VectorXd& y) {
  power_[0] = power_[degree];
  dissipated_ = y[layout_.dissipated()];
  if (system_.fixed_hub()) return;
  attitude_ = y.segment<4>(layout_.attitude());
  com_ += step.length * com_velocity_ + fallen(step, 1);
  com_velocity_ += faster(step, 1);
  gravity_.col(0) = gravity_.col(degree).eval();
}

Vector3d HubMotion::fallen(const CollocatedStep& step, double c) const {
  return step.length * step.length * (gravity_coefficients_ * collocation::double_integrals(c));
}

Vector3d HubMotion::faster(const CollocatedStep& step, double c) const {
  return step.length * (gravity_coefficients_ * collocation::integrals(c));
}

void HubMotion::take(int j, double power, double t, const VectorXd& y) {
  power_[j] = power;
  if (!system_.field()) return;
  const LocalGravity g = system_.field()->at(t, y.segment<3>(layout_.position()));
  const Matrix3d A = rotation_matrix(y.segment<4>(layout_.attitude()));
  gravity_.col(j) = g.at(A * system_.whole(y, work_).mass_centre).acceleration;
}

void HubMotion::forget() { gravity_.rightCols<degree>().colwise() = gravity_.col(0).eval(); }

void HubMotion::follow(const CollocatedStep& step) {
  const auto& to_coefficients = collocation::coefficients();
  power_coefficients_ = to_coefficients.transpose() * power_;
  if (system_.fixed_hub()) return;
  integral_.resize(step.linear->size());
  Vectors omega = step.X.middleRows<3>(layout_.p), linear, theta;
  linear.col(0).setZero();
  for (int j = 1; j < points; ++j) {
    step.linear->combine((*step.grid)[static_cast<size_t>(j)], 1, step.Z.col(0), step.M, integral_);
    linear.col(j).noalias() = step.length * (step.linear->omega_modes.lazyProduct(integral_));
  }
  theta = linear;
  for (int round = 0; round < 20; ++round) {
    for (int j = 0; j < points; ++j) turning_.col(j) = turning(theta.col(j), omega.col(j));
    turning_coefficients_.noalias() = turning_ * to_coefficients;
    double change = 0;
    for (int j = 1; j < points; ++j) {
      const Vector3d next =
          linear.col(j) + step.length * (turning_coefficients_ * collocation::integrals(collocation::node(j)));
      change = std::max(change, (next - theta.col(j)).norm());
      theta.col(j) = next;
    }
    if (change <= 1e-16) break;
  }
  gravity_coefficients_.noalias() = gravity_ * to_coefficients;
}

void HubMotion::turn(const CollocatedStep& step, const GridPoint& at, double c, Ref<VectorXd> y) {
  const auto I = collocation::integrals(c);
  y[layout_.dissipated()] = dissipated_ + step.length * power_coefficients_.dot(I);
  if (system_.fixed_hub()) return;
  integral_.resize(step.linear->size());
  step.linear->combine(at, 1, step.Z.col(0), step.M, integral_);
  const Vector3d theta = step.length * (step.linear->omega_modes.lazyProduct(integral_) + turning_coefficients_ * I);
  y.segment<4>(layout_.attitude()) = quaternion_product(attitude_, quaternion_of(theta));
}

void HubMotion::place(const CollocatedStep& step, double c, Ref<VectorXd> y) const {
  if (system_.fixed_hub()) return;
  const Whole whole = system_.whole(y, work_);
  const Matrix3d A = rotation_matrix(y.segment<4>(layout_.attitude()));
  y.segment<3>(layout_.velocity()) = com_velocity_ + faster(step, c) - A * whole.velocity;
  y.segment<3>(layout_.position()) = com_ + step.length * c * com_velocity_ + fallen(step, c) - A * whole.mass_centre;
}

double HubMotion::error(const CollocatedStep& step, const Ref<const VectorXd>& z_error, double left) const {
  const Points& d = collocation::middle_difference();
  const double weight = step.length * collocation::middle_polynomial().dot(collocation::integrals(1));
  const auto in_units = [this](double error, int entry) { return error / (scale_.tolerance * scale_.scale[entry]); };
  double error = in_units(std::abs(power_.dot(d)) * weight, layout_.dissipated());
  if (system_.fixed_hub()) return error;
  // What the hub's rate keeps of the error turns it: until the end, or until momentum takes it back.
  const double kept = step.linear->drift_modes.lazyProduct(z_error).norm();
  const double turned = kept * (system_.field() ? left : step.length) + (turning_ * d).norm() * weight;
  error = std::max(error, in_units(0.5 * turned, layout_.attitude()));
  const double fallen = (gravity_ * d).norm() * weight * left;  // and the speed of the mass centre carries it away
  return std::max(error, in_units(fallen, layout_.position()));
}

Vector3d HubMotion::keep_momentum(VectorXd& y) const {
  if (system_.fixed_hub() || system_.field()) return Vector3d::Zero();
  const double rate = 0.01 * scale_.scale[layout_.p], angle = 2 * scale_.scale[layout_.attitude()];
  const Whole whole = system_.whole(y, work_);
  auto attitude = y.segment<4>(layout_.attitude());
  const Matrix3d A = rotation_matrix(attitude), &J = whole.inertia;
  const Vector3d& H = whole.angular_momentum;
  const Vector3d lost = A.transpose() * *angular_momentum_ - H;
  // The least (added / rate)^2 + (turned / angle)^2 for which J added + turned x H = lost.
  const Matrix3d W =
      rate * rate * J * J.transpose() + angle * angle * (H.squaredNorm() * Matrix3d::Identity() - H * H.transpose());
  const Vector3d pull = W.ldlt().solve(lost), added = rate * rate * J.transpose() * pull;
  y.segment<3>(layout_.p) += added;
  attitude = quaternion_product(attitude, quaternion_of(angle * angle * H.cross(pull)));
  return added;
}

}  // namespace flexboom
