#pragma once

#include "dynamics/numerics/linear_part.hpp"
#include "dynamics/relative/split.hpp"

#include <Eigen/Core>

#include <map>
#include <memory>
#include <utility>
#include <vector>

namespace flexboom {

/// A coordinate that nothing pulls back (a hinge without a spring) has no two eigenvectors of its own. In L it vibrates
/// at this angular frequency [rad/s]; the remainder takes the difference.
inline constexpr double held = 1e-3;

/// The linear parts L of x' = L x + N of a flight. There is one for each set of closed stops, taken at rest near where
/// the joints are. It is kept until `renew` puts another in its place.
class LinearParts {
 public:
  explicit LinearParts(SplitProblem&);

  /// Which stops are closed, from now on.
  void close(const std::vector<char>& contact) { contact_ = contact; }

  /// The one near the joints' coordinates of y: made when first met. @throws NumericalError.
  LinearPart& near(double t, const Eigen::VectorXd& y);

  /// Another one, taken at `base`, in its place. @throws NumericalError.
  LinearPart& renew(double t, const Eigen::VectorXd& base);

  /// Are the joints of y near to where it was taken?
  bool serves(const LinearPart&, const Eigen::VectorXd& y) const;

  /// How many were made.
  long made() const { return made_; }

 private:
  Eigen::VectorXd base_at(const Eigen::VectorXd& y) const;
  std::unique_ptr<LinearPart> make(double t, const Eigen::VectorXd& base);
  std::unique_ptr<LinearPart> make_of_neighbour(double t, const Eigen::VectorXd& base);
  Eigen::VectorXd pull_of(size_t stop, double t, Eigen::VectorXd base);
  std::pair<const LinearPart*, size_t> neighbour(const Eigen::VectorXd& base) const;

  SplitProblem& problem_;
  const SplitLayout& layout_;
  std::vector<char> contact_;
  std::map<std::vector<char>, std::unique_ptr<LinearPart>> parts_;
  Eigen::VectorXd y_dot_;
  long made_ = 0;
};

}  // namespace flexboom
