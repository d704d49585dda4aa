#include "reduction/modal_basis.hpp"

#include "fem/assembly.hpp"
#include "fem/check.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

int tip_node(const Mesh& mesh) {
  const auto set = mesh.node_sets.find("tip");
  const bool found = set != mesh.node_sets.end() && !set->second.empty();
  return found ? set->second.front() : static_cast<int>(mesh.nodes.cols()) - 1;
}

/// First and last index of the group that holds mode i.
std::pair<int, int> group_of(const EigenSummary& summary, int i) {
  for (const std::vector<int>& group : summary.pairs) {
    if (group.front() <= i && i <= group.back()) return {group.front(), group.back()};
  }
  return {i, i};
}

/// Solves for `wanted` modes and as many more as it takes to have the last group whole: half a pair cannot be aligned.
EigenPairs whole_groups(const EigenProblem& problem, EigenOptions options) {
  const int wanted = options.num_modes;
  const auto n = static_cast<int>(problem.K.rows());
  for (int asked = wanted + 1;; asked += 3) {
    options.num_modes = wanted >= n ? wanted : std::min(asked, n);
    EigenPairs pairs = solve_modes(problem, options);
    if (options.num_modes >= n || group_of(pairs.summary, wanted - 1).second < options.num_modes - 1) return pairs;
  }
}

/// What a group is aligned to, in this order: deflection of the tip along y, z, x, then its rotations about x, y, z.
constexpr std::array<int, 6> alignment_order = {1, 2, 0, 3, 4, 5};

/// Orthogonal matrix Q such that the columns of (shapes * Q) take up the tip motions one after the other: F Q is lower
/// triangular, with F the tip motions (rows in alignment order) of the shapes. Motions the group does not have are
/// skipped.
MatrixXd alignment(const MatrixXd& F, const VectorXd& scale) {
  const Index g = F.cols();
  MatrixXd Q(g, g);
  Index found = 0;
  for (Index row = 0; row < F.rows() && found < g; ++row) {
    VectorXd direction = F.row(row).transpose();
    for (int twice = 0; twice < 2; ++twice)
      direction -= Q.leftCols(found) * (Q.leftCols(found).transpose() * direction);
    // 1e-5 of a typical tip motion: far above what the solver leaves in a mode of the other plane, far below a real
    // motion.
    if (direction.norm() > 1e-5 * scale(row)) Q.col(found++) = direction.normalized();
  }
  for (Index axis = 0; found < g; ++axis) {  // no tip motion left to align to: any complement will do
    VectorXd direction = VectorXd::Unit(g, axis);
    for (int twice = 0; twice < 2; ++twice)
      direction -= Q.leftCols(found) * (Q.leftCols(found).transpose() * direction);
    if (direction.norm() > 0.5 / std::sqrt(static_cast<double>(g))) Q.col(found++) = direction.normalized();
  }
  return Q;
}

/// Turns each group of equal frequencies to the body's axes. M-orthonormal shapes have tip deflections of the order of
/// 1 / sqrt(m).
void align_groups(MatrixXd& Phi, const EigenSummary& summary, int tip, double mass, double length) {
  const double deflection = 1 / std::sqrt(mass);
  VectorXd scale(6);
  scale << deflection, deflection, deflection, VectorXd::Constant(3, deflection / length);
  for (const std::vector<int>& group : summary.pairs) {
    auto shapes = Phi.middleCols(group.front(), static_cast<Index>(group.size()));
    MatrixXd F(6, shapes.cols());
    for (Index row = 0; row < 6; ++row) {
      F.row(row) = shapes.row(DofMap::of_node(tip, alignment_order[static_cast<size_t>(row)]));
    }
    shapes = (shapes * alignment(F, scale)).eval();
  }
}

/// Mass-weighted squares of the motion of the beam axis along x, y, z and of the twist, one column per mode.
using Shares = Eigen::Matrix<double, 4, Eigen::Dynamic>;

