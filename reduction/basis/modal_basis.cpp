#include "reduction/basis/modal_basis.hpp"

#include "fem/assembly/idle_freedoms.hpp"
#include "fem/base/check.hpp"
#include "reduction/basis/mode_alignment.hpp"
#include "reduction/basis/reduced_matrices.hpp"
#include "reduction/basis/smooth_shapes.hpp"
#include "reduction/eigen/backends.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Renames the modes in the groups: mode i becomes new_index(i), and leaves if that is not in 0 .. count - 1.
template <class NewIndex>
void keep_modes(EigenSummary& summary, int count, const NewIndex& new_index) {
  for (std::vector<int>& group : summary.pairs) {
    for (int& i : group) i = new_index(i);
    std::erase_if(group, [count](int i) { return i < 0 || i >= count; });
  }
  std::erase_if(summary.pairs, [](const std::vector<int>& group) { return group.size() < 2; });
}

/// phi^T A phi of each column.
VectorXd quadratic_forms(const SparseMatrix& A, const MatrixXd& Phi) {
  return Phi.cwiseProduct(symmetric_product(A, Phi)).colwise().sum();
}

/// What the modes of a mesh need of its assembly beside the eigenproblem.
struct ModalModel {
  ModalModel(const Mesh& m, const Assembly& assembly, const Clamp& clamp)
      : mesh(m),
        dofs(assembly.dofs),
        convention(m, assembly, clamp),
        weights(assembly.M.diagonal()),
        springs(assembly.K.diagonal()) {}

  const Mesh& mesh;
  const DofMap& dofs;
  ModeConvention convention;
  VectorXd weights;  // diagonal of M
  VectorXd springs;  // diagonal of K
};

/// Of the strain energies of shapes, what the round-off of K may be: that of what their displacements would store if
/// every freedom were alone. It knows neither the size nor the slenderness of the body.
VectorXd energy_round_off(const ModalModel& model, const MatrixXd& Phi) {
  return std::numeric_limits<double>::epsilon() / 2 * (Phi.cwiseAbs2().transpose() * model.springs);
}

/// How many shapes at the front store no strain energy: far less than the round-off of K. That of an elastic shape may
/// be less than round-off too, where an element is very short.
int strainless(const VectorXd& strain, const VectorXd& round_off) {
  constexpr double far = 1e-3;
  int count = 0;
  while (count < strain.size() && strain(count) <= far * round_off(count)) ++count;
  return count;
}

/// What the round-off of K changes of the frequencies of `basis`, relative. K and M: over the unknowns; `solved`: the
/// eigenvalues of the solver. Round-off is seen in phi^T K phi, less the strain energy, and in what the solver found.
/// It mixes mode k with j by sqrt(n_j n_k) / (lambda_k - lambda_j), where n is that of an eigenvalue, and the quotient
/// of strain energies changes by the square of that times the gap.
VectorXd frequency_round_off(const ModalModel& model, const SparseMatrix& K, const SparseMatrix& M,
                             const std::vector<int>& unknowns, const ModalBasis& basis, const VectorXd& solved) {
  constexpr double lucky = 3;  // times smaller than the round-off may be, seen in two energies by accident
  // A dense factor adds as many products as there are unknowns, and their round-off, which the energies do not show.
  const double sums = basis.summary.backend == "dense" ? std::sqrt(static_cast<double>(K.rows())) : 1;
  const MatrixXd Phi = basis.Phi(unknowns, Eigen::all);
  const VectorXd strain = basis.omega.cwiseAbs2().cwiseProduct(quadratic_forms(M, Phi)) / 2;
  const VectorXd by_K = quadratic_forms(K, Phi) / 2, may_be = sums / lucky * energy_round_off(model, basis.Phi);
  const VectorXd lambda = basis.omega.cwiseAbs2();
  const auto noise = [&](Index k) {
    const double seen = std::max(std::abs(by_K(k) - strain(k)), may_be(k)) / strain(k) * lambda(k);
    return std::max(seen, std::abs(solved(k) - lambda(k)));
  };
  VectorXd r = VectorXd::Zero(strain.size());
  for (Index k = basis.rigid_freedoms; k < r.size(); ++k) {
    double change = noise(k) * noise(k) / lambda(k);  // by all modes that are much higher
    for (Index j = basis.rigid_freedoms; j < r.size(); ++j) {
      const double gap = std::abs(lambda(k) - lambda(j));
      if (gap > 0) change += std::min(noise(k) * noise(j) / gap, gap);
    }
    r(k) = change / lambda(k);
  }
  // The solver tells modes in ascending order. A shape that stores more than a later one has parts of much higher
  // modes.
  double least = std::numeric_limits<double>::infinity();
  for (Index k = r.size() - 1; k >= basis.rigid_freedoms; --k) {
    least = std::min(least, lambda(k));
    r(k) = std::max(r(k), lambda(k) / least - 1);
  }
  return r;
}

