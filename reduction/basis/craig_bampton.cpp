#include "reduction/basis/craig_bampton.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/static_shapes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What is held and what is kept.
struct Plan {
  Mesh held;   // the mesh with the reference interface supported
  Mesh fixed;  // and all the others
  Clamp clamp;
  std::vector<InterfaceNode> kept;
  std::vector<std::vector<int>> freedoms;  // of each that is kept
  std::vector<int> all_freedoms;
};

Mesh supported(Mesh mesh, const std::vector<InterfaceNode>& interfaces) {
  for (const InterfaceNode& i : interfaces) mesh.supports.push_back({i.node, i.components});
  return mesh;
}

Plan plan_of(const Mesh& mesh, const DofMap& dofs, const std::vector<InterfaceNode>& interfaces,
             const std::string& reference, const Clamp& clamp) {
  Plan plan{clamp.with_supports ? mesh : without_supports(mesh), {}, {clamp.nodes}, {}, {}, {}};
  std::vector<InterfaceNode> references;
  for (const InterfaceNode& i : interfaces) (i.name == reference ? references : plan.kept).push_back(i);
  require(reference.empty() || references.size() == 1,
          "craig-bampton: the reference interface \"" + reference + "\" does not exist");
  plan.held = supported(std::move(plan.held), references);
  for (InterfaceNode& i : plan.kept) {
    plan.freedoms.push_back(kept_freedoms(dofs, i));
    plan.all_freedoms.insert(plan.all_freedoms.end(), plan.freedoms.back().begin(), plan.freedoms.back().end());
  }
  plan.fixed = supported(plan.held, plan.kept);
  require(
      reference.empty() || rigid_freedoms(plan.held, dofs, plan.clamp) == 0,
      "craig-bampton: the reference interface \"" + reference + "\" does not hold the body; give it all components");
  require(
      rigid_freedoms(plan.fixed, dofs, plan.clamp) == 0,
      "craig-bampton: with the kept components of all interfaces held the body can still move; keep all six of each "
      "(directions = \"all\"; \"hinge-plane\" keeps uy and rz), or name a reference");
  const int loose = rigid_freedoms(plan.held, dofs, plan.clamp), own = rigid_freedoms(without_supports(mesh), dofs, {});
  require(loose == 0 || loose == own,
          fmt::format("craig-bampton: supports hold {} of the {} rigid motions; a body that flies is held in none "
                      "(--free leaves its supports out), one that is held in all",
                      own - loose, own));
  return plan;
}

/// Unknowns of the kept interface freedoms.
std::vector<int> boundary(const Plan& plan, const Unknowns& unknowns) {
  std::vector<int> result;
  for (size_t i = 0; i < plan.kept.size(); ++i) {
    for (const int dof : plan.freedoms[i]) {
      const int unknown = unknowns.of_freedom[static_cast<size_t>(dof)];
      require(unknown >= 0 && std::ranges::find(result, unknown) == result.end(),
              "craig-bampton: a kept component of interface \"" + plan.kept[i].name +
                  "\" is supported, or another interface keeps it too");
      result.push_back(unknown);
    }
  }
  return result;
}

void append_interfaces(ModalBasis& basis, const Plan& plan) {
  int first = 0;
  for (const InterfaceNode& i : plan.kept) {
    basis.interfaces.push_back({i.name, i.components, first});
    basis.interface_nodes.push_back(i.node);
    for (int k = 0; k < 6; ++k) {
      if (!i.components[static_cast<size_t>(k)]) continue;
      basis.coordinates.push_back({"interface", 0, i.name, motion_name(k)});
      ++first;
    }
  }
}

/// [Psi_c Phi_n] with the table of its coordinates.
ModalBasis joined(const Plan& plan, const MatrixXd& Psi_c, const ModalBasis& normal) {
  ModalBasis basis;
  const Index b = Psi_c.cols(), n = normal.Phi.cols();
  basis.Phi.resize(Psi_c.rows(), b + n);
  basis.omega = VectorXd::Zero(b + n);
  basis.Phi.leftCols(b) = Psi_c;
  basis.kind.assign(static_cast<size_t>(b), ModeKind::other);
  append_interfaces(basis, plan);
  if (n == 0) return basis;
  basis.Phi.rightCols(n) = normal.Phi;
  basis.omega.tail(n) = normal.omega;
  basis.kind.insert(basis.kind.end(), normal.kind.begin(), normal.kind.end());
  basis.coordinates.insert(basis.coordinates.end(), normal.coordinates.begin(), normal.coordinates.end());
  basis.summary = normal.summary;
  for (std::vector<int>& group : basis.summary.pairs) {
    for (int& i : group) i += static_cast<int>(b);
  }
  return basis;
}

/// The modes in the span of the basis as coordinates. Rigid ones have no frequency: what strain energy round-off leaves
/// to them is none.
ModalBasis diagonal(const ModalBasis& basis, const Mesh& mesh, const Assembly& assembly, const Clamp& clamp,
                    int threads) {
  ModalBasis modes = ritz_modes(mesh, assembly, clamp, basis.Phi, basis.rigid_freedoms, threads);
  modes.omega.head(basis.rigid_freedoms).setZero();
  for (int k = 0; k < basis.rigid_freedoms; ++k) modes.coordinates[static_cast<size_t>(k)].frequency_hz = 0;
  modes.unknowns = basis.unknowns;
  modes.interfaces = basis.interfaces;
  modes.interface_nodes = basis.interface_nodes;
  for (Interface& interface : modes.interfaces) interface.first_coordinate = -1;
  return modes;
}

}  // namespace

ModalBasis craig_bampton(const Mesh& mesh, const Assembly& assembly, std::vector<InterfaceNode> interfaces,
                         const CraigBamptonOptions& options, const Clamp& clamp, int threads) {
  const Plan plan = plan_of(mesh, assembly.dofs, interfaces, options.reference, clamp);
  const Unknowns left = unknowns(plan.held, assembly.dofs, plan.clamp, plan.all_freedoms);
  const std::vector<int> b = boundary(plan, left);
  const StaticSolver solver = static_solver(plan.held, assembly, left, b);
  const MatrixXd Psi_c = left.expanded(solver.displaced(MatrixXd::Identity(std::ssize(b), std::ssize(b))));

  const int modes = options.modes.num_modes;
  ModalBasis normal;
  if (modes > 0 && options.kinds.empty())
    normal = clamped_modes(plan.fixed, assembly, plan.clamp, options.modes, threads);
  else if (modes > 0)
    normal = clamped_modes_of_kind(plan.fixed, assembly, plan.clamp, modes, options.kinds, options.modes);
  ModalBasis basis = joined(plan, Psi_c, normal);
  basis.unknowns = left.count;
  basis.rigid_freedoms = rigid_freedoms(plan.held, assembly.dofs, plan.clamp);
  basis.frame = basis.rigid_freedoms == 0 ? "clamped" : "free";
  if (!options.reference.empty()) {
    const auto at = std::ranges::find(interfaces, options.reference, &InterfaceNode::name);
    basis.interfaces.push_back({at->name, at->components, -1});
    basis.interface_nodes.push_back(at->node);
  }
  return options.orthonormal ? diagonal(basis, plan.held, assembly, plan.clamp, threads) : basis;
}

}  // namespace flexboom
