#include "dynamics/model/second_order_shapes.hpp"

#include "fem/base/check.hpp"
#include "reduction/body/geometric_stiffness_loads.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

/// W = sum dm a b^T from its axial vector sum dm a x b and from sum dm ((a . b) 1 - (a b^T + b a^T) / 2).
Matrix3d dyads(const Vector3d& axial, const Matrix3d& inertia) {
  Matrix3d skew;
  skew << 0, axial.z(), -axial.y(), -axial.z(), 0, axial.x(), axial.y(), -axial.x(), 0;
  return 0.5 * inertia.trace() * Matrix3d::Identity() - inertia + 0.5 * skew;
}

/// sum dm z z^T, z = (1, u0, S_1, ..., S_n), from the invariants: the inverse of set_invariants.
MatrixXd gram_of(const ReducedBody& b) {
  const Index n = b.n();
  MatrixXd gram(4 + 3 * n, 4 + 3 * n);
  const auto set = [&gram](Index row, Index column, const auto& block) {
    gram.block(row, column, block.rows(), block.cols()) = block;
    gram.block(column, row, block.cols(), block.rows()) = block.transpose();
  };
  gram(0, 0) = b.m;
  set(1, 0, b.mc0);
  set(1, 1, dyads(Vector3d::Zero(), b.J0));
  for (Index k = 0; k < n; ++k) {
    const auto ku = static_cast<size_t>(k);
    set(4 + 3 * k, 0, b.Ct.col(k));
    set(1, 4 + 3 * k, dyads(b.Cr0.col(k), 0.5 * b.J1[ku]));
    for (Index l = 0; l <= k; ++l) set(4 + 3 * k, 4 + 3 * l, dyads(b.Cr1[ku].col(l), b.J2[ku][static_cast<size_t>(l)]));
  }
  return gram;
}

/// Affine functions of the place, p = c . (1, u0), orthogonal in the mass with mean square 1: 1 and the distances from
/// the mass centre along the principal axes, over their mean. As many as the body has extensions: one of a point, two
/// of a straight line, four of a solid.
std::vector<Vector4d> affine_functions(const Eigen::Matrix4d& gram) {
  constexpr double round_off = 1e-13;  // of an extension squared
  const double m = gram(0, 0);
  const Vector3d centre = gram.block<3, 1>(1, 0) / m;
  const Matrix3d about_origin = gram.bottomRightCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(Matrix3d(about_origin - m * centre * centre.transpose()));
  std::vector<Vector4d> functions = {Vector4d::Unit(0)};
  for (Index i = 0; i < 3; ++i) {
    const double extension = principal.eigenvalues()[i];
    if (!(extension > round_off * about_origin.trace())) continue;
    Vector4d p;
    p.tail<3>() = principal.eigenvectors().col(i) * std::sqrt(m / extension);
    p[0] = -p.tail<3>().dot(centre);
    functions.push_back(p);
  }
  return functions;
}

/// Integral of rho (1, u0) u2^T, 4 x 3: its coefficient of q_k q_l.
Eigen::Matrix<double, 4, 3> second_order_moment(const GeometricStiffness& Kg, Index k, Index l) {
  const auto entry = [k, l](const std::vector<MatrixXd>& v) { return Vector3d(v[0](k, l), v[1](k, l), v[2](k, l)); };
  Matrix3d J;  // the inertia of u0 with u2: w^T J w q_k q_l = -(sum w_i w_j Kg.spin)_kl q_k q_l
  for (size_t c = 0; c < 6; ++c) {
    const auto [i, j] = spin_products[c];
    J(i, j) = J(j, i) = (c < 3 ? -1.0 : -0.5) * Kg.spin[c](k, l);
  }
  Eigen::Matrix<double, 4, 3> moment;
  moment.row(0) = 0.5 * entry(Kg.acceleration).transpose();
  moment.bottomRows<3>() = dyads(0.5 * entry(Kg.angular_acceleration), 0.5 * J);
  return moment;
}