/// The first `wanted` modes over all freedoms of the mesh, aligned, of the right sign and size. Rigid motions, if any,
/// come first: `rigid` of the whole body, and those that its parts have beside. `masses_of`: phi^T M phi of each
/// column.
template <class Masses>
ModalBasis finished(const ModalModel& model, MatrixXd Phi, const Masses& masses_of, const EigenSummary& summary,
                    int wanted, int rigid, int threads) {
  model.convention.align(Phi, summary.pairs);
  ModalBasis basis;
  basis.Phi = Phi.leftCols(wanted);
  basis.summary = summary;
  basis.mass = model.convention.mass();
  // Rayleigh quotients summed over element strains: phi^T K phi of a stiff, slender body cancels to noise in its last
  // digits.
  const VectorXd strain = strain_energies(model.mesh, model.dofs, basis.Phi, threads);
  basis.omega = (2 * strain).cwiseQuotient(masses_of(basis.Phi)).cwiseMax(0).cwiseSqrt();
  basis.rigid_freedoms = std::max(rigid, strainless(strain, energy_round_off(model, basis.Phi)));
  basis.frame = basis.rigid_freedoms == 0 ? "clamped" : "free";
  basis.kind = mode_kinds(model.mesh, model.dofs, model.weights, basis.Phi);
  std::fill_n(basis.kind.begin(), std::min(basis.rigid_freedoms, wanted), ModeKind::rigid);
  model.convention.scale(basis.Phi, basis.kind);
  keep_modes(basis.summary, wanted, [](int i) { return i; });
  basis.coordinates = mode_table(basis);
  return basis;
}

/// The node set that is clamped is an interface.
void set_clamped_interface(ModalBasis& basis, const Mesh& mesh, const Clamp& clamp) {
  const auto sorted = [](std::vector<int> nodes) {
    std::ranges::sort(nodes);
    return nodes;
  };
  for (const auto& [name, nodes] : mesh.node_sets) {
    if (nodes.empty() || sorted(nodes) != sorted(clamp.nodes)) continue;
    basis.interfaces = {{.name = name}};
    basis.interface_nodes = {nodes.size() == 1 ? nodes.front() : -1};
    return;
  }
}

/// The eigenproblem of a mesh whose constraints are eliminated.
struct Reduced {
  explicit Reduced(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp)
      : unknowns(flexboom::unknowns(mesh, assembly.dofs, clamp)),
        K(unknowns.reduced(assembly.K)),
        M(unknowns.reduced(assembly.M)) {
    const auto idle = ((K.diagonal().array() == 0) && (M.diagonal().array() == 0)).eval();
    for (Index i = 0; i < idle.size(); ++i) {
      if (!idle(i)) continue;
      const int dof = unknowns.free_dofs()[static_cast<size_t>(i)];
      throw InputError("modes: " + freedom_name(mesh, assembly.dofs, dof) +
                       " has neither stiffness nor mass; hold it, or join it to the body");
    }
  }

  Unknowns unknowns;
  SparseMatrix K, M;
};

