#include "apps/accuracy/repeats.hpp"

#include "apps/accuracy/variants.hpp"
#include "apps/simulate/flights_ahead.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace flexboom {

bool has(const BodyScene& b, Richer richer) { return b.richer && ((*b.richer).*richer).has_value(); }

bool any_elastic(const Scene& scene, std::string_view structure) {
  return std::ranges::any_of(scene.bodies, [&](const BodyScene& b) {
    return b.is_flexible() && (structure.empty() || b.structure == structure);
  });
}

void require_richer(const Scene& scene, Richer richer, std::string_view what) {
  for (const BodyScene& b : scene.bodies) {
    const bool is_exact = richer == &RicherBodies::finer_elements && b.structure == "eq14";
    if (b.reduced && b.reduced->structure != "rigid" && !is_exact && !has(b, richer))
      throw InputError(fmt::format("body {} was reduced before, and its file has no {}", b.name, what));
  }
}

Run Repeats::repeated(const Run& run, const Scene& other, int refine) const {
  Run again = fly(other, hooks, refine, bearable_steps(run));
  if (again.motion.summary.interrupted) throw NumericalError("interrupted");
  return again;
}

std::vector<OutputDifference> Repeats::difference(const OutputTable& a, const OutputTable& b,
                                                  const Scene& scene) const {
  return compare_outputs(without_coordinates(a), without_coordinates(b), scene.outputs, floors);
}

std::vector<OutputDifference> Repeats::difference(const Run& run, const Run& other, const Scene& scene) const {
  return difference(run.outputs, other.outputs, scene);
}

bool Repeats::may_be_of_time(double differences, double time_error) const {
  constexpr double counts = 1.0 / 3, beyond_doubt = 100, far_larger = 30;
  const double of_tolerance = differences / floors.tolerance;
  return of_tolerance > counts && of_tolerance < beyond_doubt && !(differences > far_larger * time_error);
}

std::vector<OutputDifference> Repeats::change(
    const Run& run, const Scene& other, double time_error, int refine,
    const std::function<bool(const std::vector<OutputDifference>&)>& borne) const {
  std::vector<OutputDifference> differences = difference(run, repeated(run, other, refine), other);
  if (!may_be_of_time(largest(differences), time_error) || hooks.stopped()) return differences;
  if (borne && borne(differences)) return differences;
  return difference(run, repeated(run, with_a_digit_more(other), refine), other);
}

void add(std::vector<OutputDifference>& sum, const std::vector<OutputDifference>& more) {
  if (sum.empty()) {
    sum = more;
    return;
  }
  for (OutputDifference& d : sum) {
    const auto other = std::ranges::find(more, d.name, &OutputDifference::name);
    if (other == more.end()) continue;
    if (other->error > d.error) d.time = other->time;
    d.error += other->error;
  }
}

double Measuring::measured(std::string_view part, const std::function<double()>& repeat) {
  if (repeats.hooks.stopped()) return unknown;
  try {
    return repeat();
  } catch (const std::runtime_error& e) {
    missing(part, e.what());
    return unknown;
  }
}

void Measuring::missing(std::string_view part, std::string_view why) {
  budget.missing.push_back(fmt::format("{} not measured: {}", part, why));
}

double Measuring::enter(double OutputErrors::*part, const Finding& finding,
                        const std::function<double(const OutputErrors&)>& more) {
  double most = 0;
  for (OutputErrors& o : budget.outputs) {
    const auto d = std::ranges::find(finding.differences, o.name, &OutputDifference::name);
    const bool is_known = d != finding.differences.end();
    const double error = is_known ? finding.factor * d->error : 0, before = o.largest_part().second;
    if (is_known) o.scale = std::max(o.scale, d->scale), o.size = std::max(o.size, d->size);
    o.*part = error + (o.scale > 0 && more ? more(o) / o.scale : 0);
    if (error > before) o.when = d->time;
    most = std::max(most, o.*part);
  }
  return most;
}

}  // namespace flexboom
