#include "dynamics/numerics/newton_matrix.hpp"

#include "fem/base/check.hpp"

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Loops, for an expression of Eigen allocates a copy of the indices.
void part(const MatrixXd& from, const std::vector<int>& rows, const std::vector<int>& columns, MatrixXd& to) {
  to.resize(std::ssize(rows), std::ssize(columns));
  for (Index j = 0; j < to.cols(); ++j)
    for (Index i = 0; i < to.rows(); ++i)
      to(i, j) = from(rows[static_cast<size_t>(i)], columns[static_cast<size_t>(j)]);
}

void part(const VectorXd& from, const std::vector<int>& rows, VectorXd& to) {
  to.resize(std::ssize(rows));
  for (Index i = 0; i < to.size(); ++i) to[i] = from[rows[static_cast<size_t>(i)]];
}

}  // namespace

void NewtonMatrix::sort() {
  const auto n = static_cast<size_t>(J.rows());
  core_.clear(), followers_.clear(), values_.clear(), coordinates_.clear();
  rate_of_.assign(n, -1), place_.assign(n, -1), is_rate_.assign(n, 0);
  const auto is_follower = [this](int i) { return (J.col(i).array() == 0).all(); };
  for (int i = 0; i < static_cast<int>(n); ++i) {
    Index rate = 0;
    const bool is_one = J.row(i).cwiseAbs().maxCoeff(&rate) == 1 && J(i, rate) == 1 && rate != i;
    if (!is_one || (J.row(i).array() != 0).count() != 1) continue;
    rate_of_[static_cast<size_t>(i)] = static_cast<int>(rate);
    is_rate_[static_cast<size_t>(rate)] = 1;
  }
  for (int i = 0; i < static_cast<int>(n); ++i) {
    const auto at = static_cast<size_t>(i);
    if (is_follower(i))
      followers_.push_back(i);
    else if (rate_of_[at] < 0 || is_rate_[at])
      place_[at] = static_cast<int>(core_.size()), core_.push_back(i);
    else
      values_.push_back(i);
  }
  for (const int i : values_)
    coordinates_.push_back({i, place_[static_cast<size_t>(rate_of_[static_cast<size_t>(i)])]});
  part(J, core_, core_, by_core_);
  part(J, core_, values_, by_values_);
  of_followers_.resize(std::ssize(followers_), J.cols());
  for (Index i = 0; i < of_followers_.rows(); ++i) of_followers_.row(i) = J.row(followers_[static_cast<size_t>(i)]);
}

void NewtonMatrix::factorise(double gamma) {
  gamma_ = gamma;
  condensed_ = -gamma * by_core_;
  for (size_t i = 0; i < coordinates_.size(); ++i)
    condensed_.col(coordinates_[i].rate) -= gamma * gamma * by_values_.col(static_cast<Index>(i));
  condensed_.diagonal().array() += 1.0;
  if (!J.allFinite()) throw NumericalError("the Jacobian of the equations of motion is not finite");
  lu_.compute(condensed_);
}

void NewtonMatrix::solve(const double* b, double* x) {
  all_ = Eigen::Map<const VectorXd>(b, J.rows());
  part(all_, values_, values_b_);
  part(all_, core_, core_b_);
  core_b_.noalias() += gamma_ * (by_values_ * values_b_);
  core_x_ = lu_.solve(core_b_);
  for (Index i = 0; i < core_x_.size(); ++i) all_[core_[static_cast<size_t>(i)]] = core_x_[i];
  for (const Coordinate& c : coordinates_) all_[c.value] += gamma_ * core_x_[c.rate];
  followers_x_.noalias() = of_followers_ * all_;  // their own columns are zero
  for (Index i = 0; i < followers_x_.size(); ++i) all_[followers_[static_cast<size_t>(i)]] += gamma_ * followers_x_[i];
  Eigen::Map<VectorXd>(x, J.rows()) = all_;
}

}  // namespace flexboom
