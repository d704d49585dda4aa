#include "reduction/eigen/verify.hpp"

#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/linear_algebra/dense.hpp"
#include "fem/linear_algebra/inertia.hpp"
#include "fem/linear_algebra/supernodal_solve.hpp"
#include "reduction/eigen/orthogonal_basis.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index probes = 5;  // random vectors that look for modes missed

double hertz(double lambda) { return std::sqrt(std::max(0.0, lambda)) / (2 * std::numbers::pi); }

void sort(EigenPairs& pairs) {
  std::vector<int> order(static_cast<size_t>(pairs.lambda.size()));
  std::iota(order.begin(), order.end(), 0);
  if (std::ranges::is_sorted(pairs.lambda)) return;
  std::ranges::stable_sort(order, {}, [&](int i) { return pairs.lambda(i); });
  pairs.lambda = pairs.lambda(order).eval();
  pairs.Phi = pairs.Phi(Eigen::all, order).eval();
}

double distance_from_identity(const MatrixXd& gram) {
  return (gram - MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff();
}

/// Gram-Schmidt in the M inner product, as a Cholesky factor of Phi^T M Phi. It only polishes: vectors that are far
/// from orthonormal mean that the backend returned one mode twice. Returns M Phi.
MatrixXd orthonormalise(const EigenProblem& p, MatrixXd& Phi) {
  MatrixXd M_Phi = symmetric_product(p.M, Phi);
  const MatrixXd gram = transposed_product(Phi, M_Phi);
  const double error = distance_from_identity(gram);
  if (!(error < 1e-6)) throw NumericalError(fmt::format("modes are not M-orthonormal, error {:.2g}", error));
  const Eigen::LLT<MatrixXd> llt(gram);
  llt.matrixU().solveInPlace<Eigen::OnTheRight>(Phi);
  llt.matrixU().solveInPlace<Eigen::OnTheRight>(M_Phi);
  return M_Phi;
}

/// Looks for modes that are missing, from random vectors outside those found, taken through the inverse twice. Their
/// Rayleigh quotients are never below the lowest eigenvalue that is missing (Courant-Fischer). One below the last mode
/// found proves that a mode was missed; none makes it unlikely.
class Search {
 public:
  Search(const EigenProblem& p, const MatrixXd& Phi, const MatrixXd& M_Phi)
      : p_(p), Phi_(Phi), M_Phi_(M_Phi), load_(symmetric_product(p.M, random_block(p.K.rows(), probes, 424242))) {}

  /// What the inverse is wanted of next; no columns: nothing.
  const MatrixXd& load() const { return load_; }

  /// The inverse times load().
  void take(MatrixXd X) {
    const VectorXd before = X.colwise().norm();
    add_product(X, -1, Transposed::no, Phi_, transposed_product(M_Phi_, X));
    std::vector<Index> outside;  // what is left of the others is round-off
    for (Index i = 0; i < X.cols(); ++i) {
      if (X.col(i).norm() > 1e-12 * before(i)) outside.push_back(i);
    }
    X = X(Eigen::all, outside).eval();
    if (++solves_ == 1) {
      X.colwise().normalize();
      load_ = symmetric_product(p_.M, X);
      exhausted_ = outside.empty();
      return;
    }
    // With A = K - sigma M and Y the inverse times M X: Y^T A Y = Y^T M X, so 1 / (lambda - sigma) are the eigenvalues
    // of Y^T M Y against it; where few freedoms are left, of the part of full rank.
    const MatrixXd energy = X.transpose() * load_(Eigen::all, outside);
    load_.resize(load_.rows(), 0);
    if (outside.empty()) return;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd((energy + energy.transpose()) / 2));
    const VectorXd& w = eigen.eigenvalues();
    const Index rank = (w.array() > 1e-10 * w(w.size() - 1)).count();
    const MatrixXd Y = X * eigen.eigenvectors().rightCols(rank) * w.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
    if (rank > 0)
      lowest_ = 1 / Eigen::SelfAdjointEigenSolver<MatrixXd>(quadratic_form(p_.M, Y), Eigen::EigenvaluesOnly)
                        .eigenvalues()
                        .maxCoeff();
  }

  /// Lowest lambda - sigma seen.
  double lowest() const { return lowest_; }

  /// Whether random vectors have no part outside the modes found: those are all.
  bool exhausted() const { return exhausted_; }

 private:
  const EigenProblem& p_;
  const MatrixXd& Phi_;
  const MatrixXd& M_Phi_;
  MatrixXd load_;
  int solves_ = 0;
  bool exhausted_ = false;
  double lowest_ = std::numeric_limits<double>::infinity();
};

/// Residual of each pair in the shift-inverted problem: |(K - sigma M)^-1 M phi - phi / (lambda - sigma)|_M (lambda -
/// sigma), a bound of the relative error of lambda - sigma. Read from the factor that is in place, together with what a
/// search wants of it, if there is one.
VectorXd residuals(const EigenProblem& p, const SparseFactor& shifted, const EigenPairs& pairs, const MatrixXd& M_Phi,
                   Search* search) {
  VectorXd result(pairs.lambda.size());
  for (Index first = 0; first < result.size() || (search && search->load().cols() > 0);) {
    const Index beside = search ? search->load().cols() : 0;
    const Index width = std::min(columns_at_once() - beside, result.size() - first);
    MatrixXd W(M_Phi.rows(), width + beside);
    W.leftCols(width) = M_Phi.middleCols(first, width);
    if (beside > 0) W.rightCols(beside) = search->load();
    shifted.solve(W, W);
    if (beside > 0) search->take(W.rightCols(beside));
    W.conservativeResize(Eigen::NoChange, width);
    W *= (pairs.lambda.segment(first, width).array() - pairs.summary.sigma).matrix().asDiagonal();
    W -= pairs.Phi.middleCols(first, width);
    const MatrixXd M_W = symmetric_product(p.M, W);
    result.segment(first, width) = W.cwiseProduct(M_W).colwise().sum().transpose().cwiseMax(0).cwiseSqrt();
    first += width;
  }
  return result;
}

