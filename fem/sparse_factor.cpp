#include "fem/sparse_factor.hpp"

#include "fem/blas_threads.hpp"
#include "fem/check.hpp"
#include "fem/ordering.hpp"

#include <cholmod.h>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

namespace flexboom {
namespace {

// A view of an Eigen matrix as CHOLMOD reads it: symmetric, lower triangle. CHOLMOD does not write through it.
cholmod_sparse view(const SparseMatrix& A) {
  cholmod_sparse result{};
  result.nrow = static_cast<size_t>(A.rows());
  result.ncol = static_cast<size_t>(A.cols());
  result.nzmax = static_cast<size_t>(A.nonZeros());
  result.p = const_cast<int*>(A.outerIndexPtr());
  result.i = const_cast<int*>(A.innerIndexPtr());
  result.x = const_cast<double*>(A.valuePtr());
  result.stype = -1;
  result.itype = CHOLMOD_INT;
  result.xtype = CHOLMOD_REAL;
  result.dtype = CHOLMOD_DOUBLE;
  result.sorted = 1;
  result.packed = 1;
  return result;
}

cholmod_dense view(const Eigen::Ref<const Eigen::MatrixXd>& B) {
  cholmod_dense result{};
  result.nrow = static_cast<size_t>(B.rows());
  result.ncol = static_cast<size_t>(B.cols());
  result.d = static_cast<size_t>(B.outerStride());
  result.nzmax = result.d * result.ncol;
  result.x = const_cast<double*>(B.data());
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

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

// `common`, the factor and the blocks kept for solves, freed together.
struct SparseFactor::Impl {
  cholmod_common common{};
  cholmod_factor* L = nullptr;
  cholmod_dense* Y = nullptr;
  cholmod_dense* E = nullptr;
  FactorKind kind;
  Eigen::Index size = 0;
  Eigen::Index entries = 0;
  bool factorised = false;
  FactorSummary summary;

  explicit Impl(FactorKind wanted) : kind(wanted) {
    cholmod_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    const bool definite = kind == FactorKind::definite;
    common.supernodal = definite ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
    common.final_ll = definite;
    // Columns are merged to wider blocks than CHOLMOD's 4, 16, 48: the orders of slender bodies make narrow ones. A
    // quarter of the time at 35 000 unknowns, for a tenth more memory.
    common.nrelax[0] = 16;
    common.nrelax[1] = 64;
    common.nrelax[2] = 200;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;
    common.postorder = 1;
  }
  ~Impl() {
    cholmod_free_dense(&E, &common);
    cholmod_free_dense(&Y, &common);
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // D_jj is the first entry of column j of a simplicial L D L^T.
  double pivot(Eigen::Index j) const { return static_cast<const double*>(L->x)[static_cast<const int*>(L->p)[j]]; }

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
      throw NumericalError(fmt::format("sparse factorisation: pivot {} of {} is {}", j, size, pivot(j)));
    }
  }

  // CHOLMOD fills a result block that is large enough in place: B is read into its work block before X is written.
  void solve(const Eigen::Ref<const Eigen::MatrixXd>& B, double* result) {
    cholmod_dense rhs = view(B), x = rhs;
    x.d = rhs.nrow;
    x.nzmax = rhs.nrow * rhs.ncol;
    x.x = result;
    cholmod_dense* X = &x;
    const int solved = cholmod_solve2(CHOLMOD_A, L, &rhs, nullptr, &X, nullptr, &Y, &E, &common);
    check_status(common, "sparse solve");
    if (!solved || X != &x || x.x != result) throw NumericalError("sparse solve: CHOLMOD did not fill the result");
  }

  void require_definite() const {
    if (static_cast<Eigen::Index>(L->minor) < size)
      throw NumericalError(
          fmt::format("sparse factorisation: not positive definite at pivot {} of {}", L->minor, size));
  }
};

SparseFactor::SparseFactor(const SparseMatrix& pattern, FactorKind kind) : impl_(std::make_unique<Impl>(kind)) {
  require(
      pattern.rows() == pattern.cols() && pattern.rows() > 0,
      fmt::format("sparse factorisation: the matrix is {} x {}; it must be square", pattern.rows(), pattern.cols()));
  require(pattern.isCompressed(), "sparse factorisation: the matrix must be compressed");
  const auto start = std::chrono::steady_clock::now();
  Ordering order = fill_reducing_ordering(pattern);
  cholmod_sparse A = view(pattern);
  impl_->size = pattern.rows();
  impl_->entries = pattern.nonZeros();
  impl_->L = cholmod_analyze_p(&A, order.permutation.data(), nullptr, 0, &impl_->common);
  check_status(impl_->common, "sparse analysis");
  impl_->summary.ordering = order.name;
  impl_->summary.flops = order.flops;
  impl_->summary.nonzeros = static_cast<long>(order.nonzeros);
  impl_->summary.analyse_seconds = seconds_since(start);
}

SparseFactor::~SparseFactor() = default;
SparseFactor::SparseFactor(SparseFactor&&) noexcept = default;
SparseFactor& SparseFactor::operator=(SparseFactor&&) noexcept = default;

void SparseFactor::factorise(const SparseMatrix& A) {
  require(A.rows() == impl_->size && A.cols() == impl_->size && A.nonZeros() == impl_->entries && A.isCompressed(),
          "sparse factorisation: the matrix has another pattern than the one analysed");
  impl_->factorised = false;
  const auto start = std::chrono::steady_clock::now();
  const WithoutOpenMP alone;
  cholmod_sparse a = view(A);
  cholmod_factorize(&a, impl_->L, &impl_->common);
  if (impl_->common.status == CHOLMOD_NOT_POSDEF && impl_->kind == FactorKind::definite) impl_->require_definite();
  check_status(impl_->common, "sparse factorisation");
  impl_->check_pivots();
  impl_->factorised = true;
  impl_->summary.factor_seconds = seconds_since(start);
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
  if (X.outerStride() == X.rows()) {
    impl_->solve(B, X.data());
    return;
  }
  Eigen::MatrixXd dense(X.rows(), X.cols());  // CHOLMOD writes only blocks without gaps between columns
  impl_->solve(B, dense.data());
  X = dense;
}

int SparseFactor::negative_pivots() const {
  require(impl_->factorised, "negative pivots: nothing is factorised");
  if (impl_->kind == FactorKind::definite) return 0;
  int count = 0;
  for (Eigen::Index j = 0; j < impl_->size; ++j) count += impl_->pivot(j) < 0;
  return count;
}

double SparseFactor::rcond_estimate() const {
  require(impl_->factorised, "condition: nothing is factorised");
  return cholmod_rcond(impl_->L, &impl_->common);
}

std::string SparseFactor::library_release() {
  int version[3] = {};
  cholmod_version(version);
  return fmt::format("{}.{}.{}", version[0], version[1], version[2]);
}

FactorKind SparseFactor::kind() const { return impl_->kind; }

FactorSummary SparseFactor::summary() const { return impl_->summary; }

}  // namespace flexboom
