#pragma once

#include "fem/assembly/constraints.hpp"
#include "reduction/basis/body_shapes.hpp"
#include "reduction/body/mode_kind.hpp"

#include <Eigen/Core>

#include <vector>

namespace flexboom {

/// Direction, sign and size of modes, so that they depend neither on the solver nor on the numbering of the mesh.
class ModeConvention {
 public:
  /// The tip is the mean of the node set "tip", by area where its nodes cover a face. Without that set it is the mean
  /// of the nodes furthest from what is clamped.
  ModeConvention(const Mesh&, const Assembly&, const Clamp&);

  /// Turns each group of M-orthonormal columns of Phi (all freedoms x n). The columns take up motions one after the
  /// other: the tip's deflection along y, z, x, its rotations about x, y, z. After these come the weighted mean motions
  /// of the body.
  void align(Eigen::MatrixXd& Phi, const std::vector<std::vector<int>>& groups) const;

  /// Scales M-orthonormal columns: tip deflection +2 along the leading direction of the mode; Me = m for torsion and
  /// where the tip hardly moves.
  void scale(Eigen::MatrixXd& Phi, const std::vector<ModeKind>& kinds) const;

  /// Of the whole mesh [kg].
  double mass() const { return mass_; }

 private:
  Eigen::MatrixXd functionals(const Eigen::MatrixXd& Phi) const;
  double factor(const Eigen::VectorXd& phi, const Eigen::VectorXd& tip, const Eigen::VectorXd& mean,
                int component) const;

  MeanMotion tip_;
  int axis_ = 0;  // along which the body is longest
  double mass_ = 0;
  double length_ = 0;
  Eigen::MatrixXd M_mean_;      // M times four motions that grow along the body: along x, y, z, and its twist
  Eigen::Vector4d mean_scale_;  // their norms in M
};

/// Groups of neighbours in ascending omega^2 that are one frequency: closer than 1e-8.
std::vector<std::vector<int>> equal_groups(const Eigen::VectorXd& omega);

}  // namespace flexboom
