#include "apps/model/reduce_arguments.hpp"

#include "apps/base/axis.hpp"
#include "apps/base/usage.hpp"
#include "fem/base/check.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/basis/mode_selection.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace flexboom {
namespace {

/// "head:tail", or the whole and nothing.
std::pair<std::string, std::string> split(const std::string& text, char at) {
  const size_t place = text.find(at);
  return place == std::string::npos ? std::pair{text, std::string()}
                                    : std::pair{text.substr(0, place), text.substr(place + 1)};
}

/// Numbers between commas. @throws InputError naming the option.
std::vector<double> numbers(const std::string& option, const std::string& text) {
  const std::optional<std::vector<double>> values = to_reals(text);
  require_usage(values.has_value(), fmt::format("{}: '{}' is not a number, or numbers between commas", option, text));
  return *values;
}

void check_options(const ReduceArguments& a, const BasisOptions& basis) {
  const auto belongs = [&basis](bool given, const char* option, const char* name) {
    require(!given || basis.name == name, fmt::format("{}: is for --basis {}", option, name));
  };
  belongs(!a.interfaces.empty(), "--interface", "craig-bampton");
  belongs(!a.reference.empty(), "--reference", "craig-bampton");
  belongs(a.orthonormal, "--orthonormal", "craig-bampton");
  belongs(!a.hinge_stiffness.empty(), "--hinge-stiffness", "hinge");
  belongs(!a.spin.empty(), "--spin", "prestressed");
  belongs(!a.acceleration.empty(), "--acceleration", "prestressed");
  belongs(!a.turns.empty(), "--turns", "prestressed");
  require(basis.name != "prestressed" || basis.motion,
          "--basis prestressed: give the motion that stiffens the body with --spin X,Y,Z [rad/s] or "
          "--acceleration X,Y,Z [m/s^2]");
  require(basis.name != "craig-bampton" || !basis.interfaces.empty(),
          "--basis craig-bampton: name the places where the body is joined with --interface SET");
  require(basis.name != "hinge" || !basis.hinge_stiffness.empty(),
          "--basis hinge: give the stiffness of the hinge with --hinge-stiffness K1,K2 [N m/rad]");
  require(basis.name != "mean-axis" || !a.options.clamp, "--clamp: a body under mean axes is not held anywhere");
  require(a.stiffening || a.loads_at.empty(), "--loads-at: loads stiffen nothing with --no-stiffening");
  require(std::set(a.loads_at.begin(), a.loads_at.end()).size() == a.loads_at.size(), "--loads-at: a set comes twice");
  require(!a.count || *a.count >= 0, fmt::format("--count: must not be negative, got {}", a.count.value_or(0)));
}

Eigen::Vector3d vector_of(const std::vector<double>& three) {
  return three.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(three[0], three[1], three[2]);
}

/// The motion of the command line; what it leaves open is that of the body file, or none.
SteadyMotion steady_motion(const ReduceArguments& a, const std::optional<SteadyMotion>& of_file) {
  SteadyMotion motion = of_file.value_or(SteadyMotion{});
  if (!a.spin.empty()) motion.spin = vector_of(a.spin);
  if (!a.acceleration.empty()) motion.acceleration = vector_of(a.acceleration);
  if (!a.turns.empty()) motion.turns.clear();
  for (const std::string& text : a.turns) {
    const auto axis = axis_of(text);
    require_usage(axis.has_value(),
                  fmt::format("--turns: '{}' is no axis; there are x, y, z, and X,Y,Z of a direction", text));
    motion.turns.push_back(*axis);
  }
  return motion;
}

/// The basis of the command line; what it leaves open is that of the body file.
BasisOptions basis_options(const ReduceArguments& a, const Model& model) {
  BasisOptions o;
  if (!a.basis || *a.basis == model.basis.name) o = model.basis;
  if (a.basis) o.name = *a.basis;
  if (!a.interfaces.empty()) o.interfaces = a.interfaces, o.reference = a.reference;
  if (!a.reference.empty()) o.reference = a.reference;
  o.orthonormal = o.orthonormal || a.orthonormal;
  if (!a.attachments.empty()) o.corrections = a.attachments;
  if (!a.hinge_stiffness.empty()) o.hinge_stiffness = a.hinge_stiffness;
  if (!a.hinge_axis.empty()) o.hinge_axis = vector_of(a.hinge_axis);
  if (!a.spin.empty() || !a.acceleration.empty() || !a.turns.empty()) o.motion = steady_motion(a, o.motion);
  const bool all = model.body && model.body->directions == "all";
  const bool is_asked_for_plane = model.body && model.body->directions_given;  // else all count, but those of a hinge
  o.in_plane = !all && (o.name == "hinge" || is_asked_for_plane);
  o.modes = a.count.value_or(o.name == "hinge" ? 1 : model.modes.value_or(10));
  o.backend = a.backend.value_or(model.backend.value_or("auto"));
  return o;
}

}  // namespace

