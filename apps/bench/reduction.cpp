#include "apps/bench/reduction.hpp"

#include "apps/bench/boom4.hpp"
#include "fem/base/blas_threads.hpp"
#include "fem/base/stopwatch.hpp"
#include "reduction/basis/mode_selection.hpp"
#include "reduction/body/geometric_stiffness_loads.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "reduction/invariants/lumped_invariants.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::array<int, 5> mode_counts = {2, 5, 10, 20, 50};
constexpr int compared_modes = 10;

Mesh graded_mesh(double accuracy) {
  SolidOptions options;
  options.accuracy = accuracy;
  return make_solid_mesh(boom4(), options);
}

/// Largest resident memory since the last call of `forget_peak`, or of the whole process where that is not possible.
double peak_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (double kb = 0; word == "VmHWM:" && status >> kb) return kb / 1024;
  }
  return 0;
}
void forget_peak() { std::ofstream("/proc/self/clear_refs") << 5; }

/// Wall time of the fastest of up to five runs, as many as half a second allows: the others met a busy machine.
template <class Run>
double fastest(const Run& run) {
  double least = std::numeric_limits<double>::infinity(), all = 0;
  for (int i = 0; i < 5 && all < 0.5; ++i) {
    const Stopwatch watch;
    run();
    least = std::min(least, watch.seconds());
    all += watch.seconds();
  }
  return least;
}

ModalBasis modes_of(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, int count, int threads) {
  EigenOptions options;
  options.num_modes = count;
  options.backend = "auto";
  return clamped_modes(mesh, assembly, clamp, options, threads);
}

// ---- what the modes left out would have added ----

/// First bending frequency in the plane xy of the full model on a hinge about z, its root rigid [Hz].
double hinged_hz(Mesh mesh) {
  const std::vector<int> root = node_set(mesh, "root");
  int hinge = root.front();
  if (type_of(mesh.elements.front()).shape != Shape::line) {
    hinge = static_cast<int>(mesh.nodes.cols());
    mesh.nodes.conservativeResize(3, hinge + 1);
    mesh.nodes.col(hinge).setZero();
    mesh.rigid_connections.push_back({hinge, root, all_components});
  }
  mesh.supports = {{hinge, {true, true, true, true, true, false}}};
  const ModalBasis basis = modes_of(mesh, assemble(mesh), {}, 4, 1);
  for (size_t k = 0; k < basis.kind.size(); ++k) {
    if (basis.kind[k] == ModeKind::bending_y) return basis.omega(static_cast<Index>(k)) / (2 * std::numbers::pi);
  }
  return std::nan("");
}

/// The same of a body: rigid rotation about z and its clamped modes that bend there.
double hinged_hz(const ReducedBody& body) {
  std::vector<Index> bending;
  for (size_t k = 0; k < body.coordinates.size(); ++k) {
    if (body.coordinates[k].kind == "bending_y") bending.push_back(static_cast<Index>(k));
  }
  const Index n = std::ssize(bending);
  MatrixXd M(n + 1, n + 1), K = MatrixXd::Zero(n + 1, n + 1);
  M(0, 0) = body.J0(2, 2);
  M.block(0, 1, 1, n) = body.Cr0(2, bending);
  M.block(1, 0, n, 1) = body.Cr0(2, bending).transpose();
  M.block(1, 1, n, n) = body.Me(bending, bending);
  K.block(1, 1, n, n) = body.Ke(bending, bending);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(K, M);
  return std::sqrt(solver.eigenvalues()(1)) / (2 * std::numbers::pi);
}

/// Tip deflection along y under a unit force there [m/N]; of the full model.
double tip_compliance(const Mesh& mesh, const Assembly& assembly, const Unknowns& left, const StaticSolver& statics) {
  const MatrixXd f = left.reduced_loads(marker_forces(mesh, assembly.dofs, "tip").col(1));
  return f.col(0).dot(statics.loaded(f).col(0));
}
double tip_compliance(const ReducedBody& body) {
  const VectorXd s = marker(body, "tip").S.row(1);
  return s.dot(body.Ke.ldlt().solve(s));
}

// ---- invariants against a reference ----

/// Ranks of the coordinates: both planes of bending are one kind, the second of each is rank 1.
std::map<std::pair<std::string, int>, std::vector<Index>> ranked(const ReducedBody& body) {
  std::map<std::string, int> seen;
  std::map<std::pair<std::string, int>, std::vector<Index>> ranks;
  for (size_t k = 0; k < body.coordinates.size(); ++k) {
    const std::string& kind = body.coordinates[k].kind;
    const bool lateral = kind == "bending_y" || kind == "bending_z";
    ranks[{lateral ? "bending" : kind, seen[kind]++}].push_back(static_cast<Index>(k));
  }
  return ranks;
}