/// Adds the groups that the solver could not see. The assembled K of a slender body leaves more noise between double
/// frequencies than the strain energies of their modes do. `Phi`: M-orthonormal, over all freedoms.
EigenSummary with_equal_energies(const ModalModel& model, const MatrixXd& Phi, const VectorXd& lambda,
                                 EigenSummary summary, int threads) {
  constexpr double near = 1e-3, equal = 1e-8;                       // of omega^2
  std::vector<char> joined(static_cast<size_t>(lambda.size()), 0);  // with the one before
  for (const std::vector<int>& group : summary.pairs)
    for (size_t i = 1; i < group.size(); ++i) joined[static_cast<size_t>(group[i])] = 1;
  for (int i = 1; i < lambda.size(); ++i) {
    if (joined[static_cast<size_t>(i)] || lambda(i) - lambda(i - 1) > near * lambda(i)) continue;
    const VectorXd energy = strain_energies(model.mesh, model.dofs, Phi.middleCols(i - 1, 2), threads);
    joined[static_cast<size_t>(i)] = std::abs(energy(1) - energy(0)) <= equal * energy(1);
  }
  summary.pairs.clear();
  for (int i = 1; i < lambda.size(); ++i) {
    if (!joined[static_cast<size_t>(i)]) continue;
    if (!joined[static_cast<size_t>(i) - 1]) summary.pairs.push_back({i - 1});
    summary.pairs.back().push_back(i);
  }
  return summary;
}

ModalBasis modes_of(const ModalModel& model, const Clamp& clamp, const Reduced& reduced, const EigenOptions& options,
                    int threads) {
  const int rigid = rigid_freedoms(model.mesh, model.dofs, clamp);
  const int count = reduced.unknowns.count;
  EigenOptions whole = options;  // half a pair cannot be aligned, so its other half is solved for as well
  whole.whole_groups = true;
  const MatrixXd start = smooth_shapes(model.mesh, model.dofs)(reduced.unknowns.free_dofs(), Eigen::all);
  const EigenProblem problem{reduced.K, reduced.M, rigid > 0, start};
  if (options.num_modes < finite_eigenvalues(problem)) ++whole.num_modes;
  const EigenPairs pairs = solve_modes(problem, whole);
  const auto masses_of = [&](const MatrixXd& Phi) {
    return quadratic_forms(reduced.M, Phi(reduced.unknowns.free_dofs(), Eigen::all));
  };
  MatrixXd Phi = reduced.unknowns.expanded(pairs.Phi);
  const EigenSummary summary = with_equal_energies(model, Phi, pairs.lambda, pairs.summary, threads);
  ModalBasis basis = finished(model, std::move(Phi), masses_of, summary, options.num_modes, rigid, threads);
  basis.round_off = frequency_round_off(model, reduced.K, reduced.M, reduced.unknowns.free_dofs(), basis, pairs.lambda);
  basis.unknowns = count;
  basis.factor = pairs.factor;
  set_clamped_interface(basis, model.mesh, clamp);
  return basis;
}

}  // namespace

std::vector<Coordinate> mode_table(const ModalBasis& basis) {
  std::vector<Coordinate> table;
  for (size_t i = 0; i < basis.kind.size(); ++i)
    table.push_back({std::string(name_of(basis.kind[i])), basis.omega(static_cast<Index>(i)) / (2 * std::numbers::pi)});
  return table;
}

void renumber(Interface& interface, const std::vector<int>& modes) {
  if (interface.first_coordinate < 0) return;
  const auto count = std::ranges::count(interface.components, true);
  const auto place = std::ranges::find(modes, interface.first_coordinate);
  interface.first_coordinate = modes.end() - place < count ? -1 : static_cast<int>(place - modes.begin());
  for (int k = 1; k < count && interface.first_coordinate >= 0; ++k) {
    if (place[k] != *place + k) interface.first_coordinate = -1;
  }
}

ModalBasis selected(const ModalBasis& basis, const std::vector<int>& modes) {
  for (const int i : modes)
    require(i >= 0 && i < basis.Phi.cols(),
            "modes: mode " + std::to_string(i) + " chosen of a basis of " + std::to_string(basis.Phi.cols()));
  const std::vector<Coordinate> table = basis.coordinates.empty() ? mode_table(basis) : basis.coordinates;
  ModalBasis result = basis;
  result.Phi = basis.Phi(Eigen::all, modes);
  result.omega = basis.omega(modes);
  if (basis.round_off.size() > 0) result.round_off = basis.round_off(modes);
  result.kind.clear();
  result.coordinates.clear();
  for (const int i : modes) {
    result.kind.push_back(basis.kind[static_cast<size_t>(i)]);
    result.coordinates.push_back(table[static_cast<size_t>(i)]);
  }
  for (Interface& interface : result.interfaces) renumber(interface, modes);
  keep_modes(result.summary, static_cast<int>(modes.size()), [&modes](int i) {
    const auto place = std::ranges::find(modes, i);
    return place == modes.end() ? -1 : static_cast<int>(place - modes.begin());
  });
  return result;
}

