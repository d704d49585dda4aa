#include "reduction/modal_basis.hpp"

#include "fem/check.hpp"
#include "reduction/mode_kind.hpp"

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

int nearest_node(const Mesh& mesh, const std::vector<int>& nodes, const Vector3d& place) {
  return *std::ranges::min_element(nodes, {}, [&](int node) { return (mesh.nodes.col(node) - place).squaredNorm(); });
}

/// The node whose motion gives a mode its direction, sign and size: of the set "tip" the one nearest to its middle, or
/// the node furthest from what is clamped.
int tip_node(const Mesh& mesh, const Clamp& clamp) {
  const auto set = mesh.node_sets.find("tip");
  if (set != mesh.node_sets.end() && !set->second.empty())
    return nearest_node(mesh, set->second, mesh.nodes(Eigen::all, set->second).rowwise().mean());
  Vector3d held = mesh.nodes.rowwise().mean();
  if (!clamp.nodes.empty()) held = mesh.nodes(Eigen::all, clamp.nodes).rowwise().mean();
  Index furthest = 0;
  (mesh.nodes.colwise() - held).colwise().squaredNorm().maxCoeff(&furthest);
  return static_cast<int>(furthest);
}

/// Motion (u, theta) of a node in every mode, 6 x n; a node of solids has no theta.
MatrixXd node_motion(const DofMap& dofs, const MatrixXd& Phi, int node) {
  MatrixXd motion = MatrixXd::Zero(6, Phi.cols());
  const int freedoms = dofs.freedoms_of(node);
  motion.topRows(freedoms) = Phi.middleRows(dofs.of_node(node, 0), freedoms);
  return motion;
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
void align_groups(MatrixXd& Phi, const DofMap& dofs, const EigenSummary& summary, int tip, double mass, double length) {
  const double deflection = 1 / std::sqrt(mass);
  VectorXd scale(6);
  scale << deflection, deflection, deflection, VectorXd::Constant(3, deflection / length);
  for (const std::vector<int>& group : summary.pairs) {
    auto shapes = Phi.middleCols(group.front(), static_cast<Index>(group.size()));
    const MatrixXd F = node_motion(dofs, shapes, tip)(alignment_order, Eigen::all);
    shapes = (shapes * alignment(F, scale)).eval();
  }
}

/// Freedom of the tip that gives a mode of that kind its sign; -1: none.
int leading_component(ModeKind kind, int axis) {
  switch (kind) {
    case ModeKind::bending_x:
      return 0;
    case ModeKind::bending_y:
      return 1;
    case ModeKind::bending_z:
      return 2;
    case ModeKind::axial:
      return axis;
    case ModeKind::torsion:
      return 3 + axis;
    case ModeKind::rigid:
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
double scale_of(const VectorXd& phi, const VectorXd& tip_motion, int component, double mass, double length) {
  const double rms = 1 / std::sqrt(mass);
  if (component < 0) {
    Index largest = 0;
    tip_motion.head<3>().cwiseAbs().maxCoeff(&largest);
    component = static_cast<int>(largest);
  }
  const double leading = tip_motion(component);
  const bool by_tip = component < 3 && std::abs(leading) > 0.1 * rms;
  if (by_tip) return 2 / leading;
  return sign_of(phi, leading, component < 3 ? rms : rms / length) * std::sqrt(mass);
}

double length_of(const Mesh& mesh) {
  return (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm();
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

/// A mesh whose constraints are eliminated: all that its modes need of the assembly.
struct Reduced {
  Unknowns unknowns;
  SparseMatrix K, M;  // over the unknowns
  VectorXd weights;   // diagonal of M over all freedoms
  double mass = 0;    // [kg]
};

/// The first `wanted` modes over all freedoms of the mesh, aligned, of the right sign and size.
ModalBasis finished(const Mesh& mesh, const DofMap& dofs, const Reduced& reduced, const EigenPairs& pairs, int wanted,
                    int tip, int rigid, int threads) {
  const double length = length_of(mesh);
  MatrixXd Phi = reduced.unknowns.expanded(pairs.Phi);
  align_groups(Phi, dofs, pairs.summary, tip, reduced.mass, length);

  ModalBasis basis;
  basis.Phi = Phi.leftCols(wanted);
  basis.summary = pairs.summary;
  basis.mass = reduced.mass;
  basis.unknowns = reduced.unknowns.count;
  basis.rigid_freedoms = rigid;
  basis.kind = mode_kinds(mesh, dofs, reduced.weights, basis.Phi);
  std::fill_n(basis.kind.begin(), std::min(rigid, wanted), ModeKind::rigid);
  const MatrixXd tip_motion = node_motion(dofs, basis.Phi, tip);
  const int axis = long_axis(mesh);
  for (Index i = 0; i < wanted; ++i) {
    const int component = leading_component(basis.kind[static_cast<size_t>(i)], axis);
    basis.Phi.col(i) *= scale_of(basis.Phi.col(i), tip_motion.col(i), component, reduced.mass, length);
  }
  // Rayleigh quotients summed over element strains: phi^T K phi of a stiff, slender body cancels to noise in its last
  // digits.
  const VectorXd strain = strain_energies(mesh, dofs, basis.Phi, threads);
  const MatrixXd X = basis.Phi(reduced.unknowns.free_dofs(), Eigen::all);
  const VectorXd kinetic = X.cwiseProduct(symmetric_product(reduced.M, X)).colwise().sum().transpose() / 2;
  basis.omega = strain.cwiseQuotient(kinetic).cwiseSqrt();
  keep_modes(basis.summary, wanted, [](int i) { return i; });
  return basis;
}

Reduced reduced(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp) {
  Reduced result{unknowns(mesh, assembly.dofs, clamp), {}, {}, assembly.M.diagonal(), total_mass(mesh, assembly)};
  result.K = result.unknowns.reduced(assembly.K);
  result.M = result.unknowns.reduced(assembly.M);
  return result;
}

ModalBasis modes_of(const Mesh& mesh, const DofMap& dofs, const Clamp& clamp, const Reduced& reduced,
                    const EigenOptions& options, int threads) {
  const int rigid = rigid_freedoms(mesh, dofs, clamp);
  EigenOptions whole = options;  // half a pair cannot be aligned, so its other half is solved for as well
  whole.num_modes = options.num_modes >= reduced.unknowns.count ? options.num_modes : options.num_modes + 1;
  whole.whole_groups = true;
  const EigenPairs pairs = solve_modes({reduced.K, reduced.M, rigid > 0}, whole);
  return finished(mesh, dofs, reduced, pairs, options.num_modes, tip_node(mesh, clamp), rigid, threads);
}

}  // namespace

ModalBasis clamped_modes(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, const EigenOptions& options,
                         int threads) {
  return modes_of(mesh, assembly.dofs, clamp, reduced(mesh, assembly, clamp), options, threads);
}

ModalBasis clamped_modes_releasing(const Mesh& mesh, Assembly& assembly, const Clamp& clamp,
                                   const EigenOptions& options, int threads) {
  const Reduced kept = reduced(mesh, assembly, clamp);
  SparseMatrix().swap(assembly.K);  // an assigned empty matrix would keep the memory
  SparseMatrix().swap(assembly.M);
  return modes_of(mesh, assembly.dofs, clamp, kept, options, threads);
}

ModalBasis clamped_modes_of_kind(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, int count,
                                 const std::vector<ModeKind>& kinds, EigenOptions options) {
  const int all = unknowns(mesh, assembly.dofs, clamp).count;
  require(count >= 1 && count <= all,
          "modes: " + std::to_string(count) + " asked of a body with " + std::to_string(all) + " unknowns");
  // A first guess of how many modes hold enough of one kind: bending comes in two planes, other kinds are rare among
  // the low modes.
  options.num_modes = kinds.size() == 1 ? 2 * count + 2 : count + count / 4 + 2;
  for (;; options.num_modes *= 2) {
    options.num_modes = std::min(options.num_modes, all);
    const ModalBasis basis = clamped_modes(mesh, assembly, clamp, options);
    std::vector<int> chosen;
    for (int i = 0; i < options.num_modes && std::ssize(chosen) < count; ++i) {
      const ModeKind kind = basis.kind[static_cast<size_t>(i)];
      if (kinds.empty() || std::ranges::find(kinds, kind) != kinds.end()) chosen.push_back(i);
    }
    if (std::ssize(chosen) == count) return selected(basis, chosen);
    require(options.num_modes < all, "modes: only " + std::to_string(chosen.size()) + " of the kinds asked for, " +
                                         std::to_string(count) + " wanted; refine the mesh or ask for fewer");
  }
}

}  // namespace flexboom
