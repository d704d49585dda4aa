#include "apps/accuracy/output_errors.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Is it an angle of the attitude against the orbit's frame?
bool is_of_lvlh(const std::string& output) { return output.starts_with("lvlh."); }

/// How it is wanted, if it is.
std::optional<WantedOutput> wanted_as(const std::string& output, const std::vector<WantedOutput>& wanted) {
  if (output == "t" || output.starts_with("energy.")) return {};
  if (wanted.empty()) return is_of_lvlh(output) ? std::nullopt : std::optional(WantedOutput{output});
  const auto found = std::ranges::find(wanted, output, &WantedOutput::name);
  return found == wanted.end() ? std::nullopt : std::optional(*found);
}

/// Angle of the rotation that leads from one rotation vector to another: their difference jumps where the angle passes
/// pi.
double angle_between(const Vector3d& a, const Vector3d& b) {
  return rotation_vector(quaternion_product(quaternion_of(-a), quaternion_of(b))).norm();
}

/// Of two values of an output.
double distance_of(const std::string& output, const VectorXd& a, const VectorXd& b) {
  if (output.ends_with(".rotation")) return angle_between(a, b);
  if (is_of_lvlh(output)) return std::abs(std::remainder(a[0] - b[0], 2 * std::numbers::pi));
  return (a - b).norm();
}

using ColumnPlaces = std::vector<Index>;

VectorXd values_at(const OutputTable& table, Index row, const ColumnPlaces& columns) {
  VectorXd r(std::ssize(columns));
  for (size_t k = 0; k < columns.size(); ++k) r[static_cast<Index>(k)] = table.values(row, columns[k]);
  return r;
}

/// The largest value of each unit, over all outputs of a table; of "J" the largest kinetic energy.
std::map<std::string_view, double> largest_of_units(const OutputTable& table) {
  std::map<std::string_view, double> r;
  for (size_t i = 0; i < table.names.size(); ++i) {
    const std::string_view unit =
        table.names[i] == "energy.kinetic" ? "J" : unit_of(output_of_column(table.names[i]), table.names);
    if (unit.empty() || table.values.rows() == 0) continue;
    r[unit] = std::max(r[unit], table.values.col(static_cast<Index>(i)).cwiseAbs().maxCoeff());
  }
  return r;
}

/// An error of this size is no more than round-off, or does not count. `size`: of the output in both tables.
double bearable(const WantedOutput& as, std::string_view unit, double size_of_output, const OutputFloors& floors,
                const std::map<std::string_view, double>& all) {
  const auto largest_in = [&all](std::string_view of_unit) {
    const auto found = all.find(of_unit);
    return found == all.end() ? 0.0 : found->second;
  };
  constexpr double fastest = 100;  // [rad/s]: not all of the energy turns what is small
  double natural = largest_in(unit);
  if (unit == "rad") natural = std::max(natural, 1.0);
  if (unit == "m") natural = std::max(natural, floors.length);
  if (unit == "m/s") natural = std::max(natural, floors.length * largest_in("rad/s"));
  if (unit == "rad/s" && floors.inertia > 0)
    natural = std::max(natural, std::min(fastest, std::sqrt(2 * largest_in("J") / floors.inertia)));
  if (unit == "N m") natural = std::max(natural, floors.length * largest_in("N"));
  // Static shapes and modes that are nearly alike make more of round-off, and what is zero by symmetry is only that.
  constexpr double round_off = 1e-14, of_zero = 1e-11;
  const bool is_zero = as.accuracy == 0 && size_of_output <= of_zero * natural;
  double size = (is_zero ? of_zero : round_off) * natural;
  for (const AbsoluteError& a : floors.absolute)
    if (a.unit == unit) size = std::max(size, a.size);
  return size;
}

}  // namespace