/// Ct over sqrt(m) and Cr0 over sqrt(tr J0): what modes share that are the same.
MatrixXd coupling(const ReducedBody& body) {
  MatrixXd L(6, body.n());
  L << body.Ct / std::sqrt(body.m), body.Cr0 / std::sqrt(body.J0.trace());
  return L;
}

/// Coordinates q = X p in which Me = I.
MatrixXd unit_mass(const ReducedBody& body) { return body.Me.diagonal().cwiseSqrt().cwiseInverse().asDiagonal(); }

/// The body in coordinates q = X p (gram and Me only).
ReducedBody changed(const ReducedBody& body, const MatrixXd& X) {
  MatrixXd T = MatrixXd::Zero(4 + 3 * X.rows(), 4 + 3 * X.cols());
  T.topLeftCorner<4, 4>().setIdentity();
  for (Index k = 0; k < X.rows(); ++k) {
    for (Index l = 0; l < X.cols(); ++l) T.block<3, 3>(4 + 3 * k, 4 + 3 * l).diagonal().setConstant(X(k, l));
  }
  ReducedBody result = blank_body(body.name, static_cast<int>(X.cols()));
  result.coordinates = body.coordinates;
  set_invariants(result, T.transpose() * body.gram * T);
  return result;
}

/// Coordinates of `body` that are those of `reference` (of unit modal mass) but for the mesh. Each group of modes is
/// turned as near to its counterpart as it can be. There are none where the groups differ.
std::optional<MatrixXd> matching(const ReducedBody& body, const ReducedBody& reference) {
  const MatrixXd scaled = unit_mass(body);
  const MatrixXd L = coupling(changed(body, scaled)), L_reference = coupling(reference);
  const auto groups = ranked(body);
  MatrixXd Q = MatrixXd::Zero(body.n(), reference.n());
  for (const auto& [rank, of_reference] : ranked(reference)) {
    const auto found = groups.find(rank);
    if (found == groups.end() || found->second.size() != of_reference.size()) return std::nullopt;
    const MatrixXd product = L(Eigen::all, found->second).transpose() * L_reference(Eigen::all, of_reference);
    const Eigen::JacobiSVD<MatrixXd> svd(product, Eigen::ComputeThinU | Eigen::ComputeThinV);
    Q(found->second, of_reference) = svd.matrixU() * svd.matrixV().transpose();  // orthogonal Procrustes
  }
  return scaled * Q;
}

template <class Matrices>
double family_error(const Matrices& A, const Matrices& B) {
  double difference = 0, largest = 0;
  for (size_t k = 0; k < B.size(); ++k) {
    if constexpr (requires { A[k].cwiseAbs(); }) {
      difference = std::max(difference, (A[k] - B[k]).cwiseAbs().maxCoeff());
      largest = std::max(largest, B[k].cwiseAbs().maxCoeff());
    } else {
      for (size_t l = 0; l < B[k].size(); ++l) {
        difference = std::max(difference, (A[k][l] - B[k][l]).cwiseAbs().maxCoeff());
        largest = std::max(largest, B[k][l].cwiseAbs().maxCoeff());
      }
    }
  }
  return difference / largest;
}

double matrix_error(const MatrixXd& A, const MatrixXd& B) {
  return (A - B).cwiseAbs().maxCoeff() / B.cwiseAbs().maxCoeff();
}

InvariantErrors errors_of(const ReducedBody& a, const ReducedBody& b) {
  return {std::abs(a.m / b.m - 1),    matrix_error(a.mc0, b.mc0), matrix_error(a.J0, b.J0), matrix_error(a.Ct, b.Ct),
          matrix_error(a.Cr0, b.Cr0), family_error(a.Cr1, b.Cr1), family_error(a.J1, b.J1), family_error(a.J2, b.J2)};
}

/// The body of a mesh that others are compared with, in unit modal mass.
ReducedBody reference_of(const Mesh& mesh, int threads) {
  const Assembly assembly = assemble(mesh, threads);
  const ModalBasis basis = modes_of(mesh, assembly, node_set(mesh, "root"), compared_modes, threads);
  const ReducedBody body = reduce(mesh, assembly, basis, "reference", threads);
  return changed(body, unit_mass(body));
}

// ---- the ladders ----

class ReductionLadder {
 public:
  ReductionLadder(double longest, int threads, const std::function<void(const ReductionBench&)>& seen)
      : longest_(longest), threads_(threads), seen_(seen) {}

  void solids() {
    const ReducedBody reference = reference_of(graded_mesh(1e-6), threads_);
    start_ladder();
    for (const double accuracy : {1e-3, 1e-4, 1e-5}) {
      if (!add("hex", fmt::format("accuracy 1e{:.0f}", std::log10(accuracy)), graded_mesh(accuracy), reference)) break;
    }
    start_ladder();
    for (const Rung& rung : hex20_rungs) {
      const std::string name = fmt::format("{} x {} x {}", rung.sectors, rung.rings, rung.along);
      if (!add("hex20", name, uniform_mesh("hex20", rung), reference)) break;
    }
  }

