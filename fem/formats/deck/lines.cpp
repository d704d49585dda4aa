#include "fem/formats/deck/lines.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numeric>

namespace flexboom {
namespace {

namespace fs = std::filesystem;

constexpr size_t deepest_include = 16;
constexpr size_t most_includes = 2000;
constexpr size_t most_included_bytes = size_t{1} << 32;

size_t at_index(int i) { return static_cast<size_t>(i); }

bool contains(std::string_view text, std::string_view part) {
  const std::less_equal<> not_after;
  return part.data() != nullptr && not_after(text.data(), part.data()) &&
         not_after(part.data(), text.data() + text.size());
}

}  // namespace

DeckText::DeckText(std::string_view text, const std::string& file) {
  active_.push_back(&sources_.emplace_back(text, file));
  paths_.emplace_back(file);
}

std::optional<std::string_view> DeckText::peek_line() {
  while (!peeked_ && !active_.empty()) {
    peeked_ = active_.back()->next_line();
    if (peeked_) break;
    active_.pop_back();
    paths_.pop_back();
  }
  return peeked_;
}

void DeckText::include(std::string_view name, std::string_view at) {
  if (name.empty()) fail(at, "the name of the file to include is missing");
  if (active_.size() > deepest_include) fail(at, fmt::format("files are included more than {} deep", deepest_include));
  if (sources_.size() > most_includes) fail(at, fmt::format("more than {} files are included", most_includes));
  const TextReader& source = source_of(at);
  const fs::path path = fs::path(source.file()).parent_path() / fs::path(std::string(name));
  std::error_code code;
  if (!fs::exists(path, code)) fail(at, fmt::format("the file to include is missing: {}", path.string()));
  if (!fs::is_regular_file(path, code)) fail(at, fmt::format("what is to be included is no file: {}", path.string()));
  for (const fs::path& open : paths_) {
    if (fs::equivalent(path, open, code)) fail(at, fmt::format("{} includes itself", path.string()));
  }
  included_bytes_ += fs::file_size(path, code);
  if (included_bytes_ > most_included_bytes) fail(at, "more than 4 GiB are included");
  try {
    texts_.push_back(file_bytes(path));
  } catch (const InputError& error) {
    fail(at, error.what());
  }
  active_.push_back(&sources_.emplace_back(texts_.back(), path.string()));
  paths_.push_back(path);
}

const TextReader& DeckText::source_of(std::string_view at) const {
  for (const TextReader& source : sources_) {
    if (contains(source.text(), at)) return source;
  }
  return sources_.front();
}

std::string DeckText::line_location(std::string_view at) const {
  const TextReader& source = source_of(at);
  return fmt::format("{}:{}", source.file(), source.line_of(at));
}

long DeckText::integer(std::string_view field, std::string_view what) const {
  if (const std::optional<long> value = to_integer(field)) return *value;
  if (field.empty()) fail(field, fmt::format("{} is missing", what));
  fail(field, fmt::format("{} is not a whole number: {}", what, quoted(field)));
}

long DeckText::integer(std::string_view field, std::string_view what, long low, long high) const {
  const long value = integer(field, what);
  if (value < low || value > high) fail(field, fmt::format("{} is {}; it must be {} to {}", what, value, low, high));
  return value;
}

void DeckNodes::add(long label, const Eigen::Vector3d& position, std::string_view at) {
  labels_.push_back(label);
  positions_.push_back(position);
  at_.push_back(at);
}

void DeckNodes::finish(const DeckText& text) {
  index_ = LabelIndex(labels_);
  if (!index_.duplicate()) return;
  std::vector<int> order(labels_.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [this](int i) { return labels_[at_index(i)]; });
  std::vector<char> again(labels_.size(), 0);
  for (size_t i = 1; i < order.size(); ++i) {
    const size_t one = at_index(order[i - 1]), two = at_index(order[i]);
    if (labels_[one] != labels_[two]) continue;
    if (positions_[one] != positions_[two])
      text.fail(at_[two], fmt::format("node {} is already at another place ({})", std::abs(labels_[two]),
                                      text.line_location(at_[one])));
    again[two] = 1;
  }
  size_t kept = 0;
  for (size_t i = 0; i < labels_.size(); ++i) {
    if (again[i]) continue;
    labels_[kept] = labels_[i];
    positions_[kept] = positions_[i];
    at_[kept++] = at_[i];
  }
  labels_.resize(kept);
  positions_.resize(kept);
  at_.resize(kept);
  index_ = LabelIndex(labels_);
}

Eigen::Matrix3Xd DeckNodes::positions() const {
  Eigen::Matrix3Xd result(3, count());
  for (int node = 0; node < count(); ++node) result.col(node) = position(node);
  return result;
}

std::string upper_key(std::string_view text) {
  std::string key;
  for (const char c : text) {
    if (c == ' ' || (c >= '\t' && c <= '\r')) continue;
    key += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return key;
}

void split_at_commas(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (line = trimmed(line); !line.empty();) {
    const size_t comma = std::min(line.find(','), line.size());
    fields.push_back(trimmed(line.substr(0, comma)));
    line.remove_prefix(std::min(comma + 1, line.size()));
    line = trimmed(line);
  }
}

std::string_view unquoted(std::string_view text) {
  text = trimmed(text);
  const bool in_quotes =
      text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front();
  return in_quotes ? text.substr(1, text.size() - 2) : text;
}

}  // namespace flexboom
