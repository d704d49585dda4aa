#include "reduction/invariants/prestressed.hpp"

#include "fem/base/check.hpp"
#include "reduction/body/tilde.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Products sum dm a b^T (3 x 3) of fields of vectors over the body. The fields are the rotations of the root and the
/// coordinates. Then come the acceleration c of the mass where the body stands as it was made, and the position u0.
class Moments {
 public:
  Moments(const ReducedBody& body, const SteadyMotion& motion, const std::vector<Vector3d>& turns)
      : freedoms(std::ssize(turns) + body.n()) {
    // Each field is L z with z = (1, u0, S_1, ..., S_n), of which `gram` has the products.
    MatrixXd L = MatrixXd::Zero(3 * (freedoms + 2), body.gram.cols());
    const auto field = [&L](Index i) { return L.middleRows<3>(3 * i); };
    Index i = 0;
    for (const Vector3d& axis : turns) field(i++).middleCols<3>(1) = tilde(axis);
    for (Index k = 0; k < body.n(); ++k) field(i++).middleCols<3>(4 + 3 * k).setIdentity();
    field(i).col(0) = motion.acceleration;
    field(i++).middleCols<3>(1) = tilde(motion.spin) * tilde(motion.spin);
    field(i).middleCols<3>(1).setIdentity();
    products_ = L * body.gram * L.transpose();
  }

  Matrix3d between(Index i, Index k) const { return products_.block<3, 3>(3 * i, 3 * k); }
  Matrix3d acceleration_and(Index i) const { return between(freedoms, i); }
  Matrix3d acceleration_and_position() const { return between(freedoms, freedoms + 1); }

  const Index freedoms;

 private:
  MatrixXd products_;
};

struct Matrices {
  MatrixXd K, M;
};

/// Matrices over rotations of the root and coordinates. M is the second derivatives of sum dm (v . v) / 2. K is those
/// of the potential V = q^T (Ke + Kg) q / 2 - sum dm (Omega x u)^2 / 2 + sum dm c . u. u is taken to second order in
/// the rotation theta: theta x u0 + theta x (theta x u0) / 2 + S q + theta x S q.
Matrices matrices_of(const ReducedBody& body, const SteadyMotion& motion, const std::vector<Vector3d>& turns) {
  const Moments moments(body, motion, turns);
  const Index count = moments.freedoms, r = count - body.n();
  Matrices m{MatrixXd::Zero(count, count), MatrixXd::Zero(count, count)};
  m.K.bottomRightCorner(body.n(), body.n()) = body.Ke + motion_stiffness(body, motion.spin, motion.acceleration);
  for (Index i = 0; i < count; ++i) {
    for (Index k = 0; k < count; ++k) {
      const Matrix3d W = moments.between(i, k);
      m.M(i, k) = W.trace();
      m.K(i, k) -= motion.spin.squaredNorm() * W.trace() - motion.spin.dot(W * motion.spin);
    }
  }
  const Matrix3d C = moments.acceleration_and_position();
  for (Index i = 0; i < r; ++i) {
    const Vector3d& a = turns[static_cast<size_t>(i)];
    for (Index k = 0; k < r; ++k) {
      const Vector3d& b = turns[static_cast<size_t>(k)];
      m.K(i, k) += (a.dot(C * b) + b.dot(C * a)) / 2 - a.dot(b) * C.trace();
    }
    for (Index k = r; k < count; ++k) {
      const double work = -a.dot(axial(moments.acceleration_and(k)));  // sum dm c . (a x S_k)
      m.K(i, k) += work, m.K(k, i) += work;
    }
  }
  return m;
}

/// Axes of length 1 about which the body has inertia.
std::vector<Vector3d> axes_with_inertia(const ReducedBody& body, const std::vector<Vector3d>& turns) {
  std::vector<Vector3d> axes;
  for (const Vector3d& axis : turns) {
    require(axis.allFinite() && axis.norm() > 0, "prestressed: an axis about which the root turns has no direction");
    axes.push_back(axis.normalized());
    if (axes.back().dot(body.J0 * axes.back()) <= 1e-14 * body.J0.norm()) axes.pop_back();
  }
  return axes;
}

}  // namespace

