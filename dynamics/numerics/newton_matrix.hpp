#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include <vector>

namespace flexboom {

/// I - gamma J of y' = f(y), in a smaller form. Two kinds of unknowns are taken out. The first are coordinates, whose
/// row of J has the one entry 1 of their rate. The second is what nothing depends on (energies, places without a
/// field): its column of J is zero.
class NewtonMatrix {
 public:
  Eigen::MatrixXd J;

  /// After J was changed.
  void sort();
  /// @throws NumericalError when J is not finite.
  void factorise(double gamma);
  /// x = (I - gamma J)^-1 b; both may be the same array.
  void solve(const double* b, double* x);

 private:
  struct Coordinate {
    int value, rate;  // rate: place in core_
  };
  std::vector<int> core_, followers_, values_;  // values: of the coordinates
  std::vector<int> rate_of_, place_;            // of every unknown, or -1
  std::vector<char> is_rate_;
  std::vector<Coordinate> coordinates_;
  double gamma_ = 0;
  Eigen::MatrixXd by_core_, by_values_, of_followers_, condensed_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  Eigen::VectorXd all_, core_b_, core_x_, values_b_, followers_x_;
};

}  // namespace flexboom
