#include "fem/base/check.hpp"
#include "fem/linear_algebra/dense.hpp"
#include "reduction/eigen/backends.hpp"
#include "reduction/eigen/orthogonal_basis.hpp"
#include "reduction/eigen/shift.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double tolerance_of_few = 1e-12;        // fewer than many_unknowns
constexpr double block_tolerance_of_many = 2e-7;  // measured, see README
constexpr double guard_tolerance = 1e-4;          // residual of the modes beyond those wanted
constexpr double negligible = 1e-13;              // a new direction this short, relative to its block, is round-off
constexpr double same_value = 1e-6;               // Ritz values this close may be copies of one
constexpr double random_part = 1e-4;              // of start vectors, beside shapes of size 1: what no shape holds
constexpr Index max_block = 32;
constexpr double suspicious = 1e15;  // largest nu times the scale of lambda: the shift may be an eigenvalue

/// Right-hand sides per solve. Few: the factor is read too often. Many: the Krylov space has a low degree. Measured
/// flat between 4 and 8 for 24 000 to 61 000 unknowns and 10 to 40 modes; 8 see the six rigid modes of a free body at
/// once.
Index vectors_in_block(const EigenRequest& request) { return request.count < 7 ? 4 : 8; }

/// Ritz pairs of the inverse: theta = 1 / (lambda - sigma), largest first.
struct Ritz {
  VectorXd theta;
  MatrixXd S;         // coefficients in the expanded basis
  VectorXd residual;  // relative: |OP x - theta x|_M / theta
};

/// Block Lanczos, Golub and Underwood 1977; Grimes, Lewis, Simon, SIAM J. Matrix Anal. 15 (1994) 228; restarts of Wu
/// and Simon, SIAM J. Matrix Anal. 22 (2000) 602. With V the first `expanded` vectors of the basis and N the others: OP
/// V = V T + N C, OP = (K - sigma M)^-1 M.
class BlockLanczos {
 public:
  BlockLanczos(const EigenProblem& p, const SparseFactor& factor, const EigenRequest& request)
      : p_(p),
        factor_(factor),
        request_(request),
        tolerance_(request.tolerance > 0        ? request.tolerance
                   : p.K.rows() < many_unknowns ? tolerance_of_few
                                                : block_tolerance_of_many),
        start_width_(std::min<Index>(vectors_in_block(request), p.K.rows())),
        scale_(stiffness_scale(p)),
        max_steps_(300 + 2 * request.count),
        basis_(p.M, std::min<Index>(p.K.rows(), request.count + std::max<Index>(3 * max_block, request.count / 2))),
        T_(MatrixXd::Zero(basis_.capacity(), basis_.capacity())),
        C_(0, 0) {}

  EigenPairs run() {
    start_afresh();
    if (basis_.size() == 0) throw NumericalError("block: the body has no mass");
    for (int steps = 1; steps <= max_steps_; ++steps) {
      expand();
      ++since_start_;
      if (!worth_a_look()) continue;
      const Ritz ritz = ritz_pairs();
      if (shift_is_an_eigenvalue(ritz)) throw NumericalError("block: the shift is an eigenvalue to round-off");
      const bool exhausted = expanded_ == basis_.size();
      const bool good = converged(ritz);
      if (good && has_every_copy(ritz)) return pairs(ritz, steps);
      if (exhausted || (good && trusted())) {
        if (!exhausted) lock(ritz);
        make_room(ritz, start_width_);
        if (start_afresh() == 0) return all_there_are(ritz_pairs(), steps);
      } else {
        make_room(ritz, basis_.size() - expanded_);
      }
    }
    throw NumericalError(fmt::format("block: no convergence within {} steps", max_steps_));
  }