std::vector<int> selection(const ReducedBody& body, const std::string& text) {
  const auto [rule, rest] = split(text, ':');
  if (rule == "output") {
    const auto [place, share] = split(rest, ',');
    const auto [marker, direction] = place_and_direction("--select output", place);
    return modes_by_observability(body, {{marker, direction}}, numbers("--select output", share).front());
  }
  const std::vector<double> values = numbers("--select", rest);
  if (rule == "list") {
    std::vector<int> list;
    for (const double v : values) {
      require(v == std::floor(v) && v >= 1 && v <= body.n(),
              fmt::format("--select list: {} is not the number of a coordinate; they are 1 to {}", v, body.n()));
      list.push_back(static_cast<int>(v) - 1);
    }
    return listed_modes(body, list);
  }
  if (rule == "band" && values.size() == 2) {
    const std::vector<int> chosen = modes_in_band(body, values[0], values[1]);
    require(!chosen.empty(),
            fmt::format("--select band: none of the {} modes lies between {} and {} Hz; make more modes "
                        "(--count)",
                        body.n(), values[0], values[1]));
    return chosen;
  }
  if (rule == "mass" && values.size() == 1) return modes_by_effective_mass(body, values[0], {0, 1, 2});
  if (rule == "completeness" && values.size() == 1) return modes_by_completeness(body, values[0]);
  throw UsageError(
      fmt::format("--select: '{}' is not understood; there are list:1,3 band:LOW,HIGH mass:SHARE "
                  "completeness:SHARE output:SET.uy,SHARE",
                  text));
}

std::string note_of_selection(const ReducedBody& body, const std::string& text) {
  const auto [rule, rest] = split(text, ':');
  if (rule != "band") return "";
  const double wanted = numbers("--select", rest).back();
  double highest = 0;
  for (const Coordinate& c : body.coordinates) highest = std::max(highest, c.frequency_hz);
  return highest >= wanted ? ""
                           : fmt::format(
                                 "--select band: the modes computed end at {:.6g} Hz; what lies between that and "
                                 "{:.6g} Hz is not kept (--count computes more)",
                                 highest, wanted);
}

DampingRule parse_damping(const std::string& text) {
  const auto [rule, rest] = split(text, ':');
  if (rule == "none" && rest.empty()) return {};
  const std::vector<double> values = rest.empty() ? std::vector<double>{} : numbers("--damping", rest);
  if ((rule == "modal" || rule == "loss-factor") && values.size() == 1) return {rule, values[0], 0, 0};
  if (rule == "rayleigh" && values.size() == 2) return {rule, 0, values[0], values[1]};
  throw UsageError(fmt::format(
      "--damping: '{}' is not understood; there are none, modal:ZETA, loss-factor:ETA, rayleigh:ALPHA,BETA", text));
}

ReductionOptions reduction_options(const ReduceArguments& a, const Model& model) {
  ReductionOptions o;
  o.basis = basis_options(a, model);
  check_options(a, o.basis);
  o.clamp_beside = a.options.clamp.has_value();
  o.select = a.select;
  if (const bool of_file = !a.select && !a.count && !a.basis; of_file && model.body && !model.body->shapes.empty())
    o.select = fmt::format("list:{}", fmt::join(model.body->shapes, ","));
  o.damping = a.damping ? parse_damping(*a.damping) : model.damping;
  o.stiffening = a.stiffening;
  o.loads_at = a.loads_at;
  o.source = a.model;
  return o;
}

}  // namespace flexboom