std::vector<OutputDifference> compare_outputs(const OutputTable& a, const OutputTable& b,
                                              const std::vector<std::string>& wanted, const OutputFloors& floors) {
  std::vector<WantedOutput> asked, order;
  for (const std::string& text : wanted) asked.push_back(wanted_output(text));
  std::map<std::string, std::pair<ColumnPlaces, ColumnPlaces>> columns;
  Index time = -1;
  for (size_t i = 0; i < a.names.size(); ++i) {
    if (a.names[i] == "t") time = static_cast<Index>(i);
    const auto j = std::find(b.names.begin(), b.names.end(), a.names[i]);
    const std::string output = output_of_column(a.names[i]);
    const std::optional<WantedOutput> as = wanted_as(output, asked);
    if (j == b.names.end() || !as) continue;
    if (!columns.contains(output)) order.push_back(*as);
    columns[output].first.push_back(static_cast<Index>(i));
    columns[output].second.push_back(j - b.names.begin());
  }
  const std::map<std::string_view, double> all = largest_of_units(b);
  const Index rows = std::min(a.values.rows(), b.values.rows());
  std::vector<OutputDifference> result;
  for (const WantedOutput& as : order) {
    const std::string& output = as.name;
    const auto& [of_a, of_b] = columns[output];
    OutputDifference d;
    d.name = output;
    double difference = 0, size_of_a = 0;
    for (Index row = 0; row < rows; ++row) {
      const VectorXd u = values_at(a, row, of_a), v = values_at(b, row, of_b);
      const double here = distance_of(output, u, v);
      d.size = std::max(d.size, v.norm()), size_of_a = std::max(size_of_a, u.norm());
      if (here > difference) difference = here, d.time = time < 0 ? 0 : a.values(row, time);
    }
    d.scale = d.size;
    if (as.accuracy > 0) d.scale = (as.unit.empty() ? as.accuracy * d.size : as.accuracy) / floors.tolerance;
    d.scale = std::max(
        d.scale, bearable(as, unit_of(output, b.names), std::max(d.size, size_of_a), floors, all) / floors.tolerance);
    d.error = d.scale > 0 ? difference / d.scale : difference;
    result.push_back(d);
  }
  return result;
}

double largest(const std::vector<OutputDifference>& differences) {
  double r = 0;
  for (const OutputDifference& d : differences) r = std::max(r, d.error);
  return r;
}

std::pair<std::string_view, double> ErrorParts::largest_part() const {
  std::pair<std::string_view, double> most;
  for (const auto& [name, part] : error_parts)
    if (this->*part > most.second) most = {name, this->*part};
  return most;
}

std::string description(const OutputErrors& o) {
  const std::string_view most = o.largest_part().first;
  return fmt::format("{} at t = {:.6g} s{}", o.name, o.when, most.empty() ? "" : fmt::format(", most of it {}", most));
}

double OutputErrors::known() const {
  OutputErrors o = *this;
  for (const auto& [title, part] : error_parts)
    if (std::isnan(o.*part)) o.*part = 0;
  return o.total();
}

const OutputErrors* ErrorBudget::worst() const {
  const auto most = std::ranges::max_element(outputs, {}, &OutputErrors::known);
  return most == outputs.end() ? nullptr : &*most;
}

double ErrorBudget::total() const {
  if (outputs.empty()) return discretisation + truncation + time + linearisation;
  const bool all_known = std::ranges::none_of(outputs, [](const OutputErrors& o) { return std::isnan(o.total()); });
  return all_known ? worst()->total() : unknown;
}

namespace {

/// About the mass centre.
double least_inertia(const ReducedBody& body) {
  const Eigen::Matrix3d about_centre = body.J0 - centre_inertia(body.m, body.mc0);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(about_centre, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

}  // namespace

OutputFloors floors_of(const Scene& scene, const std::vector<PreparedBody>& bodies) {
  OutputFloors floors{scene.tolerance};
  for (const PreparedBody& p : bodies)  // the largest radius of gyration: what lengths of the scene are like
    floors.length = std::max(floors.length, std::sqrt(p.body.J0.trace() / p.body.m));
  for (const PreparedBody& p : bodies) {
    const double least = p.body.n() == 0 ? least_inertia(p.body) : 0;
    const bool is_round_off = !(least > 1e-9 * p.body.J0.trace());
    if (!is_round_off && !(floors.inertia > 0 && floors.inertia <= least)) floors.inertia = least;
  }
  for (const std::string& text : scene.absolute) floors.absolute.push_back(absolute_error(text));
  return floors;
}

}  // namespace flexboom
