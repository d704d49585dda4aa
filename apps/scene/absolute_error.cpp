#include "apps/scene/absolute_error.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

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

}  // namespace flexboom
