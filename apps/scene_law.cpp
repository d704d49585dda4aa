#include "apps/scene_law.hpp"

#include "fem/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

namespace flexboom {
namespace {

using toml_reader::Faults;
using toml_reader::TableReader;
using toml_reader::Value;
using toml_writer::toml;

constexpr std::array<std::string_view, 8> law_keys = {"spring",   "damper",     "preload",    "backlash",
                                                      "friction", "lower_stop", "upper_stop", "latch"};

std::vector<double> numbers(TableReader& table, std::string_view key) {
  std::vector<double> result;
  const auto found = table.has(key) ? std::ranges::find(table.value().entries, key, &toml_reader::Entry::first)
                                    : table.value().entries.end();
  bool good = found != table.value().entries.end() && found->second.kind == Value::Kind::array;
  for (size_t i = 0; good && i < found->second.items.size(); ++i) {
    const Value& item = found->second.items[i];
    good = item.kind == Value::Kind::number || item.kind == Value::Kind::integer;
    result.push_back(item.number);
  }
  if (!good) table.fault(key, "must be an array of numbers");
  return result;
}

LawTable read_table(TableReader& parent, std::string_view key, std::string_view over) {
  LawTable t;
  auto table = parent.table(key);
  if (!table) return t;
  t.at = numbers(*table, over), t.load = numbers(*table, "load");
  table->reject_unknown();
  return t;
}

std::optional<StopLaw> read_stop(TableReader& parent, std::string_view key) {
  auto table = parent.table(key);
  if (!table) return {};
  StopLaw s;
  s.at = table->number("at");
  s.stiffness = table->number("stiffness", s.stiffness);
  s.damping = table->number("damping", s.damping);
  if (table->has("restitution")) s.restitution = table->number("restitution");
  table->reject_unknown();
  return s;
}

std::string list(const std::vector<double>& values) {
  std::string text;
  for (const double v : values) text += (text.empty() ? "" : ", ") + toml(v);
  return "[" + text + "]";
}

void write_table(toml_writer::Writer& out, const char* key, const char* over, const LawTable& t) {
  if (!t.at.empty()) out.raw(key, fmt::format("{{ {} = {}, load = {} }}", over, list(t.at), list(t.load)));
}

void write_stop(toml_writer::Writer& out, const char* key, const std::optional<StopLaw>& s) {
  if (!s) return;
  if (s->restitution && s->stiffness == 0 && s->damping == 0)
    out.raw(key, fmt::format("{{ at = {}, restitution = {} }}", toml(s->at), toml(*s->restitution)));
  else
    out.raw(key, fmt::format("{{ at = {}, stiffness = {}, damping = {} }}", toml(s->at), toml(s->stiffness),
                             toml(s->damping)));
}

}  // namespace

bool is_law_key(std::string_view key) { return std::ranges::find(law_keys, key) != law_keys.end(); }

JointLaw read_law(TableReader& table) {
  JointLaw law;
  law.spring = read_table(table, "spring", "at");
  law.damper = read_table(table, "damper", "rate");
  law.preload = table.number("preload", law.preload);
  law.backlash = table.number("backlash", law.backlash);
  if (auto friction = table.table("friction")) {
    law.friction.emplace();
    law.friction->coulomb = friction->number("coulomb");
    law.friction->breakaway = friction->number("breakaway", law.friction->coulomb);
    friction->reject_unknown();
  }
  law.lower_stop = read_stop(table, "lower_stop"), law.upper_stop = read_stop(table, "upper_stop");
  if (auto latch = table.table("latch")) {
    law.latch.emplace();
    law.latch->at = latch->number("at"), law.latch->rate = latch->number("rate");
    latch->reject_unknown();
  }
  return law;
}

void write_law(toml_writer::Writer& out, const JointLaw& law) {
  write_table(out, "spring", "at", law.spring), write_table(out, "damper", "rate", law.damper);
  if (law.preload != 0) out.key("preload", law.preload);
  if (law.backlash != 0) out.key("backlash", law.backlash);
  if (law.friction)
    out.raw("friction", fmt::format("{{ coulomb = {}, breakaway = {} }}", toml(law.friction->coulomb),
                                    toml(law.friction->breakaway)));
  write_stop(out, "lower_stop", law.lower_stop), write_stop(out, "upper_stop", law.upper_stop);
  if (law.latch) out.raw("latch", fmt::format("{{ at = {}, rate = {} }}", toml(law.latch->at), toml(law.latch->rate)));
}

void check_law(Faults& faults, const std::string& path, const Joint& joint, double start) {
  for (const LawFault& f : law_faults(joint)) faults.add(path + "." + f.key, f.text);
  const auto beyond = [&](const std::optional<StopLaw>& stop, int end, const char* key) {
    if (stop && stop->restitution && end * (start - stop->at) > 0)
      faults.add(path + "." + key + ".at",
                 fmt::format("is {}, and the joint starts beyond it, at {}; a rigid stop cannot be pressed in",
                             stop->at, start));
  };
  beyond(joint.law.lower_stop, -1, "lower_stop"), beyond(joint.law.upper_stop, 1, "upper_stop");
}

std::string law_state_text(const LawState& s) {
  const auto flags = [](const std::vector<char>& f) {
    std::string text;
    for (const char c : f) text += c ? '1' : '0';
    return text.empty() ? std::string("-") : text;
  };
  const char* stop = s.rests_at > 0 ? "upper" : s.rests_at < 0 ? "lower" : "-";
  return fmt::format("{} {} {} {} {} {} {}", law_motions[static_cast<size_t>(s.motion)], stop,
                     s.latched ? "latched" : "-", s.past_latch ? "past" : "-", flags(s.beyond), flags(s.pushes),
                     flags(s.faster));
}

LawState law_state_of(const std::string& text) {
  std::istringstream words(text);
  std::array<std::string, 7> w;
  for (std::string& word : w) words >> word;
  const auto motion = std::ranges::find(law_motions, w[0]);
  bool good = !words.fail() && motion != law_motions.end() && (w[1] == "upper" || w[1] == "lower" || w[1] == "-") &&
              (w[2] == "latched" || w[2] == "-") && (w[3] == "past" || w[3] == "-");
  const auto flags = [&](const std::string& word) {
    std::vector<char> f;
    for (const char c : word == "-" ? std::string() : word)
      good = good && (c == '0' || c == '1'), f.push_back(c == '1');
    return f;
  };
  LawState s;
  s.beyond = flags(w[4]), s.pushes = flags(w[5]), s.faster = flags(w[6]);
  require(good && s.beyond.size() == s.pushes.size(), fmt::format("\"{}\" is no state of a law", text));
  s.motion = static_cast<LawState::Motion>(motion - law_motions.begin());
  s.rests_at = w[1] == "upper" ? 1 : w[1] == "lower" ? -1 : 0;
  s.latched = w[2] == "latched", s.past_latch = w[3] == "past";
  return s;
}

}  // namespace flexboom
