#pragma once

#include "dynamics/redundant/equations.hpp"

#include <Eigen/Core>

namespace flexboom::redundant {

/// Sizes that errors of the redundant unknowns are weighed against. A size is the largest value so far of the group
/// that the unknown belongs to. It is the displacement from the start for R, half the angle turned for p. It is at
/// least a small part of what the energy or the accelerations at the start could make of the unknown. Multipliers are
/// not weighed.
class StateScales {
 public:
  StateScales(Equations&, const Eigen::VectorXd& y0, const Eigen::VectorXd& y0_dot, double energy, double tolerance,
              double duration);

  void observe(const Eigen::VectorXd& y);
  /// Of the unknowns as they are numbered now.
  void weights(double* w) const;

 private:
  void raise(int first, int count, double size);
  void set_least();

  const Equations& equations_;
  double tolerance_, length_ = 0;  // positions are known to round-off of this [m]
  Eigen::VectorXd start_;
  Eigen::VectorXd scale_, least_;  // of motion and energies; least: some round-off, or Newton can not converge
};

}  // namespace flexboom::redundant