 private:
  const EigenProblem& p_;
  const SparseFactor& factor_;
  EigenRequest request_;
  double tolerance_;
  Index start_width_;
  double scale_;  // of the highest eigenvalues
  int max_steps_;
  MassBasis basis_;
  MatrixXd T_;
  MatrixXd C_;
  Index expanded_ = 0;
  Index starts_ = 0;         // random vectors that entered
  VectorXd theta_at_start_;  // what had converged when the last of them entered
  int since_start_ = 0;      // steps since then
  int steps_to_trust_ = 8;   // that it takes for copies to show that only the last of them have
  Index looked_at_ = 0;
  int solves_ = 0;

  MatrixXd solve(const Eigen::Ref<const MatrixXd>& B) {
    MatrixXd X(B.rows(), B.cols());
    factor_.solve(B, X);
    solves_ += static_cast<int>(B.cols());
    return X;
  }

  /// Random vectors, the first of them small beside the shapes that are given, taken through the inverse once. That
  /// leaves nothing of freedoms without mass in them, and little of high modes. Returns how many were outside the
  /// basis.
  Index start_afresh() {
    MatrixXd R = random_block(p_.K.rows(), start_width_, 20201116 + static_cast<std::uint64_t>(starts_));
    const Index given = std::min(start_width_, p_.start.cols());
    if (starts_ == 0 && given > 0) R.leftCols(given) = random_part * R.leftCols(given) + p_.start.leftCols(given);
    const Index before = basis_.size();
    basis_.append(solve(symmetric_product(p_.M, R)), negligible);
    const Index added = basis_.size() - before;
    starts_ += added;
    since_start_ = 0;
    start_width_ = std::min<Index>(2 * start_width_, max_block);  // next time: the group is larger than thought
    C_.conservativeResizeLike(MatrixXd::Zero(C_.rows() + added, expanded_));
    return added;
  }

  /// One step: OP times the vectors that are not expanded yet, what is new in that becomes the next block.
  void expand() {
    const Index old = expanded_;
    const Index size = basis_.size();
    const Index width = size - old;
    const MatrixXd coefficients = basis_.append(solve(symmetric_product(p_.M, basis_.vectors(old))), negligible);
    T_.block(0, old, size, width) = coefficients.topRows(size);
    T_.block(old, 0, width, old) = coefficients.topRows(old).transpose();
    T_.block(old, old, width, width) =
        (coefficients.middleRows(old, width) + coefficients.middleRows(old, width).transpose()) / 2;
    const Index added = basis_.size() - size;
    C_ = MatrixXd::Zero(added, size);
    C_.rightCols(width) = coefficients.bottomRows(added);
    expanded_ = size;
  }

  bool has_room(Index incoming) const { return basis_.size() + incoming <= basis_.capacity(); }

  /// The small eigenproblem costs more than a step once the basis is large: then only now and again.
  bool worth_a_look() {
    if (expanded_ == basis_.size() || !has_room(basis_.size() - expanded_)) return true;
    if (expanded_ < request_.count || expanded_ < looked_at_ + (expanded_ < 150 ? 1 : expanded_ / 10)) return false;
    looked_at_ = expanded_;
    return true;
  }

