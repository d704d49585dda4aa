#include "fem/sparse_factor.hpp"

#include "fem/check.hpp"

#include <cholmod.h>
#include <fmt/format.h>

#include <cmath>
#include <span>
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

cholmod_dense view(const Eigen::Ref<const Eigen::VectorXd>& b) {
  cholmod_dense result{};
  result.nrow = static_cast<size_t>(b.size());
  result.ncol = 1;
  result.nzmax = result.nrow;
  result.d = result.nrow;
  result.x = const_cast<double*>(b.data());
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

// `common`, the factor and the vectors kept for solves, freed together.
struct SparseFactor::Impl {
  cholmod_common common{};
  cholmod_factor* L = nullptr;
  cholmod_dense* X = nullptr;
  cholmod_dense* Y = nullptr;
  cholmod_dense* E = nullptr;
  Eigen::Index size = 0;
  Eigen::Index entries = 0;
  bool factorised = false;

  Impl() {
    cholmod_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    common.supernodal = CHOLMOD_SIMPLICIAL;  // supernodal factors are L L^T, which stops at the first negative pivot
    common.final_ll = 0;
  }
  ~Impl() {
    cholmod_free_dense(&E, &common);
    cholmod_free_dense(&Y, &common);
    cholmod_free_dense(&X, &common);
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // D_jj is the first entry of column j of a simplicial L D L^T.
  double pivot(Eigen::Index j) const { return static_cast<const double*>(L->x)[static_cast<const int*>(L->p)[j]]; }

  void check_pivots() const {
    for (Eigen::Index j = 0; j < size; ++j) {
      if (std::isfinite(pivot(j)) && pivot(j) != 0) continue;
      throw NumericalError(fmt::format("sparse factorisation: pivot {} of {} is {}", j, size, pivot(j)));
    }
  }
};

SparseFactor::SparseFactor(const SparseMatrix& pattern) : impl_(std::make_unique<Impl>()) {
  require(
      pattern.rows() == pattern.cols() && pattern.rows() > 0,
      fmt::format("sparse factorisation: the matrix is {} x {}; it must be square", pattern.rows(), pattern.cols()));
  require(pattern.isCompressed(), "sparse factorisation: the matrix must be compressed");
  cholmod_sparse A = view(pattern);
  impl_->size = pattern.rows();
  impl_->entries = pattern.nonZeros();
  impl_->L = cholmod_analyze(&A, &impl_->common);
  check_status(impl_->common, "sparse analysis");
}

SparseFactor::~SparseFactor() = default;
SparseFactor::SparseFactor(SparseFactor&&) noexcept = default;
SparseFactor& SparseFactor::operator=(SparseFactor&&) noexcept = default;

void SparseFactor::factorise(const SparseMatrix& A) {
  require(A.rows() == impl_->size && A.cols() == impl_->size && A.nonZeros() == impl_->entries && A.isCompressed(),
          "sparse factorisation: the matrix has another pattern than the one analysed");
  impl_->factorised = false;
  cholmod_sparse a = view(A);
  cholmod_factorize(&a, impl_->L, &impl_->common);
  check_status(impl_->common, "sparse factorisation");
  impl_->check_pivots();
  impl_->factorised = true;
}

void SparseFactor::solve(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x) const {
  require(impl_->factorised, "sparse solve: nothing is factorised");
  require(
      b.size() == impl_->size && x.size() == impl_->size,
      fmt::format("sparse solve: vectors have {} and {} entries, the matrix has {}", b.size(), x.size(), impl_->size));
  cholmod_dense rhs = view(b);
  cholmod_solve2(CHOLMOD_A, impl_->L, &rhs, nullptr, &impl_->X, nullptr, &impl_->Y, &impl_->E, &impl_->common);
  check_status(impl_->common, "sparse solve");
  x = Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(impl_->X->x), impl_->size);
}

int SparseFactor::negative_pivots() const {
  require(impl_->factorised, "negative pivots: nothing is factorised");
  int count = 0;
  for (Eigen::Index j = 0; j < impl_->size; ++j) count += impl_->pivot(j) < 0;
  return count;
}

long SparseFactor::nonzeros() const {
  require(impl_->factorised, "factor entries: nothing is factorised");
  const std::span<const int> columns(static_cast<const int*>(impl_->L->nz), static_cast<size_t>(impl_->size));
  long sum = 0;
  for (int entries : columns) sum += entries;
  return sum;
}

}  // namespace flexboom
