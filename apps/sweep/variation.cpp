#include "apps/sweep/variation.hpp"

#include "apps/base/usage.hpp"
#include "apps/sweep/indices.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

namespace flexboom {

namespace {

constexpr size_t most_runs = 10'000'000;

/// Not inside of brackets or quotes: "min(t,1)" is one part.
std::vector<std::string> split_at(std::string_view text, char sign) {
  std::vector<std::string> parts(1);
  int depth = 0;
  bool quoted = false;
  for (const char c : text) {
    if (c == '"') quoted = !quoted;
    if (!quoted && std::string_view("([{").find(c) != std::string_view::npos) ++depth;
    if (!quoted && std::string_view(")]}").find(c) != std::string_view::npos) --depth;
    if (c == sign && !quoted && depth <= 0)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

double spec_number(const std::string& of, const std::string& text) {
  const KeyVariant v = text.empty() ? KeyVariant{0, "nothing"} : key_variant(text);
  require_usage(v.word.empty(), fmt::format("--vary {}: '{}' is no number", of, text));
  return v.number;
}

/// lin:a:b:n and log:a:b:n. Both ends are met exactly.
void fill_range(const std::string& of, const std::vector<std::string>& parts, Variation& v) {
  require_usage(parts.size() == 4, fmt::format("--vary {}: is written {}:FIRST:LAST:COUNT", of, parts[0]));
  const double first = spec_number(of, parts[1]), last = spec_number(of, parts[2]), count = spec_number(of, parts[3]);
  require_usage(count >= 2 && count <= static_cast<double>(most_runs) && count == std::trunc(count),
                fmt::format("--vary {}: the count is {}; it must be a whole number from 2", of, parts[3]));
  const bool log = parts[0] == "log";
  require_usage(!log || (first > 0 && last > 0), fmt::format("--vary {}: both ends of log must be positive", of));
  const auto n = static_cast<size_t>(count);
  for (size_t i = 0; i < n; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(n - 1);
    const double x = log ? first * std::pow(last / first, share) : first + share * (last - first);
    v.list.push_back({i == 0 ? first : i + 1 == n ? last : x, {}});
  }
}

void fill_distribution(const std::string& of, const std::vector<std::string>& parts, Variation& v) {
  const bool normal = parts[0] == "normal";
  require_usage(parts.size() == 3, fmt::format("--vary {}: is written {}", of,
                                               normal ? "normal:MEAN:STANDARD_DEVIATION" : "uniform:LOWEST:HIGHEST"));
  v.kind = normal ? Variation::Kind::normal : Variation::Kind::uniform;
  v.a = spec_number(of, parts[1]), v.b = spec_number(of, parts[2]);
  require_usage(normal ? v.b >= 0 : v.a <= v.b,
                fmt::format("--vary {}: {}", of,
                            normal ? "the standard deviation is negative" : "the lowest value is above the highest"));
}

Sampling sampling_of(const SweepDesign& design, bool all_lists) {
  if (design.sample.empty()) return design.indices ? Sampling::sobol : all_lists ? Sampling::grid : Sampling::random;
  const auto* const name = std::find(sampling_names.begin(), sampling_names.end(), design.sample);
  require_usage(name != sampling_names.end(), "--sample " + toml_reader::not_among(design.sample, sampling_names));
  return static_cast<Sampling>(name - sampling_names.begin());
}

/// Values to try a key with.
std::vector<KeyVariant> trial_values(const Variation& v) {
  constexpr size_t enough = 16;
  if (v.kind == Variation::Kind::list)
    return {v.list.begin(), v.list.begin() + static_cast<std::ptrdiff_t>(std::min(enough, v.list.size()))};
  return {v.at(0.5), v.at(0.05), v.at(0.95)};
}

/// Empty where the scene with one of the values can be read, else why not.
std::string why_unreadable(const SceneSource& source, const Variation& v) {
  std::string why;
  for (const KeyVariant& value : trial_values(v)) {
    SceneSource changed = source;
    apply(v, value, changed);  // its faults are those of the path
    try {
      changed.read();
      return "";
    } catch (const InputError& error) {
      if (why.empty()) why = error.what();
    }
  }
  return why;
}

bool lies_below(const std::string& place, const std::string& other) {
  return place.starts_with(other) &&
         (place.size() == other.size() || place[other.size()] == '.' || place[other.size()] == '[');
}

/// A key that the scene lacks has no place: it is itself.
std::vector<std::string> places_or_key(const SceneSource& source, const std::string& key) {
  std::vector<std::string> places = source.places(key);
  if (places.empty()) places.push_back(key);
  return places;
}

void check_none_twice(const SceneSource& source, const std::vector<Variation>& variations) {
  std::map<std::string, std::string> taken;  // key by place
  for (const Variation& v : variations)
    for (const std::string& key : v.keys)
      for (const std::string& place : places_or_key(source, key)) {
        for (const auto& [other, other_key] : taken)
          require(!lies_below(place, other) && !lies_below(other, place),
                  fmt::format("--vary {}: {} is varied already, by {}", v.name, place, other_key));
        taken[place] = key;
      }
}

}  // namespace

KeyVariant Variation::at(double u) const {
  if (kind == Kind::normal) return {a + b * normal_quantile(u), {}};
  if (kind == Kind::uniform) return {a + (b - a) * u, {}};
  return list[std::min(static_cast<size_t>(u * static_cast<double>(list.size())), list.size() - 1)];
}

Variation variation_of(const std::string& text) {
  const size_t sign = text.find('=');
  require_usage(sign != std::string::npos && sign > 0 && sign + 1 < text.size(),
                fmt::format("--vary {}: is written KEY=SPEC, for example hub.mass=8,9,10", text));
  Variation v;
  v.name = text.substr(0, sign);
  std::string keys = v.name;
  v.factor = keys.back() == '*';
  if (v.factor) keys.pop_back();
  v.keys = split_at(keys, ',');
  const std::string spec = text.substr(sign + 1);
  const std::vector<std::string> parts = split_at(spec, ':');
  if (parts[0] == "lin" || parts[0] == "log") {
    fill_range(v.name, parts, v);
  } else if (parts[0] == "normal" || parts[0] == "uniform") {
    fill_distribution(v.name, parts, v);
  } else {
    const std::vector<std::string_view> words = {"lin", "log", "normal", "uniform"};
    require_usage(parts.size() == 1 || toml_reader::nearest(parts[0], words).empty(),
                  fmt::format("--vary {}: {}", v.name, toml_reader::not_among(parts[0], words)));
    for (const std::string& entry : split_at(spec, ',')) v.list.push_back(key_variant(entry));
  }
  for (const KeyVariant& value : v.list)
    require_usage(!v.factor || value.word.empty(), fmt::format("--vary {}: '{}' is no number", v.name, value.word));
  return v;
}

void apply(const Variation& v, const KeyVariant& value, SceneSource& scene) {
  for (const std::string& key : v.keys) v.factor ? scene.multiply(key, value.number) : scene.set(key, value);
}

SweepValues::SweepValues(const SweepDesign& design) {
  require_usage(!design.vary.empty(), "a sweep needs --vary KEY=SPEC");
  for (const std::string& text : design.vary) variations_.push_back(variation_of(text));
  for (size_t i = 0; i < variations_.size(); ++i)
    if (variations_[i].varies()) varying_.push_back(i);
  const auto is_list = [](const Variation& v) { return v.kind == Variation::Kind::list; };
  const bool all_lists = std::all_of(variations_.begin(), variations_.end(), is_list);
  sampling_ = sampling_of(design, all_lists);
  require_usage(!design.indices || sampling_ == Sampling::sobol, "--indices needs --sample sobol");
  if (sampling_ == Sampling::grid) {
    require_usage(all_lists, "--sample grid takes lists only: a,b,c or lin:a:b:n or log:a:b:n; give -n N to draw runs");
    require_usage(!design.n,
                  "-n: a grid has as many runs as its lists have combinations; to draw from the lists, give "
                  "--sample random, lhs or sobol");
    runs_ = 1;
    for (const Variation& v : variations_) {
      require(runs_ <= most_runs / v.list.size(), fmt::format("the grid has more than {} runs", most_runs));
      runs_ *= v.list.size();
    }
    return;
  }
  require_usage(design.n.has_value() && *design.n > 0 && *design.n <= most_runs,
                fmt::format("--sample {} needs the number of runs, -n from 1 to {}",
                            sampling_names[static_cast<size_t>(sampling_)], most_runs));
  const size_t d = design.indices ? varying_.size() : variations_.size();
  require_usage(d > 0, "--indices needs a key that takes more than one value");
  if (design.indices) base_points_ = *design.n;
  runs_ = *design.n * (design.indices ? d + 2 : 1);
  require(runs_ <= most_runs, fmt::format("{} runs are more than {}", runs_, most_runs));
  points_ = std::make_shared<const UnitPoints>(sampling_, design.seed, design.indices ? 2 * d : d, *design.n);
}

std::vector<KeyVariant> SweepValues::of_run(size_t run) const {
  const size_t d = variations_.size();
  std::vector<KeyVariant> values(d);
  if (sampling_ == Sampling::grid) {  // the last list turns fastest
    for (size_t i = d; i > 0; --i) {
      const std::vector<KeyVariant>& list = variations_[i - 1].list;
      values[i - 1] = list[run % list.size()];
      run /= list.size();
    }
    return values;
  }
  if (base_points_ == 0) {
    for (size_t i = 0; i < d; ++i) values[i] = variations_[i].at(points_->at(run, i));
    return values;
  }
  for (size_t i = 0; i < d; ++i)
    if (!variations_[i].varies()) values[i] = variations_[i].list.front();
  const size_t of_point = runs_ / base_points_;
  for (size_t k = 0; k < varying_.size(); ++k) {
    const size_t coordinate = coordinate_of_base_point(varying_.size(), run % of_point, k);
    values[varying_[k]] = variations_[varying_[k]].at(points_->at(run / of_point, coordinate));
  }
  return values;
}

SceneSource with_values(SceneSource scene, const std::vector<Variation>& variations,
                        const std::vector<KeyVariant>& values) {
  for (size_t i = 0; i < variations.size(); ++i) apply(variations[i], values[i], scene);
  return scene;
}

void check_variations(const SceneSource& source, const SweepValues& values) {
  check_none_twice(source, values.variations());
  std::vector<std::string> faults;
  for (const Variation& v : values.variations())
    if (const std::string why = why_unreadable(source, v); !why.empty())
      faults.push_back(fmt::format("--vary {}: {}", v.name, why));
  if (faults.empty()) return;
  try {  // keys that are right only together
    with_values(source, values.variations(), values.of_run(0)).read();
  } catch (const InputError&) {
    throw InputError(faults.front());
  }
}

}  // namespace flexboom
