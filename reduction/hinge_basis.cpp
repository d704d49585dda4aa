#include "reduction/hinge_basis.hpp"

#include "fem/check.hpp"

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
  double J = 0;    // inertia about the hinge [kg m^2]
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
  const VectorXd border = body.left.reduced_loads(symmetric_product(assembly.M, h));
  body.M = bordered(body.left.reduced(assembly.M), border, 1);
  return body;
}

/// Elastic parts (unknowns x found) of the modes that turn the root, at most `wanted`. In a group of equal frequencies
/// one mode takes the whole rotation.
MatrixXd elastic_parts(const EigenPairs& pairs, int wanted) {
  const Index n = pairs.Phi.rows() - 1;
  MatrixXd found(n, 0);
  const auto group_of = [&pairs](int i) {
    for (const std::vector<int>& group : pairs.summary.pairs) {
      if (std::ranges::find(group, i) != group.end()) return group;
    }
    return std::vector<int>{i};
  };
  for (int i = 0; i < pairs.Phi.cols() && found.cols() < wanted;) {
    const std::vector<int> group = group_of(i);
    i = group.back() + 1;
    const MatrixXd shapes = pairs.Phi(Eigen::all, group);
    const VectorXd turns = shapes.row(n).transpose();
    if (turns.norm() < 1e-6) continue;  // the rotation of an M-normal mode, M-norm: this one leaves the root at rest
    const VectorXd elastic = shapes.topRows(n) * turns.normalized();
    if (elastic.norm() < 1e-9 * shapes.topRows(n).norm() || pairs.lambda(group.front()) <= 0) continue;
    found.conservativeResize(Eigen::NoChange, found.cols() + 1);
    found.rightCols<1>() = elastic;
  }
  return found;
}

MatrixXd sprung_shapes(const SprungBody& body, double stiffness, int modes, EigenOptions options) {
  const SparseMatrix K = bordered(body.K, VectorXd::Zero(body.K.cols()), stiffness / body.J);
  options.whole_groups = true;
  for (options.num_modes = 3 * modes + 2;; options.num_modes *= 2) {  // out of plane, and a rigid one, beside each
    options.num_modes = std::min(options.num_modes, static_cast<int>(K.cols()));
    const EigenPairs pairs = solve_modes({K, body.M, stiffness == 0}, options);
    const auto rigid = stiffness == 0 ? 1 : 0;  // the free rotation bends nothing
    EigenPairs elastic = pairs;
    elastic.lambda = pairs.lambda.tail(pairs.lambda.size() - rigid);
    elastic.Phi = pairs.Phi.rightCols(pairs.lambda.size() - rigid);
    for (std::vector<int>& group : elastic.summary.pairs) {
      for (int& i : group) i -= rigid;
    }
    const MatrixXd shapes = elastic_parts(elastic, modes);
    if (shapes.cols() == modes) return shapes;
    require(options.num_modes < K.cols(), "hinge: the mesh has only " + std::to_string(shapes.cols()) +
                                              " modes that turn the root, " + std::to_string(modes) + " wanted");
  }
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
  MatrixXd shapes(body.K.cols(), modes * std::ssize(hinge.stiffness));
  for (size_t i = 0; i < hinge.stiffness.size(); ++i) {
    shapes.middleCols(static_cast<Index>(i) * modes, modes) = sprung_shapes(body, hinge.stiffness[i], modes, options);
  }
  ModalBasis basis = ritz_modes(mesh, assembly, clamp, body.left.expanded(shapes), 0, threads);
  basis.unknowns = body.left.count;
  return basis;
}

}  // namespace flexboom