Shares motion_shares(const Mesh& mesh, const DofMap& dofs, const MatrixXd& Phi) {
  Shares shares = Shares::Zero(4, Phi.cols());
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    const ElementType& type = element_types()[static_cast<size_t>(element.type)];
    const MatrixXd shapes = Phi(dofs.of_element(mesh, static_cast<int>(e)), Eigen::all);
    const Vector3d start = mesh.nodes.col(element.nodes.front());
    const Vector3d along = mesh.nodes.col(element.nodes.back()) - start;
    const Vector3d axis = along.normalized();
    double last = -1;
    MatrixXd motion;  // 6 x n: displacement and rotation of the axis abreast of the point
    type.mass_points(mesh, element, 0, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Eigen::Matrix3Xd>&) {
      const double s = (u0 - start).dot(along) / along.squaredNorm();
      if (std::abs(s - last) > 1e-12)
        motion = type.interpolation(mesh, element, s) * shapes;  // one station has several points
      last = s;
      const double radius_squared = (u0 - start - s * along).squaredNorm();
      shares.topRows(3).array() += dm * motion.topRows(3).array().square();
      shares.row(3).array() += dm * radius_squared * (axis.transpose() * motion.bottomRows(3)).array().square();
    });
  }
  return shares;
}

ModeKind kind_of(const Eigen::Vector4d& shares) {
  constexpr std::array kinds = {ModeKind::axial, ModeKind::bending_y, ModeKind::bending_z, ModeKind::torsion};
  Index largest = 0;
  const double share = shares.maxCoeff(&largest);
  return share > 0.5 * shares.sum() ? kinds[static_cast<size_t>(largest)] : ModeKind::other;
}

/// Freedom of the tip that gives a mode of that kind its sign.
int leading_component(ModeKind kind) {
  switch (kind) {
    case ModeKind::bending_y:
      return 1;
    case ModeKind::bending_z:
      return 2;
    case ModeKind::axial:
      return 0;
    case ModeKind::torsion:
      return 3;
    case ModeKind::other:
      break;
  }
  return -1;
}

/// Sign from the leading tip motion, or from the largest entry where the tip stands still.
double sign_of(const VectorXd& phi, double leading, double typical) {
  if (std::abs(leading) > 1e-6 * typical) return std::copysign(1.0, leading);
  Index largest = 0;
  phi.cwiseAbs().maxCoeff(&largest);
  return std::copysign(1.0, phi(largest));
}

/// Factor that gives an M-normal shape its sign and size: tip deflection +2, or Me = m for torsion and where the tip
/// hardly moves (under a tenth of the root-mean-square motion of the body, 1 / sqrt(m)): there a deflection of 2 would
/// blow the shape up.
double scale_of(const VectorXd& phi, ModeKind kind, int tip, double mass, double length) {
  const double rms = 1 / std::sqrt(mass);
  int component = leading_component(kind);
  if (component < 0) {
    phi.segment<3>(DofMap::of_node(tip, 0)).cwiseAbs().maxCoeff(&component);
  }
  const double leading = phi(DofMap::of_node(tip, component));
  const bool by_tip = component < 3 && std::abs(leading) > 0.1 * rms;
  if (by_tip) return 2 / leading;
  return sign_of(phi, leading, component < 3 ? rms : rms / length) * std::sqrt(mass);
}

