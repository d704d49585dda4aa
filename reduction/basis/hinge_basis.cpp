#include "reduction/basis/hinge_basis.hpp"

#include "fem/base/check.hpp"
#include "reduction/eigen/orthogonal_basis.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A with one row and column more: lower triangle.
SparseMatrix bordered(const SparseMatrix& A, const VectorXd& border, double corner) {
  const auto n = static_cast<int>(A.cols());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<size_t>(A.nonZeros() + n + 1));
  for (int j = 0; j < n; ++j) {
    for (SparseMatrix::InnerIterator it(A, j); it; ++it)
      entries.emplace_back(static_cast<int>(it.row()), j, it.value());
    if (border(j) != 0) entries.emplace_back(n, j, border(j));
  }
  entries.emplace_back(n, n, corner);
  SparseMatrix result(n + 1, n + 1);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

/// The body on its hinge: unknowns of the clamped body, then its rotation as a rigid body.
struct SprungBody {
  Unknowns left;
  SparseMatrix K;  // clamped
  SparseMatrix M;  // with the border of the rotation, whose motion has unit mass
  VectorXd border;
  double J = 0;  // inertia about the hinge [kg m^2]
};

SprungBody sprung_body(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, const HingeSpring& hinge) {
  const Eigen::Vector3d axis = hinge.axis.normalized();
  const MatrixXd T = rigid_motions(mesh, assembly.dofs);
  VectorXd h = T.rightCols(3) * axis - T.leftCols(3) * axis.cross(hinge.point);
  SprungBody body;
  body.J = quadratic_form(assembly.M, h)(0, 0);
  require(body.J > 0, "hinge: the body has no inertia about its axis");
  h /= std::sqrt(body.J);
  body.left = unknowns(mesh, assembly.dofs, clamp);
  body.K = body.left.reduced(assembly.K);
  body.border = body.left.reduced_loads(symmetric_product(assembly.M, h));
  body.M = bordered(body.left.reduced(assembly.M), body.border, 1);
  return body;
}

/// Elastic parts (unknowns x found) of the modes whose inertia turns the hinge, at most `wanted`, however little a
/// stiff spring gives way. In a group of equal frequencies one mode takes all of it; on a stiff spring the plane of the
/// hinge and the other one nearly are one.
MatrixXd elastic_parts(const EigenPairs& pairs, const VectorXd& border, int rigid, int wanted) {
  constexpr double equal = 1e-5;  // of omega^2
  const Index n = pairs.Phi.rows() - 1, count = pairs.Phi.cols();
  MatrixXd found(n, 0);
  for (Index first = rigid, last = 0; first < count && found.cols() < wanted; first = last + 1) {
    last = first;
    while (last + 1 < count && pairs.lambda(last + 1) - pairs.lambda(last) <= equal * pairs.lambda(last + 1)) ++last;
    const auto shapes = pairs.Phi.block(0, first, n, last - first + 1);
    const VectorXd turns = shapes.transpose() * border;
    if (turns.norm() < 1e-4) continue;  // of an M-normal mode and a rotation of M-norm 1: another plane
    found.conservativeResize(Eigen::NoChange, found.cols() + 1);
    found.rightCols<1>() = shapes * turns.normalized();
  }
  return found;
}

/// The first `modes` that turn the root, fewer where the mesh has no more, or none that round-off leaves.
MatrixXd sprung_shapes(const SprungBody& body, double stiffness, int modes, EigenOptions options) {
  const SparseMatrix K = bordered(body.K, VectorXd::Zero(body.K.cols()), stiffness / body.J);
  const int rigid = stiffness == 0 ? 1 : 0;  // the free rotation bends nothing
  const auto most = static_cast<int>(K.cols());
  options.whole_groups = true;
  options.num_modes = std::min(3 * modes + 2, most);  // out of plane, and a rigid one, beside each
  MatrixXd shapes = elastic_parts(solve_modes({K, body.M, stiffness == 0}, options), body.border, rigid, modes);
  while (shapes.cols() < modes && options.num_modes < most) {
    options.num_modes = std::min(2 * options.num_modes, most);
    try {
      shapes = elastic_parts(solve_modes({K, body.M, stiffness == 0}, options), body.border, rigid, modes);
    } catch (const NumericalError&) {
      break;  // so far beyond the lowest that they cannot be verified
    }
  }
  return shapes;
}

/// M-orthonormal shapes: `modes` for each spring. Shapes of neighbouring springs are nearly parallel. Where one adds
/// nothing to the others that solvers could tell from round-off, a higher mode of the first spring takes its place.
MatrixXd independent_shapes(const SparseMatrix& M, const SprungBody& body, const std::vector<double>& stiffness,
                            int modes, const EigenOptions& options) {
  constexpr double told_apart = 1e-5;
  MassBasis basis(M, modes * std::ssize(stiffness));
  const auto append = [&](const MatrixXd& shapes) {
    const MatrixXd X = body.left.expanded(shapes);
    const VectorXd norm = X.cwiseProduct(symmetric_product(M, X)).colwise().sum().cwiseSqrt();
    basis.append(X * norm.cwiseInverse().asDiagonal(), told_apart);
  };
  for (const double k : stiffness) {
    const MatrixXd shapes = sprung_shapes(body, k, modes, options);
    require(shapes.cols() == modes, "hinge: the mesh has only " + std::to_string(shapes.cols()) +
                                        " modes that turn the root, " + std::to_string(modes) + " wanted");
    append(shapes);
  }
  const auto missing = static_cast<int>(basis.capacity() - basis.size());
  if (missing == 0) return basis.vectors();
  const MatrixXd more = sprung_shapes(body, stiffness.front(), modes + missing, options);
  if (more.cols() > modes) append(more.rightCols(more.cols() - modes));
  return basis.vectors();
}

}  // namespace

ModalBasis hinge_adapted_modes(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, const HingeSpring& hinge,
                               int modes, const EigenOptions& options, int threads) {
  require(!hinge.stiffness.empty(), "hinge: give the stiffness of at least one regime");
  require(std::ranges::all_of(hinge.stiffness, [](double k) { return std::isfinite(k) && k >= 0; }),
          "hinge: a stiffness must not be negative");
  require(hinge.axis.norm() > 0 && hinge.axis.allFinite(), "hinge: its axis has no direction");
  require(modes >= 1, "hinge: at least one mode per stiffness, " + std::to_string(modes) + " asked for");
  require(rigid_freedoms(mesh, assembly.dofs, clamp) == 0, "hinge: the clamp does not hold the root");
  const SprungBody body = sprung_body(mesh, assembly, clamp, hinge);
  const MatrixXd X = independent_shapes(assembly.M, body, hinge.stiffness, modes, options);
  ModalBasis basis = ritz_modes(mesh, assembly, clamp, X, 0, threads);
  const auto asked = modes * std::ssize(hinge.stiffness);
  if (X.cols() < asked)
    basis.summary.note = "hinge: the springs have only " + std::to_string(X.cols()) +
                         " shapes that can be told apart, " + std::to_string(asked) + " wanted";
  basis.unknowns = body.left.count;
  return basis;
}

}  // namespace flexboom