/// Whether eigenvalues i and i + 1 are one to the accuracy they are known to. The measure is lambda - sigma, which is
/// what the solver resolves. The bound 1e-7 is some ten times the noise that the assembled K of a slender round bar
/// leaves between its double frequencies. The lowest frequencies lose most digits.
bool same_group(const EigenPairs& pairs, const VectorXd& residual, Index i) {
  const double noise = 10 * std::max(residual(i), residual(i + 1));
  return pairs.lambda(i + 1) - pairs.lambda(i) <= std::max(1e-7, noise) * (pairs.lambda(i + 1) - pairs.summary.sigma);
}

/// Number of modes up to the first gap that holds the wanted ones; 0 when the last group found reaches the end of the
/// set.
int modes_below_gap(const EigenPairs& pairs, const VectorXd& residual, int wanted, bool complete) {
  const auto found = static_cast<int>(pairs.lambda.size());
  for (int i = wanted; i < found; ++i) {
    if (!same_group(pairs, residual, i - 1)) return i;
  }
  return complete ? found : 0;
}

/// Counts the eigenvalues below the shift in the gap above the first `expected` modes (Sylvester's law of inertia).
void sturm_check(const EigenProblem& p, double flops, EigenSummary& s, int expected) {
  const Stopwatch start;
  const Inertia count = inertia(shifted(p.K, s.sturm_shift, p.M), flops);
  s.sturm_checked = true;
  s.sturm_count = count.negative;
  s.sturm_method = count.method;
  s.sturm_seconds = start.seconds();  // with the making of K - s M
  if (s.sturm_count != expected) {
    throw NumericalError(fmt::format("Sturm count: {} eigenvalues below {:.6g}, the solver found {}", s.sturm_count,
                                     s.sturm_shift, expected));
  }
  s.proof = fmt::format("no mode below {:.6g} Hz is missed (Sturm count {} by {})", hertz(s.sturm_shift), s.sturm_count,
                        s.sturm_method);
}

/// Refuses modes above one that the search found.
void judge(const Search& search, EigenSummary& s, double last, Index unknowns) {
  if (search.lowest() < (1 - 1e-6) * (last - s.sigma))
    throw NumericalError(fmt::format("a search from random vectors found a mode below {:.6g} Hz that is missing",
                                     hertz(s.sigma + search.lowest())));
  if (search.exhausted()) {
    s.proof = "no mode is missed: random vectors have no part outside those found";
    return;
  }
  s.proof = fmt::format(
      "completeness not proven: {} unknowns; ask for the Sturm count. A search from {} random vectors found nothing "
      "below {:.6g} Hz",
      unknowns, probes, hertz(last));
}

/// Keeps the first `wanted` modes and lists the groups among them.
void trim(EigenPairs& pairs, const VectorXd& residual, int wanted) {
  for (int first = 0; first < wanted;) {
    int last = first;
    while (last + 1 < wanted && same_group(pairs, residual, last)) ++last;
    if (last > first) {
      std::vector<int>& group = pairs.summary.pairs.emplace_back(static_cast<size_t>(last - first + 1));
      std::iota(group.begin(), group.end(), first);
    }
    first = last + 1;
  }
  pairs.lambda.conservativeResize(wanted);
  pairs.Phi.conservativeResize(Eigen::NoChange, wanted);
}

bool counts(const ShiftedFactor& shifted, SturmPolicy policy) {
  return policy == SturmPolicy::always ||
         (policy == SturmPolicy::when_cheap && inertia_seconds(shifted.flops()) < cheap_inertia_seconds);
}

}  // namespace

bool verify(const EigenProblem& p, ShiftedFactor& shifted, const EigenOptions& options, bool complete,
            EigenPairs& pairs) {
  const Stopwatch start;
  EigenSummary& s = pairs.summary;
  sort(pairs);
  const int wanted = options.num_modes;
  VectorXd residual;
  int expected = 0;
  {
    const MatrixXd M_Phi = orthonormalise(p, pairs.Phi);
    std::optional<Search> search;
    if (!counts(shifted, options.sturm)) search.emplace(p, pairs.Phi, M_Phi);
    residual = residuals(p, shifted.factor(), pairs, M_Phi, search ? &*search : nullptr);
    s.residual_max = residual.head(wanted).maxCoeff();
    if (!(s.residual_max <= std::max(max_residual, 100 * options.tolerance)))
      throw NumericalError(fmt::format("residual {:.2g} of the modes is too large", s.residual_max));
    s.orthogonality_error = distance_from_identity(transposed_product(pairs.Phi, M_Phi));
    expected = modes_below_gap(pairs, residual, wanted, complete);
    if (expected == 0) return false;
    if (search) judge(*search, s, pairs.lambda(expected - 1), p.K.rows());
  }
  const double last = pairs.lambda(expected - 1);
  const bool has_next = expected < pairs.lambda.size();
  s.sturm_shift = has_next ? (last + pairs.lambda(expected)) / 2 : last + 0.1 * (last - s.sigma);
  if (counts(shifted, options.sturm)) {
    if (p.K.rows() > indefinite_unknowns && !options.keep_factor) shifted.release();
    sturm_check(p, shifted.flops(), s, expected);
  }
  trim(pairs, residual, options.whole_groups ? expected : wanted);
  s.verify_seconds = start.seconds();
  return true;
}

}  // namespace flexboom
