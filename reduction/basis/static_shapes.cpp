#include "reduction/basis/static_shapes.hpp"

#include "fem/assembly/idle_freedoms.hpp"

#include <fmt/format.h>
#include <Eigen/QR>

#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// K_ii (lower triangle) and K_ib of a symmetric matrix, lower triangle; i: not held, b: held.
std::pair<SparseMatrix, SparseMatrix> parts(const SparseMatrix& K, const std::vector<int>& held,
                                            const std::vector<int>& left) {
  std::vector<int> place_held(static_cast<size_t>(K.cols()), -1), place_left = place_held;
  for (size_t i = 0; i < held.size(); ++i) place_held[static_cast<size_t>(held[i])] = static_cast<int>(i);
  for (size_t i = 0; i < left.size(); ++i) place_left[static_cast<size_t>(left[i])] = static_cast<int>(i);
  std::vector<Eigen::Triplet<double>> among, to_held;
  among.reserve(static_cast<size_t>(K.nonZeros()));
  for (int j = 0; j < K.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(K, j); it; ++it) {
      const auto row = static_cast<size_t>(it.row()), col = static_cast<size_t>(j);
      if (row < col) continue;
      if (place_left[row] >= 0 && place_left[col] >= 0)
        among.emplace_back(place_left[row], place_left[col], it.value());
      if (place_left[row] >= 0 && place_held[col] >= 0)
        to_held.emplace_back(place_left[row], place_held[col], it.value());
      if (place_held[row] >= 0 && place_left[col] >= 0)
        to_held.emplace_back(place_left[col], place_held[row], it.value());
    }
  }
  std::pair<SparseMatrix, SparseMatrix> result{{std::ssize(left), std::ssize(left)},
                                               {std::ssize(left), std::ssize(held)}};
  result.first.setFromTriplets(among.begin(), among.end());
  result.second.setFromTriplets(to_held.begin(), to_held.end());
  return result;
}

std::vector<int> others(Index count, const std::vector<int>& held) {
  std::vector<char> is_held(static_cast<size_t>(count), 0);
  for (const int i : held) is_held[static_cast<size_t>(i)] = 1;
  std::vector<int> left;
  for (int i = 0; i < count; ++i) {
    if (!is_held[static_cast<size_t>(i)]) left.push_back(i);
  }
  return left;
}

/// `unknown`: of each row of K.
std::shared_ptr<const SparseFactor> factorised(const SparseMatrix& K, const std::vector<int>& unknown) {
  auto factor = std::make_shared<SparseFactor>(K, FactorKind::definite);
  try {
    factor->factorise(K);
  } catch (const SingularMatrix& e) {
    throw SingularMatrix(e.what(), unknown[static_cast<size_t>(e.unknown)]);
  }
  return factor;
}

}  // namespace

std::vector<int> determinate_support(const Mesh& mesh, const DofMap& dofs, const Unknowns& left) {
  const double size = (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm();
  MatrixXd T = rigid_motions(mesh, dofs);
  const Eigen::Vector3d centre = mesh.nodes.rowwise().mean();
  T.col(3) += centre.z() * T.col(1) - centre.y() * T.col(2);  // about the centre
  T.col(4) += centre.x() * T.col(2) - centre.z() * T.col(0);
  T.col(5) += centre.y() * T.col(0) - centre.x() * T.col(1);
  T.rightCols(3) /= size;
  const std::vector<char> strained = strained_freedoms(mesh, dofs);
  std::vector<int> freedoms = left.free_dofs();
  std::erase_if(freedoms, [&strained](int dof) { return !strained[static_cast<size_t>(dof)]; });
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(MatrixXd(T(freedoms, Eigen::all).transpose()));
  std::vector<int> support;
  for (Index i = 0; i < qr.rank(); ++i) {
    const int dof = freedoms[static_cast<size_t>(qr.colsPermutation().indices()(i))];
    support.push_back(left.of_freedom[static_cast<size_t>(dof)]);
  }
  return support;
}

StaticSolver::StaticSolver(const SparseMatrix& K, const std::vector<int>& held)
    : count_(K.cols()), held_(held), left_(others(K.cols(), held)) {
  auto [among, to_held] = parts(K, held_, left_);
  K_held_.swap(to_held);
  const auto own = std::make_shared<SparseMatrix>();
  own->swap(among);
  factor_ = factorised(*own, left_);
  K_ = own;
}

StaticSolver::StaticSolver(std::shared_ptr<const SparseFactor> factor, std::shared_ptr<const SparseMatrix> K)
    : count_(K->cols()),
      left_(others(K->cols(), {})),
      K_(std::move(K)),
      K_held_(count_, 0),
      factor_(std::move(factor)) {}

MatrixXd StaticSolver::solve(const MatrixXd& f) const {
  MatrixXd x(f.rows(), f.cols());
  factor_->solve(f, x);
  // One correction by what is left of the load: the factor of a slender body loses digits that K still has.
  const MatrixXd left_over = f - symmetric_product(*K_, x);
  MatrixXd correction(f.rows(), f.cols());
  factor_->solve(left_over, correction);
  return x + correction;
}

MatrixXd StaticSolver::displaced(const MatrixXd& values) const {
  MatrixXd x(count_, values.cols());
  x(held_, Eigen::all) = values;
  x(left_, Eigen::all) = solve(-(K_held_ * values));
  return x;
}

MatrixXd StaticSolver::loaded(const MatrixXd& f) const {
  MatrixXd x = MatrixXd::Zero(count_, f.cols());
  x(left_, Eigen::all) = solve(f(left_, Eigen::all));
  return x;
}

StaticSolver static_solver(const Mesh& mesh, const Assembly& assembly, const Unknowns& left,
                           const std::vector<int>& held) {
  try {
    return {left.reduced(assembly.K), held};
  } catch (const SingularMatrix& e) {
    const int dof = left.free_dofs()[static_cast<size_t>(e.unknown)];
    throw NumericalError(fmt::format("{}: nothing resists {}; hold it, or join what it belongs to", e.what(),
                                     freedom_name(mesh, assembly.dofs, dof)));
  }
}

std::pair<MatrixXd, MatrixXd> StaticSolver::loaded_once(const MatrixXd& f) const {
  const MatrixXd f_left = f(left_, Eigen::all);
  MatrixXd x_left(f_left.rows(), f.cols());
  factor_->solve(f_left, x_left);
  std::pair<MatrixXd, MatrixXd> result{MatrixXd::Zero(count_, f.cols()), MatrixXd::Zero(count_, f.cols())};
  result.first(left_, Eigen::all) = x_left;
  result.second(left_, Eigen::all) = f_left - symmetric_product(*K_, x_left);
  return result;
}

}  // namespace flexboom