ModalBasis ritz_modes(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, const MatrixXd& shapes, int rigid,
                      int threads) {
  const VectorXd size = shapes.cwiseProduct(symmetric_product(assembly.M, shapes)).colwise().sum().cwiseSqrt();
  const MatrixXd X = shapes * size.cwiseInverse().asDiagonal();
  const MatrixXd Me = quadratic_form(assembly.M, X);
  const MatrixXd Ke = reduced_stiffness(mesh, assembly.dofs, X, threads);
  // Me v = mu (Ke + shift Me) v: the low frequencies are the largest mu and keep their digits beside stiff shapes.
  const double shift = rigid > 0 ? 1e-6 * Ke.trace() / static_cast<double>(Ke.rows()) : 0;
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(Me, Ke + shift * Me);
  if (solver.info() != Eigen::Success || !(solver.eigenvalues()(0) > 0))
    throw NumericalError("basis: its shapes depend on each other, or a shape stores no energy; leave shapes out");
  const VectorXd mu = solver.eigenvalues().reverse();
  const MatrixXd V = solver.eigenvectors().rowwise().reverse() * mu.cwiseSqrt().cwiseInverse().asDiagonal();
  EigenSummary summary;
  summary.backend = "dense";
  summary.rigid_modes = rigid;
  summary.pairs = equal_groups((mu.cwiseInverse().array() - shift).cwiseMax(0).sqrt());
  std::erase_if(summary.pairs, [rigid](const auto& group) { return group.front() < rigid; });
  const auto masses_of = [&](const MatrixXd& Phi) { return quadratic_forms(assembly.M, Phi); };
  ModalBasis basis = finished(ModalModel(mesh, assembly, clamp), X * V, masses_of, summary, static_cast<int>(X.cols()),
                              rigid, threads);
  set_clamped_interface(basis, mesh, clamp);
  return basis;
}

ModalBasis clamped_modes(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, const EigenOptions& options,
                         int threads) {
  Reduced reduced(mesh, assembly, clamp);
  ModalBasis basis = modes_of(ModalModel(mesh, assembly, clamp), clamp, reduced, options, threads);
  if (basis.factor) {
    const auto K = std::make_shared<SparseMatrix>();
    K->swap(reduced.K);
    basis.K = K;
  }
  return basis;
}

ModalBasis clamped_modes_releasing(const Mesh& mesh, Assembly& assembly, const Clamp& clamp,
                                   const EigenOptions& options, int threads) {
  const ModalModel model(mesh, assembly, clamp);
  const Reduced reduced(mesh, assembly, clamp);
  SparseMatrix().swap(assembly.K);  // an assigned empty matrix would keep the memory
  SparseMatrix().swap(assembly.M);
  return modes_of(model, clamp, reduced, options, threads);
}

ModalBasis modes_of_kind(const std::function<ModalBasis(const EigenOptions&)>& solve, int all, int count,
                         const std::vector<ModeKind>& kinds, EigenOptions options) {
  require(count >= 1 && count <= all,
          "modes: " + std::to_string(count) + " asked of a body with " + std::to_string(all) + " unknowns");
  // A first guess of how many modes hold enough of one kind: bending comes in two planes, other kinds are rare among
  // the low modes.
  options.num_modes = kinds.size() == 1 ? 2 * count + 2 : count + count / 4 + 2;
  for (;; options.num_modes *= 2) {
    options.num_modes = std::min(options.num_modes, all);
    ModalBasis basis;
    try {
      basis = solve(options);
    } catch (const NumericalError&) {
      if (options.num_modes < all) throw;
      throw InputError(
          fmt::format("modes: {} of the kinds asked for are too many for the {} unknowns of the mesh; refine "
                      "the mesh or ask for fewer",
                      count, all));
    }
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

ModalBasis clamped_modes_of_kind(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, int count,
                                 const std::vector<ModeKind>& kinds, EigenOptions options) {
  return modes_of_kind([&](const EigenOptions& o) { return clamped_modes(mesh, assembly, clamp, o); },
                       unknowns(mesh, assembly.dofs, clamp).count, count, kinds, std::move(options));
}

}  // namespace flexboom