PrestressedShapes prestressed_shapes(const ReducedBody& body, const SteadyMotion& motion, int modes) {
  require(body.gram.size() > 0 && !body.Kg.spin.empty(),
          "prestressed: body \"" + body.name + "\" has no geometric stiffness, or no gram");
  require(motion.spin.allFinite() && motion.acceleration.allFinite(), "prestressed: its motion is not finite");
  constexpr double negligible = 1e-9;  // of an M-normal mode: round-off of a rigid rotation, or of shapes before it
  const std::vector<Vector3d> turns = axes_with_inertia(body, motion.turns);
  Matrices m = matrices_of(body, motion, turns);
  const VectorXd scale = m.M.diagonal().cwiseSqrt().cwiseInverse();
  m.K = scale.asDiagonal() * m.K * scale.asDiagonal();
  m.M = scale.asDiagonal() * m.M * scale.asDiagonal();
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(m.K, m.M);
  if (solver.info() != Eigen::Success)
    throw NumericalError(fmt::format("prestressed: the modes of body \"{}\" were not found", body.name));

  PrestressedShapes shapes{MatrixXd(body.n(), modes), VectorXd(modes)};
  Index found = 0;
  for (Index i = 0; i < solver.eigenvalues().size() && found < modes; ++i) {
    VectorXd x = (scale.asDiagonal() * solver.eigenvectors().col(i)).tail(body.n());
    for (int pass = 0; pass < 2; ++pass) {
      const auto before = shapes.X.leftCols(found);
      x -= before * (before.transpose() * (body.Me * x));
    }
    const double size = std::sqrt(x.dot(body.Me * x));
    if (size <= negligible) continue;
    shapes.X.col(found) = x / size;
    shapes.lambda[found++] = solver.eigenvalues()[i];
  }
  require(found == modes, fmt::format("prestressed: body \"{}\" has only {} shapes that can be told apart, {} wanted",
                                      body.name, found, modes));
  return shapes;
}

PrestressedBasis prestressed_modes(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp,
                                   const SteadyMotion& motion,
                                   const std::function<ModalBasis(int count)>& clamped_modes, int most, int modes,
                                   int threads) {
  constexpr int work = 4'000'000;  // modes times unknowns: more of them take long to find
  const int first = 2 * modes + 8, bearable = std::max(first, std::min(400, work / most));
  constexpr double converged = 1e-6;
  require(modes >= 1 && modes <= most,
          fmt::format("prestressed: {} modes asked of a body with {} unknowns", modes, most));
  PrestressedBasis result;
  ModalBasis clamped;
  PrestressedShapes shapes;
  double change = 1;  // of squared frequencies
  int last = 0, before_last = 0;
  GeometricOptions options;
  options.threads = threads;
  for (int count = std::min(first, most); change > converged && last < most && count <= bearable;
       count = std::min(2 * count, most)) {
    try {
      clamped = clamped_modes(count);
    } catch (const std::runtime_error&) {
      if (last == 0) throw;
      break;  // there are no more, or they cannot be verified so far beyond the lowest
    }
    before_last = std::exchange(last, count);
    result.clamped = reduce(mesh, assembly, clamped, "clamped", threads);
    result.clamped.Kg = geometric_stiffness(mesh, assembly, clamp, clamped.Phi, options);
    const VectorXd before = std::exchange(shapes, prestressed_shapes(result.clamped, motion, modes)).lambda;
    if (before.size() > 0) change = ((shapes.lambda - before).array() / shapes.lambda.array()).abs().maxCoeff();
  }
  result.basis = ritz_modes(mesh, assembly, clamp, clamped.Phi * shapes.X, 0, threads);
  result.basis.unknowns = clamped.unknowns;
  if (change > converged && last < most)
    result.basis.summary.note =
        before_last == 0
            ? fmt::format("prestressed: combined of {} clamped modes; what more would change was not measured", last)
            : fmt::format("prestressed: {} clamped modes instead of {} change its frequencies by {:.0e}", last,
                          before_last, std::sqrt(change));
  result.clamped_Phi = std::move(clamped.Phi);
  return result;
}

MatrixXd clamped_parts(const PrestressedBasis& made, const Assembly& assembly, const MatrixXd& Phi) {
  return made.clamped.Me.diagonal().cwiseInverse().asDiagonal() *  // clamped modes are M-orthogonal
         (made.clamped_Phi.transpose() * symmetric_product(assembly.M, Phi));
}

}  // namespace flexboom
