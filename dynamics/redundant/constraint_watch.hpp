#pragma once

#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/redundant/start.hpp"

#include <Eigen/Core>

namespace flexboom::redundant {

/// Looks at the constraints of a simulation: how far the joints drift, and whether their rows stay independent.
class ConstraintWatch {
 public:
  explicit ConstraintWatch(Equations&);

  /// Independence is measured against that of these rows.
  void follow(const RankReport& rank) { margin_ = rank.margin; }

  /// Notes the drift at a state, in `summary`. @throws NumericalError where a joint is violated beyond `tolerance`.
  void note_drift(double t, const Eigen::VectorXd& y, double tolerance, MultipliersSummary& summary);

  /// @throws NumericalError naming the joint that locks, where independence has fallen to `share` of what it was.
  void require_independent(double t, const Eigen::VectorXd& y, double share);

 private:
  Equations& equations_;
  Eigen::VectorXd rows_, rates_;  // of all joints [m, rad], [m/s, rad/s]
  double margin_ = 1;
};

}  // namespace flexboom::redundant
