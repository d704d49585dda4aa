#include "fem/base/check.hpp"
#include "fem/linear_algebra/inertia_methods.hpp"
#include "fem/linear_algebra/ordering.hpp"

#include <dmumps_c.h>
#include <fmt/format.h>

#include <cmath>
#include <vector>

namespace flexboom {
namespace {

/// One instance of the sequential library, silent, for symmetric indefinite matrices.
class Mumps {
 public:
  Mumps() {
    id_.sym = 2;
    id_.par = 1;
    id_.comm_fortran = -987654;  // the library's own communicator
    run(-1);
    for (const int stream : {1, 2, 3}) control(stream) = -1;
    control(4) = 0;    // prints nothing
    control(7) = 1;    // the order is given
    control(24) = 1;   // pivots that vanish are counted
    control(31) = 1;   // factors are not kept
    control(14) = 30;  // room for pivoting [%]
  }
  ~Mumps() {
    id_.job = -2;
    dmumps_c(&id_);
  }
  Mumps(const Mumps&) = delete;
  Mumps& operator=(const Mumps&) = delete;

  void give(const SparseMatrix& A) {
    for (int j = 0; j < A.cols(); ++j) {
      for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
        if (it.row() < j) continue;
        if (!std::isfinite(it.value()))
          throw NumericalError(fmt::format("MUMPS: entry ({}, {}) of the matrix is {}", it.row(), j, it.value()));
        row_.push_back(static_cast<int>(it.row()) + 1);
        column_.push_back(j + 1);
        value_.push_back(it.value());
      }
    }
    id_.n = static_cast<int>(A.cols());
    id_.nnz = static_cast<MUMPS_INT8>(value_.size());
    id_.irn = row_.data();
    id_.jcn = column_.data();
    id_.a = value_.data();
    const Ordering order = fill_reducing_ordering(A);
    place_.resize(order.permutation.size());
    for (size_t k = 0; k < order.permutation.size(); ++k) {
      place_[static_cast<size_t>(order.permutation[k])] = static_cast<int>(k) + 1;
    }
    id_.perm_in = place_.data();
  }

  /// Analysis and factorisation, with more room where pivoting asked for it.
  void factorise() {
    run(1);
    for (int attempt = 0;; ++attempt) {
      id_.job = 2;
      dmumps_c(&id_);
      const bool short_of_room = id_.infog[0] == -9 || id_.infog[0] == -8;
      if (!short_of_room || attempt == 4) break;
      control(14) *= 2;
    }
    check(2);
  }

  int negative_pivots() const { return id_.infog[11]; }

 private:
  int& control(int number) { return id_.icntl[number - 1]; }

  void run(int job) {
    id_.job = job;
    dmumps_c(&id_);
    check(job);
  }

  void check(int job) const {
    if (id_.infog[0] < 0)
      throw NumericalError(fmt::format("MUMPS: job {} failed with code {} ({})", job, id_.infog[0], id_.infog[1]));
  }

  DMUMPS_STRUC_C id_{};
  std::vector<int> row_, column_, place_;
  std::vector<double> value_;
};

}  // namespace

std::string mumps_release() { return MUMPS_VERSION; }

Inertia mumps_inertia(const SparseMatrix& A) {
  Mumps mumps;
  mumps.give(A);
  mumps.factorise();
  return {.negative = mumps.negative_pivots(), .method = "MUMPS"};
}

}  // namespace flexboom
