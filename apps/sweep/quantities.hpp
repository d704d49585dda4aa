#pragma once

#include "apps/simulate/simulate.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// One number of a run, made from an output: a column of trajectory.csv, or the length of a vector whose columns end in
/// .x, .y and .z.
struct Quantity {
  enum class Kind { max, rms, final, settle };
  std::string name;  // "sip.angle:max"
  std::string output;
  Kind kind = Kind::max;
  double fraction = 0;  // of settle
};

/// COLUMN:max, COLUMN:rms, COLUMN:final, settle:COLUMN:FRACTION. @throws InputError for any other text.
Quantity quantity_of(const std::string& text);

/// Largest size and root mean square of every attitude, hinge angle and tip; where there are loads, their largest size.
std::vector<Quantity> default_quantities(const std::vector<std::string>& columns);

/// @throws InputError naming the nearest outputs where a quantity is of an output that is not there.
void check_quantities(const std::vector<Quantity>&, const std::vector<std::string>& columns);

/// max: largest |y|. rms: root of the mean of y^2 over time, by the trapezoidal rule. final: the last y. settle: the
/// last time at which |y - final| exceeds the fraction of its own largest value [s], the start where it never moves.
/// NaN where the table has no such output.
double value_of(const Quantity&, const OutputTable&);

}  // namespace flexboom
