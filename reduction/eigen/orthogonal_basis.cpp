#include "reduction/eigen/orthogonal_basis.hpp"

#include "fem/linear_algebra/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double independent = 1e-4;  // eigenvalues of a Gram matrix (unit diagonal) above this: digits lost below 100
constexpr double unchanged = 1e-13;   // M W of a block that changed by less is good for another round
constexpr int max_rounds = 6;         // each takes directions 100 times shorter than the one before

/// M-norms of columns, given M W.
VectorXd norms(const MatrixXd& W, const MatrixXd& M_W) {
  return W.cwiseProduct(M_W).colwise().sum().transpose().cwiseMax(0).cwiseSqrt();
}

/// X such that W X is nearly orthonormal, from G = W^T M W: the directions that are well apart from each other.
/// Columns of W no longer than `cut` count as zero. Stathopoulos, Wu, SIAM J. Sci. Comput. 23 (2002) 2165.
MatrixXd well_apart(const MatrixXd& G, double cut) {
  const VectorXd length = G.diagonal().cwiseMax(0).cwiseSqrt();
  const VectorXd D = length.unaryExpr([cut](double x) { return x > cut ? 1 / x : 0; });
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(D.asDiagonal() * G * D.asDiagonal()));
  const VectorXd& w = eigen.eigenvalues();
  const Index kept = (w.array() > independent * w(w.size() - 1)).count();
  if (!(w(w.size() - 1) > 0)) return MatrixXd::Zero(G.rows(), 0);
  return D.asDiagonal() * eigen.eigenvectors().rightCols(kept) * w.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

}  // namespace

MatrixXd random_block(Index n, Index columns, std::uint64_t seed) {
  MatrixXd block(n, columns);
  std::uint64_t state = seed;
  for (double& entry : block.reshaped()) {  // SplitMix64: Steele, Lea, Flood, OOPSLA 2014
    std::uint64_t z = state += 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    entry = static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53 - 0.5;
  }
  return block;
}

MassBasis::MassBasis(const SparseMatrix& M, Index capacity) : M_(M), V_(M.rows(), capacity) {}

MatrixXd MassBasis::project_out(MatrixXd& W, const MatrixXd& M_W) const {
  MatrixXd coefficients = transposed_product(V_.leftCols(size_), M_W);
  add_product(W, -1, Transposed::no, V_.leftCols(size_), coefficients);
  return coefficients;
}

MatrixXd MassBasis::append(MatrixXd W, double negligible) {
  const Index before = size_;
  const Index room = std::min(before + W.cols(), capacity());
  MatrixXd all = MatrixXd::Zero(room, W.cols());
  all.topRows(before) = project_out(W, symmetric_product(M_, W));
  double cut = -1;
  for (int round = 0; round < max_rounds && size_ < room; ++round) {
    MatrixXd M_W = symmetric_product(M_, W);
    const MatrixXd more = project_out(W, M_W);  // twice is enough (Parlett 6.9)
    all.topRows(size_) += more;
    VectorXd left = norms(W, M_W);
    if (!(more.colwise().norm().transpose().array() <= unchanged * left.array()).all()) {
      M_W = symmetric_product(M_, W);
      left = norms(W, M_W);
    }
    if (cut < 0) cut = negligible * (left.cwiseAbs2() + all.colwise().squaredNorm().transpose()).cwiseSqrt().maxCoeff();
    const MatrixXd G = transposed_product(W, M_W);
    const MatrixXd X = well_apart((G + G.transpose()) / 2, cut);
    const Index added = std::min(X.cols(), room - size_);
    if (added == 0) break;
    auto Q = V_.middleCols(size_, added);
    Q = product(W, X.rightCols(added));
    MatrixXd P = product(M_W, X.rightCols(added));
    const Eigen::LLT<MatrixXd> polish(transposed_product(Q, P));
    polish.matrixU().solveInPlace<Eigen::OnTheRight>(Q);
    polish.matrixU().solveInPlace<Eigen::OnTheRight>(P);
    const MatrixXd inside = transposed_product(P, W);
    all.middleRows(size_, added) = inside;
    size_ += added;
    if (added == W.cols()) break;
    add_product(W, -1, Transposed::no, Q, inside);
  }
  return all.topRows(size_);
}

void MassBasis::rotate(const MatrixXd& S) {
  const Index tail = size_ - S.rows();
  // By slices of rows, so that the copy stays small.
  constexpr Index slice = 512;
  MatrixXd rows;
  for (Index first = 0; first < V_.rows(); first += slice) {
    const Index height = std::min(slice, V_.rows() - first);
    rows.noalias() = V_.block(first, 0, height, S.rows()) * S;
    const MatrixXd rest = V_.block(first, S.rows(), height, tail);
    V_.block(first, 0, height, S.cols()) = rows;
    V_.block(first, S.cols(), height, tail) = rest;
  }
  size_ = S.cols() + tail;
}

}  // namespace flexboom
