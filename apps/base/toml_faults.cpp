#include "apps/base/toml_faults.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <tuple>

namespace flexboom::toml_reader {
namespace {

std::string parent(const std::string& path) {
  const size_t cut = path.find_last_of(".[");
  return cut == std::string::npos ? "" : path.substr(0, cut);
}

// Whether b is a or lies below it.
bool holds(const std::string& a, const std::string& b) {
  if (!b.starts_with(a)) return false;
  return a.empty() || b.size() == a.size() || b[a.size()] == '.' || b[a.size()] == '[';
}

}  // namespace

void Faults::locate(const std::string& path, const Place& place) { places_[path] = place; }

Place Faults::place_of(std::string path) const {
  for (;; path = parent(path)) {
    const auto place = places_.find(path);
    if (place != places_.end()) return place->second;
    if (path.empty()) return {};
  }
}

void Faults::add(const std::string& path, const std::string& text) { add(path, place_of(path), text); }

void Faults::add(const std::string& path, const Place& place, const std::string& text) {
  const auto covers = [&path](const Fault& fault) { return !fault.path.empty() && holds(fault.path, path); };
  if (std::none_of(faults_.begin(), faults_.end(), covers)) faults_.push_back({place, path, text});
}

void Faults::append(const std::string& path, const std::string& text) {
  const auto fault = std::ranges::find(faults_, path, &Fault::path);
  if (fault != faults_.end()) fault->text += text;
}

bool Faults::clean(const std::string& path) const {
  return std::none_of(faults_.begin(), faults_.end(), [&path](const Fault& fault) {
    return holds(path, fault.path) || (!fault.path.empty() && holds(fault.path, path));
  });
}

void Faults::throw_if_any() const {
  if (faults_.empty()) return;
  std::vector<Fault> sorted = faults_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Fault& a, const Fault& b) {
    return std::tie(a.place.file, a.place.line, a.place.column) < std::tie(b.place.file, b.place.line, b.place.column);
  });
  std::vector<std::string> lines;
  lines.reserve(sorted.size());
  for (const Fault& fault : sorted) {
    lines.push_back(where(fault.place) + (fault.path.empty() ? "" : fault.path + ": ") + fault.text);
  }
  throw InputError(fmt::format("{}", fmt::join(lines, "\n")));
}

void Faults::note_key(const std::string& path) {
  if (!keys_) return;
  std::string of_any;  // without the numbers of arrays
  for (size_t i = 0; i < path.size(); ++i) {
    of_any += path[i];
    if (path[i] == '[') i = path.find(']', i) - 1;
  }
  keys_->insert(of_any);
}

}  // namespace flexboom::toml_reader