double length_of(const Mesh& mesh) {
  return (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm();
}

double mass_of(const Mesh& mesh, const DofMap& dofs) {
  double mass = 0;
  for_each_mass_point(mesh, dofs,
                      [&mass](double dm, const Vector3d&, const auto&, std::span<const int>) { mass += dm; });
  return mass;
}

/// Renames the modes in the groups: mode i becomes new_index(i), and leaves if that is not in 0 .. count - 1.
template <class NewIndex>
void keep_modes(EigenSummary& summary, int count, const NewIndex& new_index) {
  for (std::vector<int>& group : summary.pairs) {
    for (int& i : group) i = new_index(i);
    std::erase_if(group, [count](int i) { return i < 0 || i >= count; });
  }
  std::erase_if(summary.pairs, [](const std::vector<int>& group) { return group.size() < 2; });
}

/// The listed modes of a basis.
ModalBasis selected(const ModalBasis& basis, const std::vector<int>& modes) {
  ModalBasis result = basis;
  result.Phi = basis.Phi(Eigen::all, modes);
  result.omega = basis.omega(modes);
  result.kind.clear();
  for (const int i : modes) result.kind.push_back(basis.kind[static_cast<size_t>(i)]);
  keep_modes(result.summary, static_cast<int>(modes.size()), [&modes](int i) {
    const auto place = std::ranges::find(modes, i);
    return place == modes.end() ? -1 : static_cast<int>(place - modes.begin());
  });
  return result;
}

/// The first `wanted` modes over all freedoms of the mesh, aligned, of the right sign and size.
ModalBasis finished(const Mesh& mesh, const Assembly& assembly, const std::vector<int>& free, const EigenPairs& pairs,
                    int wanted) {
  const double mass = mass_of(mesh, assembly.dofs);
  const double length = length_of(mesh);
  const int tip = tip_node(mesh);
  MatrixXd Phi = MatrixXd::Zero(assembly.dofs.count, pairs.Phi.cols());
  Phi(free, Eigen::all) = pairs.Phi;
  align_groups(Phi, pairs.summary, tip, mass, length);

  ModalBasis basis;
  basis.Phi = Phi.leftCols(wanted);
  basis.omega.resize(wanted);
  basis.summary = pairs.summary;
  basis.unknowns = static_cast<int>(free.size());
  const Shares shares = motion_shares(mesh, assembly.dofs, basis.Phi);
  for (Index i = 0; i < wanted; ++i) {
    const ModeKind kind = kind_of(shares.col(i));
    basis.kind.push_back(kind);
    basis.Phi.col(i) *= scale_of(basis.Phi.col(i), kind, tip, mass, length);
    // Rayleigh quotient summed over element strains: phi^T K phi of a stiff, slender body cancels to noise in its last
    // digits.
    const PointEnergies energy = point_energies(mesh, assembly.dofs, basis.Phi.col(i));
    basis.omega(i) = std::sqrt(energy.strain / energy.kinetic);
  }
  keep_modes(basis.summary, wanted, [](int i) { return i; });
  return basis;
}

}  // namespace

std::string_view name_of(ModeKind kind) {
  switch (kind) {
    case ModeKind::bending_y:
      return "bending_y";
    case ModeKind::bending_z:
      return "bending_z";
    case ModeKind::torsion:
      return "torsion";
    case ModeKind::axial:
      return "axial";
    case ModeKind::other:
      break;
  }
  return "other";
}

ModalBasis clamped_modes(const Mesh& mesh, const Assembly& assembly, const std::vector<int>& clamp,
                         const EigenOptions& options) {
  const std::vector<int> free = free_dofs(assembly.dofs, clamp);
  require(!free.empty(), "modes: every freedom is clamped");
  const SparseMatrix K = submatrix(assembly.K, free);
  const SparseMatrix M = submatrix(assembly.M, free);
  const EigenPairs pairs = whole_groups({K, M, clamp.empty()}, options);
  ModalBasis basis = finished(mesh, assembly, free, pairs, options.num_modes);
  basis.clamped = !clamp.empty();
  return basis;
}

ModalBasis clamped_modes_of_kind(const Mesh& mesh, const Assembly& assembly, const std::vector<int>& clamp, int count,
                                 const std::vector<ModeKind>& kinds, EigenOptions options) {
  const auto unknowns = static_cast<int>(free_dofs(assembly.dofs, clamp).size());
  require(count >= 1 && count <= unknowns,
          "modes: " + std::to_string(count) + " asked of a body with " + std::to_string(unknowns) + " unknowns");
  // A first guess of how many modes hold enough of one kind: bending comes in two planes, other kinds are rare among
  // the low modes.
  options.num_modes = kinds.size() == 1 ? 2 * count + 2 : count + count / 4 + 2;
  for (;; options.num_modes *= 2) {
    options.num_modes = std::min(options.num_modes, unknowns);
    const ModalBasis basis = clamped_modes(mesh, assembly, clamp, options);
    std::vector<int> chosen;
    for (int i = 0; i < options.num_modes && std::ssize(chosen) < count; ++i) {
      const ModeKind kind = basis.kind[static_cast<size_t>(i)];
      if (kinds.empty() || std::ranges::find(kinds, kind) != kinds.end()) chosen.push_back(i);
    }
    if (std::ssize(chosen) == count) return selected(basis, chosen);
    require(options.num_modes < unknowns, "modes: only " + std::to_string(chosen.size()) + " of the kinds asked for, " +
                                              std::to_string(count) + " wanted; refine the mesh or ask for fewer");
  }
}

}  // namespace flexboom
