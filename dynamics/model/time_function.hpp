#pragma once

#include "dynamics/model/multibody.hpp"

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace flexboom {

/// A function of time together with where it is not smooth: an integrator stops there.
struct TimeCourse {
  TimeFunction function;
  std::vector<double> corners;  // ascending [s]
  double begin = -std::numeric_limits<double>::infinity();
  double end = std::numeric_limits<double>::infinity();  // asked outside [begin, end] it throws InputError
};

/// A formula of t (`Expression`). It has no corners here: Expression::corners finds those of a duration.
/// @throws InputError with the column and the nearest known name.
TimeCourse time_expression(const std::string& text);

/// Values at given times. "cubic": spline with continuous acceleration. Its third derivative is continuous at the
/// second and the last but one point (not-a-knot: error of fourth order up to the ends). "linear": its acceleration is
/// zero.
struct TimeTable {
  std::vector<double> time;   // ascending [s]
  std::vector<double> value;  // one per time
  std::string interpolation = "cubic";
  std::string outside = "error";  // or "hold": the first and the last value
};
/// @throws InputError for an unknown word, sizes that differ, fewer than two rows, times that do not ascend.
TimeCourse time_table(const TimeTable&);

/// A turn from rest to rest. The duration follows from the limits. "trapezoid": accelerates and brakes with
/// `peak_acceleration`, between them `peak_rate` (a triangle where it is not reached). "smooth": polynomial of degree 7
/// whose rate, acceleration and jerk are zero at both ends; one of the limits is reached.
struct Manoeuvre {
  std::string profile = "smooth";
  double angle = 0;              // of either sign [rad]
  double peak_rate = 0;          // [rad/s]
  double peak_acceleration = 0;  // [rad/s^2]
  double start = 0;              // [s]
};

/// Angle, rate and acceleration of a manoeuvre: 0 before, `angle` after. Corners: where the acceleration (trapezoid) or
/// its third derivative (smooth) jumps, from start to end.
/// @throws InputError for an unknown profile or limits that are not positive.
TimeCourse rest_to_rest(const Manoeuvre&);

/// Ends of pieces of [0, duration], ascending [s]. On each piece a polynomial of degree 4 follows every function. It
/// does so to a thousandth of the function's range there or `negligible` of its largest size. The functions are seen at
/// `samples` times (a power of 2, 4 at least) at equal distances; no piece is shorter than four of these. What looks at
/// five points of a piece or more sees all that these functions do.
std::vector<double> smooth_pieces(const std::vector<std::function<double(double)>>&, double duration, int samples,
                                  double negligible);

}  // namespace flexboom
