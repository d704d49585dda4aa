#pragma once

#include "fem/assembly/constraints.hpp"
#include "fem/linear_algebra/sparse_factor.hpp"

#include <Eigen/Core>

#include <memory>
#include <utility>
#include <vector>

namespace flexboom {

/// Unknowns that hold a free body without straining it, as many as it has rigid motions. They are the pivots of a QR
/// factorisation of the motions of what elements resist, lengths scaled to the body.
std::vector<int> determinate_support(const Mesh&, const DofMap&, const Unknowns&);

/// Static solutions of K x = f with some of the unknowns held: one factorisation of the others.
class StaticSolver {
 public:
  /// K: lower triangle. @throws SingularMatrix when the held unknowns leave a motion without stiffness.
  StaticSolver(const SparseMatrix& K, const std::vector<int>& held);

  /// Nothing held, by the factor of K that the caller has (ModalBasis::factor and K): nothing is copied.
  StaticSolver(std::shared_ptr<const SparseFactor>, std::shared_ptr<const SparseMatrix> K);

  /// x with the held unknowns at the given values and no load on the others: a column per column of `values`.
  Eigen::MatrixXd displaced(const Eigen::MatrixXd& values) const;

  /// x of loads f (all unknowns x k), zero where held.
  Eigen::MatrixXd loaded(const Eigen::MatrixXd& f) const;

  /// The same at half the time, without a second solve for the digits that the factor of a slender body loses. The
  /// second matrix is the loads that are left over, f - K x, zero where held.
  std::pair<Eigen::MatrixXd, Eigen::MatrixXd> loaded_once(const Eigen::MatrixXd& f) const;

 private:
  Eigen::MatrixXd solve(const Eigen::MatrixXd& f) const;

  Eigen::Index count_ = 0;
  std::vector<int> held_, left_;
  std::shared_ptr<const SparseMatrix> K_;  // of those left, lower triangle
  SparseMatrix K_held_;                    // left x held
  std::shared_ptr<const SparseFactor> factor_;
};

/// Static solutions of a mesh over the unknowns that its constraints leave, with some of them held.
/// @throws NumericalError naming a node and the direction in which it can move without stiffness.
StaticSolver static_solver(const Mesh&, const Assembly&, const Unknowns&, const std::vector<int>& held = {});

}  // namespace flexboom
