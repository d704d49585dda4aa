#pragma once

#include "apps/model/prepared_body.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "apps/simulate/output_table.hpp"
#include "dynamics/events/flight.hpp"

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// How far the outputs of one run are from those of another. A vector is one output: "hub.rotation" has three columns.
namespace flexboom {

/// What makes of an output that hardly moves no more than it is: the errors that its scale must bear.
struct OutputFloors {
  double tolerance = 1;                   // what relative errors are held against
  double length = 0;                      // of the scene [m]
  double inertia = 0;                     // the least of a rigid body [kg m^2]; 0: there is none
  std::vector<AbsoluteError> absolute{};  // the user's
};

struct OutputDifference {
  std::string name;
  double error = 0;  // the largest over time, by the scale
  double scale = 0;  // the largest value of the output over time, or its floor where that is more [its unit]
  double time = 0;   // of the largest [s]
  double size = 0;   // the largest value of the output over time [its unit]
};

/// The largest |a - b| over time, by the largest |b| over time. The outputs compared are those that both tables have
/// and that are wanted. When `wanted` is empty, they are all but lvlh.
///
/// With floors that size is no less than an absolute error, or round-off, divided by the tolerance. Round-off is 1e-14
/// of the largest of these:
/// - a radian, the scene's length, or that times the largest rate or force;
/// - the rate that all of the kinetic energy would give the least inertia, 100 rad/s at most;
/// - the largest output of the same unit.
///
/// An output that stays below 1e-11 of that in both tables is zero, and what is left of it is round-off.
///
/// An output with an accuracy of its own (as wanted_output) has the error `tolerance` where it has that accuracy.
std::vector<OutputDifference> compare_outputs(const OutputTable& a, const OutputTable& b,
                                              const std::vector<std::string>& wanted, const OutputFloors& = {});

/// The largest of the errors, 0 of none.
double largest(const std::vector<OutputDifference>&);

/// What the outputs of a scene with these bodies must bear.
OutputFloors floors_of(const Scene&, const std::vector<PreparedBody>&);

/// What a run that shares little with this one says of its outputs.
struct ReferenceCheck {
  std::string what;
  std::string method;  // that it took
  std::vector<OutputDifference> differences;
  std::string missing;  // why it has none
};

/// Where errors come from, each relative to the scale of its output.
struct ErrorParts {
  double discretisation = unknown, truncation = unknown, time = unknown, linearisation = unknown;

  /// The name and the size of the largest that is known; "" and 0 where none is.
  std::pair<std::string_view, double> largest_part() const;
};
inline constexpr std::array<std::pair<std::string_view, double ErrorParts::*>, 4> error_parts = {
    {{"discretisation", &ErrorParts::discretisation},
     {"truncation", &ErrorParts::truncation},
     {"time", &ErrorParts::time},
     {"linearisation", &ErrorParts::linearisation}}};

/// Errors of one output, each relative to its scale. What was not measured is unknown (NaN).
struct OutputErrors : ErrorParts {
  std::string name;
  double scale = 0;  // [its unit]
  double when = 0;   // the largest of them is worst [s]
  double size = 0;   // as OutputDifference [its unit]

  /// Elastic coordinates have the meaning of their own basis: nothing is left out of them, no mesh is finer.
  bool is_of_its_basis() const { return name.ends_with(".q"); }
  double total() const { return time + linearisation + (is_of_its_basis() ? 0 : discretisation + truncation); }
  /// The sum of what was measured.
  double known() const;
};

/// Its name, when it is worst, and the largest part where that is known: "hub.rotation at t = 3.2 s, most of it
/// truncation".
std::string description(const OutputErrors&);

/// Four separate errors of a run (README of apps: what each is compared with), each the largest over the outputs
/// wanted. What was not measured is unknown (NaN), and then so is the total.
struct ErrorBudget : ErrorParts {
  std::vector<OutputErrors> outputs;
  std::vector<std::string> missing;     // which part was not measured and why, one line each
  std::map<std::string, double> reach;  // up to which modes of bodies must go for tones that shake them [rad/s]
  bool measured = false;                // false: the repeats were not run, or not to their end
  bool has_stiffened = false;           // geometric stiffness that the scene leaves open was switched on

  /// The output with the largest known errors; nullptr where there is none.
  const OutputErrors* worst() const;
  /// Of the worst output; unknown where that of any output is.
  double total() const;
  bool within(double tolerance) const { return total() <= tolerance; }
};

}  // namespace flexboom