  void beams() {
    const ReducedBody reference = reference_of(make_mesh(boom4(16, 10)), 1);
    for (const auto& [order, ladder] : {std::pair{3, std::array{8, 32, 128}}, {8, {2, 4, 8}}}) {
      start_ladder();
      for (const int elements : ladder) {
        const std::string name = fmt::format("{} elements", elements);
        if (!add(fmt::format("beam p{}", order), name, make_mesh(boom4(elements, order)), reference)) break;
      }
    }
  }

  ReductionBenches take() { return std::move(result_); }

 private:
  /// A mesh with all that its rows share.
  struct Model {
    const Mesh& mesh;
    const Assembly& assembly;
    Clamp clamp;
    const StaticSolver& statics;
    double compliance;  // of the full model [m/N]
    double hinged_hz;
  };

  void start_ladder() { last_seconds_ = last_unknowns_ = 0; }

  /// Whether a model of that size is too much, by the longest row of the last and its size.
  bool too_long(int unknowns) const {
    return last_unknowns_ > 0 && last_seconds_ * std::pow(unknowns / last_unknowns_, 1.5) > longest_;
  }

  /// False when the ladder ends here.
  bool add(const std::string& family, const std::string& name, const Mesh& mesh, const ReducedBody& reference) {
    const Clamp clamp(node_set(mesh, "root"));
    const Assembly assembly = assemble(mesh, threads_);
    const Unknowns left = unknowns(mesh, assembly.dofs, clamp);
    if (too_long(left.count)) return false;
    const StaticSolver statics(left.reduced(assembly.K), {});
    const Model model{mesh, assembly, clamp, statics, tip_compliance(mesh, assembly, left, statics), hinged_hz(mesh)};
    last_seconds_ = 0;
    last_unknowns_ = left.count;
    const ReductionBench blank{.family = family, .model = name, .unknowns = left.count};
    for (const int modes : mode_counts) {
      if (modes >= left.count) break;
      add_rows(blank, model, modes, reference);
    }
    return last_seconds_ <= longest_;
  }

  void add_rows(ReductionBench row, const Model& model, int modes, const ReducedBody& reference) {
    row.modes = modes;
    row.threads = 1;
    measure(row, model, &reference);
    if (threads_ == 1) return;
    row.threads = threads_;
    measure(row, model, nullptr);
  }

  void measure(ReductionBench row, const Model& model, const ReducedBody* reference) {
    set_blas_threads(row.threads);
    forget_peak();
    ModalBasis basis;
    ReducedBody body;
    row.modes_seconds =
        fastest([&] { basis = modes_of(model.mesh, model.assembly, model.clamp, row.modes, row.threads); });
    row.reduce_seconds = fastest([&] { body = reduce(model.mesh, model.assembly, basis, "boom 4", row.threads); });
    const GeometricOptions loads{.markers = {"tip"}, .threads = row.threads, .statics = &model.statics, .Ke = &body.Ke};
    row.stiffening_seconds =
        fastest([&] { geometric_stiffness(model.mesh, model.assembly, model.clamp, basis.Phi, loads); });
    row.memory_mb = peak_mb();
    row.compliance_error = std::abs(tip_compliance(body) / model.compliance - 1);
    row.mass_missing = std::abs(1 - effective_masses(body).row(1).sum() / body.m);
    row.hinge_error = std::abs(hinged_hz(body) / model.hinged_hz - 1);
    last_seconds_ = std::max(last_seconds_, row.modes_seconds + row.reduce_seconds + row.stiffening_seconds);
    result_.rows.push_back(row);
    seen_(row);
    if (reference != nullptr && row.modes == compared_modes) compare(row, model, basis, body, *reference);
  }

  void compare(const ReductionBench& row, const Model& model, const ModalBasis& basis, const ReducedBody& body,
               const ReducedBody& reference) {
    InvariantsBench errors{row.family, row.model, row.unknowns, {}, {}};
    errors.consistent.fill(std::numeric_limits<double>::quiet_NaN());
    errors.lumped = errors.consistent;
    if (const std::optional<MatrixXd> X = matching(body, reference)) {
      errors.consistent = errors_of(changed(body, *X), reference);
      errors.lumped = errors_of(changed(lumped_invariants(model.mesh, model.assembly, basis.Phi), *X), reference);
    }
    result_.invariants.push_back(errors);
  }

  double longest_;
  int threads_;
  const std::function<void(const ReductionBench&)>& seen_;
  double last_seconds_ = 0;  // of the longest row of the last model
  double last_unknowns_ = 0;
  ReductionBenches result_;
};

}  // namespace

ReductionBenches bench_reduction(double longest, int threads, const std::function<void(const ReductionBench&)>& seen) {
  ReductionLadder bench(longest, threads, seen);
  bench.beams();
  bench.solids();
  set_blas_threads(threads);
  return bench.take();
}

}  // namespace flexboom