/// An affine function along an axis.
struct AffineShape {
  Vector4d function;
  Index axis = 0;
};

}  // namespace

SecondOrderShapes with_second_order_shapes(const ReducedBody& b) {
  require(!b.Kg.spin.empty(),
          fmt::format("body {}: its geometric stiffness is asked for but the reduced body has none", b.name));
  const Index n = b.n();
  const MatrixXd gram = gram_of(b);
  std::vector<AffineShape> shapes;
  for (const Vector4d& p : affine_functions(gram.topLeftCorner<4, 4>()))
    for (Index axis = 0; axis < 3; ++axis) shapes.push_back({p, axis});
  std::vector<MatrixXd> follow(shapes.size(), MatrixXd(n, n));
  for (Index k = 0; k < n; ++k)
    for (Index l = 0; l < n; ++l) {
      const Eigen::Matrix<double, 4, 3> u2 = second_order_moment(b.Kg, k, l);
      for (size_t s = 0; s < shapes.size(); ++s)
        follow[s](k, l) = 2 / b.m * shapes[s].function.dot(u2.col(shapes[s].axis));
    }
  double largest = 0;
  for (const MatrixXd& H : follow) largest = std::max(largest, H.cwiseAbs().maxCoeff());

  SecondOrderShapes r;
  MatrixXd L = MatrixXd::Identity(4 + 3 * n, 4 + 3 * n);  // (1, u0, S) -> (1, u0, S, affine shapes)
  for (size_t s = 0; s < shapes.size(); ++s) {
    constexpr double negligible = 1e-12;  // round-off of the reduction
    if (follow[s].cwiseAbs().maxCoeff() <= negligible * largest) continue;
    L.conservativeResizeLike(MatrixXd::Zero(L.rows() + 3, L.cols()));
    L.row(L.rows() - 3 + shapes[s].axis).head<4>() = shapes[s].function;
    r.follow.emplace_back(0.5 * (follow[s] + follow[s].transpose()));
  }
  r.body = blank_body(b.name, static_cast<int>(n + std::ssize(r.follow)));
  set_invariants(r.body, L * gram * L.transpose());
  return r;
}

MatrixXd modal_stiffness(const ReducedBody& b, const VectorXd& q_ddot) {
  const Index n = b.n();
  if (b.Kg.spin.empty() || n == 0) return MatrixXd::Zero(n, n);
  Matrix3d J = Matrix3d::Zero();
  for (Index k = 0; k < n; ++k) J += 0.5 * q_ddot[k] * b.J1[static_cast<size_t>(k)];
  Eigen::Matrix4d gram;
  gram << b.m, b.mc0.transpose(), b.mc0, dyads(Vector3d::Zero(), b.J0);
  Eigen::Matrix<double, 4, 3> moment;  // integral of rho (1, u0) (S q_ddot)^T
  moment << (b.Ct * q_ddot).transpose(), dyads(b.Cr0 * q_ddot, J);
  Eigen::Matrix<double, 4, 3> field = Eigen::Matrix<double, 4, 3>::Zero();  // its transpose times (1, u0)
  for (const Vector4d& p : affine_functions(gram)) field += p * (p.transpose() * moment) / b.m;
  // c + [alpha]~ u0 + (P - tr P) u0: the last as if of a spin whose products are P.
  const Matrix3d slope = field.bottomRows<3>().transpose(), even = 0.5 * (slope + slope.transpose());
  const Matrix3d products = even - 0.5 * even.trace() * Matrix3d::Identity();
  const Vector3d alpha =
      0.5 * Vector3d(slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1));
  MatrixXd K = motion_stiffness(b, Vector3d::Zero(), field.row(0).transpose(), alpha);
  for (size_t c = 0; c < 6; ++c) K += products(spin_products[c].first, spin_products[c].second) * b.Kg.spin[c];
  return K;
}

}  // namespace flexboom
