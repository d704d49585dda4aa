#include "fem/formats/gmsh/source.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace flexboom {

template <class Number>
Number GmshSource::binary(std::string_view what) {
  last_ = reader_.position();
  if (reader_.bytes_left() < sizeof(Number)) fail(fmt::format("the file ends where {} should be", what));
  std::array<char, sizeof(Number)> bytes;
  std::memcpy(bytes.data(), reader_.text().data() + last_, sizeof(Number));
  if (swapped_) std::ranges::reverse(bytes);
  reader_.seek(last_ + sizeof(Number));
  Number value;
  std::memcpy(&value, bytes.data(), sizeof(Number));
  return value;
}

int GmshSource::integer(std::string_view what) {
  constexpr long highest = std::numeric_limits<int>::max();
  if (!binary_) return static_cast<int>(reader_.integer(what, -highest, highest));
  const auto value = binary<std::int32_t>(what);
  if (value < -highest) fail(fmt::format("{} is {}, which cannot be", what, value));
  return value;
}

double GmshSource::real(std::string_view what) {
  if (!binary_) return reader_.real(what);
  const auto value = binary<double>(what);
  if (!std::isfinite(value)) fail(fmt::format("{} is not a finite number", what));
  return value;
}

long GmshSource::size(std::string_view what) {
  constexpr long highest = std::numeric_limits<long>::max();
  if (!binary_) return reader_.integer(what, 0, highest);
  const auto value = binary<std::uint64_t>(what);
  if (value > static_cast<std::uint64_t>(highest)) fail(fmt::format("{} is {}, which cannot be", what, value));
  return static_cast<long>(value);
}

size_t GmshSource::count(std::string_view what, size_t numbers) { return check_count(what, size(what), numbers); }

size_t GmshSource::check_count(std::string_view what, long count, size_t numbers) {
  const size_t least = numbers * (binary_ ? sizeof(int) : 2);  // a digit and a space
  if (count >= 0 && static_cast<size_t>(count) <= (reader_.bytes_left() + 1) / least) return static_cast<size_t>(count);
  fail(fmt::format("{} is {}; the {} bytes that follow cannot hold that", what, count, reader_.bytes_left()));
}

void GmshSource::skip_integers(size_t count) {
  for (size_t i = 0; i < count; ++i) integer("an entity or partition");
}

void GmshSource::skip_reals(size_t count) {
  for (size_t i = 0; i < count; ++i) real("a coordinate");
}

void GmshSource::fail(const std::string& message) const {
  if (binary_) throw InputError(fmt::format("{}: byte {}: {}", reader_.file(), last_, message));
  const size_t end = std::min(reader_.position(), reader_.text().size());
  const size_t before = reader_.text().substr(0, end).find_last_of(" \t\n");
  reader_.fail(reader_.text().substr(before + 1), message);
}

}  // namespace flexboom
