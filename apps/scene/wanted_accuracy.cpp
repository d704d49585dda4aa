#include "apps/scene/wanted_accuracy.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

namespace flexboom {

AbsoluteError absolute_error(const std::string& text) {
  AbsoluteError r;
  const char* const end = text.data() + text.size();
  const auto [rest, fault] = std::from_chars(text.data(), end, r.size);
  if (fault == std::errc() && rest != end && *rest == ' ') r.unit.assign(rest + 1, end);
  const bool known = std::ranges::find(output_units, r.unit) != output_units.end();
  require(known && r.size > 0 && std::isfinite(r.size),
          fmt::format("is '{}'; it must be a number above zero, a space and one of {}", text,
                      fmt::join(output_units, ", ")));
  return r;
}

WantedOutput wanted_output(const std::string& text) {
  WantedOutput r;
  const size_t space = std::min(text.find(' '), text.size());
  r.name = text.substr(0, space);
  if (space == text.size()) return r;
  const char* const end = text.data() + text.size();
  const auto [rest, fault] = std::from_chars(text.data() + space + 1, end, r.accuracy);
  bool understood = fault == std::errc() && r.accuracy > 0 && std::isfinite(r.accuracy);
  if (understood && rest != end) {
    understood = *rest == ' ' && rest + 1 != end;
    r.unit.assign(rest + 1, end);
  }
  require(understood, fmt::format("is '{}'; behind an output stands nothing, a relative error above zero, or an error "
                                  "and its unit: \"hub.rotation\", \"hub.rotation 1e-4\", \"hub.rotation 1e-9 rad\"",
                                  text));
  return r;
}

WantedOutput wanted_output(const std::string& text, const std::vector<std::string>& outputs) {
  WantedOutput r = wanted_output(text);
  const std::string_view unit = unit_of(r.name, outputs);
  require(r.unit.empty() || r.unit == unit,
          unit.empty() ? fmt::format("is '{}', but {} is no output that has a unit; give a relative error, or "
                                     "check the name",
                                     text, r.name)
                       : fmt::format("is '{}', but {} is in {}", text, r.name, unit));
  return r;
}

std::string_view unit_of(const std::string& output, const std::vector<std::string>& outputs) {
  static const std::map<std::string, std::string_view> units = {
      {"angle", "rad"},    {"angle1", "rad"}, {"angle2", "rad"}, {"rotation", "rad"}, {"pointing", "rad"},
      {"roll", "rad"},     {"pitch", "rad"},  {"yaw", "rad"},    {"rate", "rad/s"},   {"rate1", "rad/s"},
      {"rate2", "rad/s"},  {"spin", "rad/s"}, {"length", "m"},   {"position", "m"},   {"tip", "m"},
      {"velocity", "m/s"}, {"force", "N"},    {"torque", "N m"}, {"drive", "N m"},    {"drive1", "N m"},
      {"drive2", "N m"}};
  const size_t dot = output.rfind('.');
  const std::string what = output.substr(dot + 1);
  if (what == "rate" || what == "drive") {
    const bool slides = std::ranges::find(outputs, output.substr(0, dot + 1) + "length") != outputs.end();
    if (slides) return what == "rate" ? "m/s" : "N";
  }
  const auto found = units.find(what);
  return found == units.end() ? "" : found->second;
}

bool names_output(const std::vector<std::string>& wanted, const std::string& output) {
  return std::ranges::any_of(wanted, [&](const std::string& text) { return wanted_output(text).name == output; });
}

}  // namespace flexboom
