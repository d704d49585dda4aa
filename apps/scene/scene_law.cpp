#include "apps/scene/scene_law.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>

namespace flexboom {
using toml_reader::Faults;

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
  const auto* const motion = std::ranges::find(law_motions, w[0]);
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
