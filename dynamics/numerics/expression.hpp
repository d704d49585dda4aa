#pragma once

#include <array>
#include <string>
#include <vector>

namespace flexboom {

/// A formula of the time t [s], read once, evaluated without allocation from any thread. Numbers, t, pi, e;
/// + - * / ^, < <= > >= == !=, && ||, parentheses; the functions that `expression_names` lists, among them
/// if(condition, then, else).
class Expression {
 public:
  /// @throws InputError with the column and the nearest known name.
  explicit Expression(const std::string& text);

  /// Value and first two derivatives by t, all exact to round-off (forward differentiation, no differences). At a
  /// corner of abs, min, max, if or a comparison the derivative is that of the branch taken.
  std::array<double, 3> at(double t) const;

  /// The first times, within (begin, end) and ascending, at which a comparison, abs, sign, step, min or max is on
  /// another side than before. All of them where what is compared is linear in t; else those between two of `samples`
  /// times at equal distances that are on different sides.
  std::vector<double> corners(double begin, double end, int samples) const;

  /// One operation on earlier results.
  struct Node {
    int operation = -1;  // row of the table of operations; -1: t, -2: a constant
    std::array<int, 3> argument{};
    double constant = 0;
  };

 private:
  std::vector<Node> nodes_;
  int result_ = 0;
};

/// Names of functions and constants.
std::vector<std::string> expression_names();

}  // namespace flexboom
