#pragma once

#include <cstddef>
#include <vector>

namespace flexboom {

/// The search for the fewest modes that are enough, of a list that begins with those that move most. All of them are
/// enough. Fewer are tried, and a trial costs a flight: so few are, and a count is not sought to its last mode.
class FewestEnough {
 public:
  /// `displacements` [m], descending, of the modes that move. `too_few`: so many fewer ones are not enough, as was
  /// found before: at least that many are needed. `first`: how many are tried first where nothing was found before.
  FewestEnough(std::vector<double> displacements, double bearable_error, size_t too_few, size_t first);

  /// Would further trials cost more than what they save?
  bool is_settled() const;

  /// How many to try, and how many to try then, should these be too few.
  size_t next() const;
  size_t after_too_few() const;

  /// What next() ones leave out changes outputs by that much. NaN: nobody knows, so they are too few.
  void tell(double error);

  size_t enough() const { return enough_; }
  double error() const { return error_; }                    // of as many as are enough; 0 of all
  double error_of_fewer() const { return error_of_fewer_; }  // of the most that were too few

 private:
  double left_out(size_t count) const;
  size_t expected(size_t tried, double error) const;
  size_t between(size_t low) const;
  size_t hardly_any() const { return enough_ / 8; }

  std::vector<double> displacements_;
  double bearable_;
  size_t enough_, needed_, next_;  // at least `needed_`
  double error_ = 0, error_of_fewer_ = 0;
  bool is_near_ = false;  // fewer are expected to save hardly any
  int trials_ = 0;
};

}  // namespace flexboom
