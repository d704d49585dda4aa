#include "dynamics/methods/linear_parts.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexboom {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double near_by = 0.3;  // joints this near to where L was taken hardly change it [rad] or [m]
constexpr double pull = held * held;

void hold(MatrixXd& J, const SplitLayout::Coordinate& c) {
  if (J.col(c.value).cwiseAbs().maxCoeff() < pull) J(c.rate, c.value) -= pull;
}

}  // namespace

LinearParts::LinearParts(SplitProblem& problem) : problem_(problem), layout_(problem.layout()), y_dot_(layout_.size) {}

LinearPart& LinearParts::near(double t, const VectorXd& y) {
  auto& part = parts_[contact_];
  if (!part || !serves(*part, y)) part = make(t, base_at(y));
  return *part;
}

LinearPart& LinearParts::renew(double t, const VectorXd& base) { return *(parts_[contact_] = make(t, base)); }

bool LinearParts::serves(const LinearPart& part, const VectorXd& y) const {
  const auto far = [&](int i) { return !(std::abs(part.base[i] - y[i]) <= near_by); };
  return std::ranges::none_of(layout_.joints, far) &&
         std::ranges::none_of(layout_.turns, [&](const SplitLayout::Turn& turn) {
           const auto here = y.segment<4>(turn.attitude), there = part.base.segment<4>(turn.attitude);
           return layout_.attitudes_matter && 2 * std::acos(std::min(1.0, std::abs(here.dot(there)))) > near_by;
         });
}

/// At rest, undeformed, joints where they are; on their thresholds where they are near: what belongs to different stops
/// belongs to the same place then.
VectorXd LinearParts::base_at(const VectorXd& y) const {
  VectorXd base = y;
  base.head(layout_.x).setZero();
  for (const int i : layout_.joints)
    if (std::abs(y[i]) > near_by) base[i] = y[i];
  for (const int i : layout_.spins) base[i] = y[i];
  return base;
}

std::unique_ptr<LinearPart> LinearParts::make(double t, const VectorXd& base) {
  ++made_;
  if (std::unique_ptr<LinearPart> part = make_of_neighbour(t, base)) return part;
  MatrixXd J = problem_.linear(t, base.data(), contact_);
  if (const double largest = J.cwiseAbs().maxCoeff(); !(largest * largest < std::numeric_limits<double>::max()))
    throw NumericalError(fmt::format(  // no other method could, so this is no failure of the method
        "the Jacobian of the equations of motion has entries of {:.2g}, whose squares overflow", largest));
  for (const int i : layout_.prescribed) J.row(i).setZero(), J.col(i).setZero();
  for (const SplitLayout::Coordinate& c : layout_.coordinates) hold(J, c);
  std::vector<int> omegas;
  for (const SplitLayout::Turn& turn : layout_.turns) omegas.push_back(turn.omega);
  try {
    return std::make_unique<LinearPart>(J, omegas, base);
  } catch (const NumericalError&) {  // several that are pulled by each other alone
    for (const auto& [value, rate] : layout_.coordinates) J(rate, value) -= pull;
    return std::make_unique<LinearPart>(J, omegas, base);
  }
}

/// From one that differs in one stop. Empty: there is none, or its block alone has no full set of eigenvectors, or two
/// in one place; all of L may do.
std::unique_ptr<LinearPart> LinearParts::make_of_neighbour(double t, const VectorXd& base) {
  const auto [other, stop] = neighbour(base);
  if (other == nullptr || base[layout_.gaps[stop].value] != 0) return nullptr;
  const SplitLayout::Coordinate& gap = layout_.gaps[stop];
  const int column = gap.value;
  MatrixXd J = other->L;
  J.col(column) += (contact_[stop] ? 1 : -1) * pull_of(stop, t, base);
  hold(J, gap);
  try {
    return std::make_unique<LinearPart>(*other, J, column);
  } catch (const NumericalError&) {
    return nullptr;
  }
}

/// What a closed stop adds to L. On its threshold it has no force, and is in the column of its gap alone.
VectorXd LinearParts::pull_of(size_t stop, double t, VectorXd base) {
  constexpr double gap = 1e-6;  // small, and far from round-off
  std::vector<char> contact = contact_;
  const auto derivative = [&](bool closed) -> VectorXd {
    contact[stop] = closed;
    problem_.derivative(t, base.data(), contact, y_dot_.data());
    return y_dot_.head(layout_.x);
  };
  base[layout_.gaps[stop].value] = gap;
  return (derivative(true) - derivative(false)) / gap;
}

/// A linear part at the same place that differs in one stop, and which.
std::pair<const LinearPart*, size_t> LinearParts::neighbour(const VectorXd& base) const {
  for (const auto& [contact, part] : parts_) {
    if (!part || part->base.head(layout_.x) != base.head(layout_.x)) continue;
    const auto [here, there] = std::ranges::mismatch(contact_, contact);
    if (here != contact_.end() && std::equal(here + 1, contact_.end(), there + 1))
      return {part.get(), static_cast<size_t>(here - contact_.begin())};
  }
  return {};
}

}  // namespace flexboom
