#include "fem/linear_algebra/sparse_factor.hpp"

#include "fem/base/blas_threads.hpp"
#include "fem/base/check.hpp"
#include "fem/base/heap.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/linear_algebra/ordering.hpp"
#include "fem/linear_algebra/supernodal_solve.hpp"
#include "fem/linear_algebra/supernode_panels.hpp"

#include <cholmod.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace flexboom {
namespace {

/// P A P^T, lower triangle in columns whose rows are in no order: what CHOLMOD factorises as it is. Left to CHOLMOD,
/// the same takes two passes at each analysis and factorisation.
class PermutedMatrix {
 public:
  PermutedMatrix(const SparseMatrix& A, const std::vector<int>& place, bool with_values)
      : start_(static_cast<size_t>(A.cols()) + 1, 0),
        row_(static_cast<size_t>(A.nonZeros())),
        value_(with_values ? row_.size() : 0) {
    const auto at = [](Eigen::Index i) { return static_cast<size_t>(i); };
    const auto for_each = [&](const auto& visit) {
      for (Eigen::Index j = 0; j < A.cols(); ++j) {
        const int q = place[at(j)];
        for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
          if (it.row() >= j) visit(place[at(it.row())], q, it.value());
        }
      }
    };
    for_each([&](int p, int q, double) { ++start_[at(std::min(p, q)) + 1]; });
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    std::vector<int> next(start_.begin(), start_.end() - 1);
    for_each([&](int p, int q, double value) {
      const auto k = at(next[at(std::min(p, q))]++);
      row_[k] = std::max(p, q);
      if (with_values) value_[k] = value;
    });
  }

  cholmod_sparse view() {
    cholmod_sparse result{};
    result.nrow = result.ncol = start_.size() - 1;
    result.nzmax = row_.size();
    result.p = start_.data();
    result.i = row_.data();
    result.x = value_.empty() ? nullptr : value_.data();
    result.stype = -1;
    result.itype = CHOLMOD_INT;
    result.xtype = value_.empty() ? CHOLMOD_PATTERN : CHOLMOD_REAL;
    result.dtype = CHOLMOD_DOUBLE;
    result.sorted = 0;
    result.packed = 1;
    return result;
  }

 private:
  std::vector<int> start_, row_;
  std::vector<double> value_;
};

constexpr int panel_width = 256;  // as fast as any from 192 on, and less memory than wider ones

cholmod_dense view(Eigen::MatrixXd& B) {
  cholmod_dense result{};
  result.nrow = static_cast<size_t>(B.rows());
  result.ncol = static_cast<size_t>(B.cols());
  result.d = result.nrow;
  result.nzmax = result.nrow * result.ncol;
  result.x = B.data();
  result.xtype = CHOLMOD_REAL;
  result.dtype = CHOLMOD_DOUBLE;
  return result;
}

// Negative status is an error of CHOLMOD, positive a warning about the numbers.
void check_status(const cholmod_common& common, const char* what) {
  if (common.status == CHOLMOD_OK) return;
  const char* reason = common.status == CHOLMOD_OUT_OF_MEMORY ? "out of memory"
                       : common.status == CHOLMOD_TOO_LARGE   ? "the matrix is too large"
                       : common.status == CHOLMOD_NOT_POSDEF
                           ? "a pivot is zero: the matrix is singular; use another shift or clamp"
                           : "CHOLMOD failed";
  throw NumericalError(fmt::format("{}: {} (CHOLMOD status {})", what, reason, common.status));
}

}  // namespace

// `common`, the factor and the blocks kept for solves, freed together.
struct SparseFactor::Impl {
  cholmod_common common{};
  cholmod_factor* L = nullptr;
  FactorKind kind;
  Eigen::Index size = 0;
  Eigen::Index entries = 0;
  std::vector<int> place;  // of each unknown in the factor
  Eigen::MatrixXd permuted,
      work;                 // of a solve: unknowns in the order of the factor, and what CHOLMOD needs beside them
  std::vector<Eight> rows;  // of many columns, likewise
  bool factorised = false;
  FactorSummary summary;