  Ritz ritz_pairs() const {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(T_.topLeftCorner(expanded_, expanded_)));
    Ritz ritz;
    ritz.theta = eigen.eigenvalues().reverse();
    ritz.S = eigen.eigenvectors().rowwise().reverse();
    ritz.residual = (C_ * ritz.S).colwise().norm().transpose().cwiseQuotient(ritz.theta.cwiseAbs());
    return ritz;
  }

  bool converged(const Ritz& ritz) const {
    if (expanded_ < request_.count) return false;
    if (!(ritz.theta(request_.count - 1) > infinite_nu * ritz.theta(0))) return false;
    return ritz.residual.head(request_.wanted).maxCoeff() <= tolerance_ &&
           ritz.residual.head(request_.count).maxCoeff() <= std::max(tolerance_, guard_tolerance);
  }

  /// A Krylov space from s random vectors holds s copies of an eigenvalue, and those that round-off brings in. When a
  /// group is that large, another random block must have brought nothing new.
  bool has_every_copy(const Ritz& ritz) {
    const VectorXd theta = ritz.theta.head(request_.count);
    Index largest = 1;
    for (Index i = 1, group = 1; i < theta.size(); ++i) {
      group = theta(i) > (1 - same_value) * theta(i - 1) ? group + 1 : 1;
      largest = std::max(largest, group);
    }
    if (largest < starts_) return true;
    const bool first_time = theta_at_start_.size() == 0;
    if (first_time) steps_to_trust_ = std::min(steps_to_trust_, since_start_);
    if (!trusted()) return false;
    const bool nothing_new =
        !first_time && ((theta - theta_at_start_).array().abs() <= same_value * theta_at_start_.array()).all();
    theta_at_start_ = theta;
    return nothing_new;
  }

  /// Whether the last start had the steps that it takes to show what it brings.
  bool trusted() const { return since_start_ >= steps_to_trust_ || expanded_ == basis_.size(); }

  /// The basis becomes the first `kept` Ritz vectors and the block that is not expanded yet.
  void keep(const Ritz& ritz, Index kept) {
    basis_.rotate(ritz.S.leftCols(kept));
    T_.setZero();
    T_.diagonal().head(kept) = ritz.theta.head(kept);
    C_ = (C_ * ritz.S.leftCols(kept)).eval();
    expanded_ = kept;
    looked_at_ = 0;
  }

  /// Thick restart: when there is no room for what comes next, the Ritz vectors of the largest theta stay.
  void make_room(const Ritz& ritz, Index incoming) {
    if (has_room(incoming) || basis_.capacity() == p_.K.rows() || expanded_ <= request_.count) return;
    const Index most = basis_.capacity() - (basis_.size() - expanded_) - incoming;
    keep(ritz, std::clamp<Index>(most, request_.count, request_.count + (expanded_ - request_.count) / 3));
  }

  /// Only the converged vectors stay; what is known of their residual, which is small enough, is forgotten.
  void lock(const Ritz& ritz) {
    keep(ritz, request_.count);
    basis_.truncate(expanded_);
    C_.resize(0, expanded_);
  }

  /// The energy of the lowest Ritz vector has no digit. A mesh with tiny elements is not such a case, however high its
  /// highest eigenvalue.
  bool shift_is_an_eigenvalue(const Ritz& ritz) const {
    if (ritz.theta(0) * scale_ < suspicious) return false;
    return !(1 / ritz.theta(0) > no_digit * energy_round_off(p_, request_.sigma, ritz_vectors(ritz, 1)));
  }

  /// Ritz vectors after one more application of the inverse, which costs nothing: OP V s / theta = V s + N C s / theta.
  /// It removes what round-off left in freedoms without mass (Nour-Omid, Parlett, Ericsson, Jensen, Math. Comp. 48
  /// (1987) 663).
  MatrixXd ritz_vectors(const Ritz& ritz, Index count) const {
    const MatrixXd S = ritz.S.leftCols(count);
    MatrixXd all(basis_.size(), count);
    all << S, C_ * S * ritz.theta.head(count).cwiseInverse().asDiagonal();
    return product(basis_.vectors(), all);
  }

  EigenPairs pairs(const Ritz& ritz, int steps) const {
    const Index count = request_.count;
    EigenPairs result;
    result.lambda = request_.sigma + ritz.theta.head(count).array().inverse();
    result.Phi = ritz_vectors(ritz, count);
    result.summary.iterations = steps;
    result.summary.solves = solves_;
    return result;
  }

  EigenPairs all_there_are(const Ritz& ritz, int steps) {
    const Index found = (ritz.theta.array() > infinite_nu * ritz.theta(0)).count();
    if (found < request_.wanted) throw_too_few_eigenvalues(p_, ritz.theta(0), found, request_.wanted);
    request_.count = static_cast<int>(std::min<Index>(found, request_.count));
    return pairs(ritz, steps);
  }
};

}  // namespace

EigenPairs block_modes(const EigenProblem& p, const SparseFactor& shifted, const EigenRequest& request) {
  return BlockLanczos(p, shifted, request).run();
}

}  // namespace flexboom
