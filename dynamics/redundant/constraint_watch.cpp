#include "dynamics/redundant/constraint_watch.hpp"

#include "dynamics/redundant/equations.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexboom::redundant {

using Eigen::VectorXd;

ConstraintWatch::ConstraintWatch(Equations& equations)
    : equations_(equations),
      rows_(VectorXd::Zero(equations.all_rows())),
      rates_(VectorXd::Zero(equations.all_rows())) {}

void ConstraintWatch::note_drift(double t, const VectorXd& y, double tolerance, MultipliersSummary& s) {
  equations_.row_violations(t, y.data(), rows_.data(), rates_.data());
  const Violation g = violation(equations_, rows_), g_dot = violation(equations_, rates_);
  s.position_drift = std::max(s.position_drift, g.position);
  s.angle_drift = std::max(s.angle_drift, g.angle);
  s.velocity_drift = std::max(s.velocity_drift, g_dot.position);
  s.angular_velocity_drift = std::max(s.angular_velocity_drift, g_dot.angle);
  for (const BodyPlaces& at : equations_.places())
    s.quaternion_drift = std::max(s.quaternion_drift, std::abs(y.segment<4>(at.p).norm() - 1));
  if (!(std::max(g.position, g.angle) > tolerance)) return;
  const RowName worst = g.position > g.angle ? g.worst_position : g.worst_angle;
  throw NumericalError(fmt::format(
      "{}: violated by {:.3g} at t = {:.6g} s; it depended on other joints at the start and does so no more",
      describe(equations_, worst), std::max(g.position, g.angle), t));
}

void ConstraintWatch::require_independent(double t, const VectorXd& y, double share) {
  if (!(constraint_rank(equations_, t, y.data()).margin < share * margin_)) return;
  throw NumericalError(fmt::format("joint \"{}\" locks at t = {:.6g} s: the joints leave no consistent velocity",
                                   locked_joint(equations_, t, y.data()), t));
}

}  // namespace flexboom::redundant