  explicit Impl(FactorKind wanted) : kind(wanted) {
    cholmod_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    const bool definite = kind == FactorKind::definite;
    common.supernodal = definite ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
    common.final_ll = definite;
    // Blocks are merged where that adds fewer zeros than CHOLMOD allows (0.8, 0.1, 0.05): as fast, 2 to 5 % less
    // memory.
    common.zrelax[0] = 0.4;
    common.zrelax[1] = 0.04;
    common.zrelax[2] = 0.02;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_NATURAL;  // what it gets is permuted
    common.postorder = 0;
  }
  ~Impl() {
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // D_jj is the first entry of column j of a simplicial L D L^T.
  double pivot(Eigen::Index j) const { return static_cast<const double*>(L->x)[static_cast<const int*>(L->p)[j]]; }

  int unknown_at(Eigen::Index pivot) const {
    return static_cast<int>(std::ranges::find(place, static_cast<int>(pivot)) - place.begin());
  }

  void check_pivots() {
    if (kind == FactorKind::definite) {
      require_definite();
      // Not every LAPACK stops at a pivot that is not a number; the estimate is 0 then.
      if (!(cholmod_rcond(L, &common) > 0))
        throw NumericalError("sparse factorisation: a pivot is not a finite number");
      return;
    }
    for (Eigen::Index j = 0; j < size; ++j) {
      if (std::isfinite(pivot(j)) && pivot(j) != 0) continue;
      throw SingularMatrix(fmt::format("sparse factorisation: pivot {} of {} is {}", j, size, pivot(j)), unknown_at(j));
    }
  }

  void solve(const Eigen::Ref<const Eigen::MatrixXd>& B, Eigen::Ref<Eigen::MatrixXd> X) {
    if (!L->is_super) return solve_by_cholmod(B, X);
    for (Eigen::Index done = 0; done < B.cols();) {
      const Eigen::Index columns = std::min<Eigen::Index>(columns_at_once(), B.cols() - done);
      const auto b = B.middleCols(done, columns);
      auto x = X.middleCols(done, columns);
      if (columns == 1)
        solve_by_cholmod(b, x);
      else if (columns <= 8)
        solve_by_rows<8>(b, x);
      else if (columns <= 12)
        solve_by_rows<12>(b, x);
      else
        solve_by_rows<16>(b, x);
      done += columns;
    }
  }

  /// Up to `width` columns, filled up with zeros: the time is that of reading L, which CHOLMOD takes for one or two.
  template <int width>
  void solve_by_rows(const Eigen::Ref<const Eigen::MatrixXd>& B, Eigen::Ref<Eigen::MatrixXd> X) {
    rows.resize((static_cast<size_t>(size) * width + 7) / 8);
    auto* const x = reinterpret_cast<double*>(rows.data());
    for (Eigen::Index i = 0; i < size; ++i) {
      double* const row = x + width * static_cast<Eigen::Index>(place[static_cast<size_t>(i)]);
      for (Eigen::Index c = 0; c < B.cols(); ++c) row[c] = B(i, c);
      std::fill(row + B.cols(), row + width, 0.0);
    }
    const auto ints = [](const void* array) { return static_cast<const int*>(array); };
    const Supernodes blocks{static_cast<int>(L->nsuper),     ints(L->super), ints(L->pi), ints(L->px), ints(L->s),
                            static_cast<const double*>(L->x)};
    (width == 8 ? solve_by_rows_of_8 : width == 12 ? solve_by_rows_of_12 : solve_by_rows_of_16)(blocks, x);
    for (Eigen::Index i = 0; i < size; ++i) {
      const double* const row = x + width * static_cast<Eigen::Index>(place[static_cast<size_t>(i)]);
      for (Eigen::Index c = 0; c < B.cols(); ++c) X(i, c) = row[c];
    }
  }

  void solve_by_cholmod(const Eigen::Ref<const Eigen::MatrixXd>& B, Eigen::Ref<Eigen::MatrixXd> X) {
    permuted.resize(B.rows(), B.cols());
    for (Eigen::Index c = 0; c < B.cols(); ++c) {
      for (Eigen::Index i = 0; i < size; ++i) permuted(place[static_cast<size_t>(i)], c) = B(i, c);
    }
    L->is_super ? solve_in_blocks() : solve_by_columns();
    check_status(common, "sparse solve");
    for (Eigen::Index c = 0; c < B.cols(); ++c) {
      for (Eigen::Index i = 0; i < size; ++i) X(i, c) = permuted(place[static_cast<size_t>(i)], c);
    }
  }

  // L L^T, in place.
  void solve_in_blocks() {
    work.resize(permuted.cols(), static_cast<Eigen::Index>(L->maxesize));
    cholmod_dense x = view(permuted), e = view(work);
    cholmod_super_lsolve(L, &x, &e, &common);
    cholmod_super_ltsolve(L, &x, &e, &common);
  }

  void solve_by_columns() {
    cholmod_dense x = view(permuted);
    cholmod_dense* solution = cholmod_solve(CHOLMOD_A, L, &x, &common);
    if (solution == nullptr) return;
    std::copy_n(static_cast<const double*>(solution->x), permuted.size(), permuted.data());
    cholmod_free_dense(&solution, &common);
  }

  void require_definite() const {
    if (static_cast<Eigen::Index>(L->minor) < size)
      throw SingularMatrix(fmt::format("sparse factorisation: not positive definite at pivot {} of {}", L->minor, size),
                           unknown_at(static_cast<Eigen::Index>(L->minor)));
  }
};

SparseFactor::SparseFactor(const SparseMatrix& pattern, FactorKind kind) : impl_(std::make_unique<Impl>(kind)) {
  require(
      pattern.rows() == pattern.cols() && pattern.rows() > 0,
      fmt::format("sparse factorisation: the matrix is {} x {}; it must be square", pattern.rows(), pattern.cols()));
  require(pattern.isCompressed(), "sparse factorisation: the matrix must be compressed");
  const Stopwatch start;
  Ordering order = fill_reducing_ordering(pattern);
  impl_->place.resize(order.permutation.size());
  for (size_t k = 0; k < order.permutation.size(); ++k)
    impl_->place[static_cast<size_t>(order.permutation[k])] = static_cast<int>(k);
  PermutedMatrix permuted(pattern, impl_->place, false);
  cholmod_sparse A = permuted.view();
  impl_->size = pattern.rows();
  impl_->entries = pattern.nonZeros();
  impl_->L = cholmod_analyze(&A, &impl_->common);
  check_status(impl_->common, "sparse analysis");
  if (kind == FactorKind::definite) split_into_panels(*impl_->L, panel_width, impl_->common);
  impl_->summary.ordering = order.name;
  impl_->summary.flops = order.flops;
  impl_->summary.nonzeros = static_cast<long>(order.nonzeros);
  impl_->summary.analyse_seconds = start.seconds();
}

SparseFactor::~SparseFactor() = default;
SparseFactor::SparseFactor(SparseFactor&&) noexcept = default;
SparseFactor& SparseFactor::operator=(SparseFactor&&) noexcept = default;

void SparseFactor::factorise(const SparseMatrix& A) {
  require(A.rows() == impl_->size && A.cols() == impl_->size && A.nonZeros() == impl_->entries && A.isCompressed(),
          "sparse factorisation: the matrix has another pattern than the one analysed");
  impl_->factorised = false;
  const Stopwatch start;
  const WithoutOpenMP alone;
  // It stops all threads for a moment: longer than a small factor takes.
  constexpr long large = 8L << 20;  // [numbers]
  const auto return_memory = [is_large = impl_->summary.nonzeros > large] {
    if (is_large) return_freed_memory();
  };
  {
    PermutedMatrix permuted(A, impl_->place, true);
    cholmod_sparse a = permuted.view();
    return_memory();
    cholmod_factorize(&a, impl_->L, &impl_->common);
  }
  return_memory();
  if (impl_->common.status == CHOLMOD_NOT_POSDEF) impl_->require_definite();
  check_status(impl_->common, "sparse factorisation");
  impl_->check_pivots();
  impl_->factorised = true;
  impl_->summary.factor_seconds = start.seconds();
  const bool blocks = impl_->L->is_super != 0;
  impl_->summary.bytes =
      blocks ? 8.0 * static_cast<double>(impl_->L->xsize) : 12.0 * static_cast<double>(impl_->L->nzmax);
}

void SparseFactor::solve(const Eigen::Ref<const Eigen::MatrixXd>& B, Eigen::Ref<Eigen::MatrixXd> X) const {
  require(impl_->factorised, "sparse solve: nothing is factorised");
  require(B.rows() == impl_->size && X.rows() == impl_->size && B.cols() == X.cols(),
          fmt::format("sparse solve: {} x {} from {} x {}, the matrix has {} rows", X.rows(), X.cols(), B.rows(),
                      B.cols(), impl_->size));
  if (B.cols() == 0) return;
  impl_->solve(B, X);
}

int SparseFactor::negative_pivots() const {
  require(impl_->factorised, "negative pivots: nothing is factorised");
  if (impl_->kind == FactorKind::definite) return 0;
  int count = 0;
  for (Eigen::Index j = 0; j < impl_->size; ++j) count += impl_->pivot(j) < 0;
  return count;
}

std::string SparseFactor::library_release() {
  int version[3] = {};
  cholmod_version(version);
  return fmt::format("{}.{}.{}", version[0], version[1], version[2]);
}

FactorKind SparseFactor::kind() const { return impl_->kind; }

FactorSummary SparseFactor::summary() const { return impl_->summary; }

}  // namespace flexboom
