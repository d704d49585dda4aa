#pragma once

#include "fem/mesh/element.hpp"

#include <Eigen/Core>

// Pieces that all solid elements share: isotropic elasticity at a point, and sums of it over points.
namespace flexboom::elasticity {

using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Lame's constants [Pa].
struct Lame {
  double lambda = 0;
  double mu = 0;
};
Lame lame(const Material&);

const Material& material_of(const Mesh&, const Element&);

/// Nodes less the first one (n x 3): digits of a small element far from the origin.
Eigen::MatrixX3d local_positions(const Mesh&, const Element&);

/// Strain rows xx yy zz xy yz zx (engineering shear) over the freedoms of n nodes from gradients (n x 3): 6 x 3 n.
Eigen::MatrixXd strain_rows(const Eigen::Ref<const Eigen::MatrixX3d>& gradients);

/// Elasticity matrix of those strains [Pa].
Eigen::MatrixXd elasticity_matrix(const Lame&);

/// u and half its curl over the freedoms of n nodes: 6 x 3 n.
Matrix6X motion_rows(const Eigen::Ref<const Eigen::VectorXd>& values,
                     const Eigen::Ref<const Eigen::MatrixX3d>& gradients);

/// Lower triangle of K over 3 n freedoms from the lower triangle of the sums H = sum w g g^T of gradients g stacked by
/// component (3 n x 3 n): K_ab = lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I.
Eigen::MatrixXd stiffness_from_gradients(const Eigen::MatrixXd& H, const Lame&);

/// Lower triangle of M over 3 n freedoms from the scalar mass matrix (n x n, lower triangle read).
Eigen::MatrixXd mass_from_scalar(const Eigen::MatrixXd& m);

/// Calls visit(dm, u0, N) with N = values x I; keeps its buffer between points.
class MassPoint {
 public:
  explicit MassPoint(Eigen::Index nodes) : N_(Eigen::Matrix3Xd::Zero(3, 3 * nodes)) {}
  void visit(double dm, const Eigen::Vector3d& u0, const Eigen::Ref<const Eigen::VectorXd>& values,
             const MassPointVisitor&);

 private:
  Eigen::Matrix3Xd N_;
};

/// Whether a Jacobian (columns: slopes of the position) is positive and more than round-off of its columns.
inline bool is_valid(const Eigen::Matrix3d& J, double determinant) {
  constexpr double flat = 1e-12;  // volume over product of edges
  return determinant > 0 && determinant * determinant >
                                flat * flat * J.col(0).squaredNorm() * J.col(1).squaredNorm() * J.col(2).squaredNorm();
}

/// @throws InputError when the solid property is missing.
void require_property(const Mesh&, const Element&);

/// @throws InputError that says at which integration point (from 0) an element is inverted.
[[noreturn]] void throw_inverted(double determinant, int point);

}  // namespace flexboom::elasticity
