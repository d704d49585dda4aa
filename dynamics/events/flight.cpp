#include "dynamics/events/flight.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace flexboom {

namespace {

constexpr double same_time = 1e-12;  // relative: times this close are one

}  // namespace

void ChatterGuard::contact(double t, const std::string& name) {
  constexpr int most = 1000;
  in_a_row_ = std::abs(t - last_) <= same_time * std::abs(t) ? in_a_row_ + 1 : 0;
  last_ = t;
  if (in_a_row_ < most) return;
  throw NumericalError(
      fmt::format("\"{}\" chatters: {} contacts at t = {:.9g} s without time passing; is its stop, or "
                  "what presses against it, of a size that can be computed with?",
                  name, in_a_row_, t));
}

void check_options(const FlightOptions& o, std::size_t stops) {
  require(o.tolerance > 0 && o.tolerance <= 0.1, fmt::format("tolerance {:g} must lie in (0, 0.1]", o.tolerance));
  require(o.duration > 0 && std::isfinite(o.duration), fmt::format("duration {:g} s must be positive", o.duration));
  require(o.start >= 0 && o.start < o.duration * (1 - same_time),
          fmt::format("start {:g} s must lie before the end of the flight at {:g} s", o.start, o.duration));
  require(o.output_step > 0, fmt::format("output step {:g} s must be positive", o.output_step));
  const std::vector<double>& looks = o.close_looks.at;
  const double length = static_cast<double>(o.close_looks.count - 1) * o.close_looks.step;
  for (size_t i = 0; i < looks.size(); ++i)
    require(looks[i] >= o.start && looks[i] + length < (i + 1 < looks.size() ? looks[i + 1] : o.duration),
            fmt::format("a row of outputs from {:g} s to {:g} s does not end before the next one, or the flight",
                        looks[i], looks[i] + length));
  require((o.duration - o.start) / o.output_step <= 1e6,
          fmt::format("{:.3g} output times are too many; choose a longer output step",
                      (o.duration - o.start) / o.output_step));
  require(o.stops.empty() || o.stops.size() == stops,
          fmt::format("{} stops have no {} histories", stops, o.stops.size()));
}

std::vector<StopHistory> stops_at_start(const FlightOptions& o, std::size_t stops) {
  return o.stops.empty() ? std::vector<StopHistory>(stops) : o.stops;
}

OutputTimes::OutputTimes(const FlightOptions& o)
    : start_(o.start),
      step_(o.output_step),
      end_(o.duration),
      before_(std::floor(o.start / o.output_step * (1 + same_time))),
      looks_(o.close_looks) {}

double OutputTimes::close_look(std::size_t number) const {
  const bool starts_before = looks_.at.front() > start_;
  if (starts_before && number == 0) return start_;
  number -= starts_before;
  const size_t row = number / looks_.count, of_row = number % looks_.count;
  if (row < looks_.at.size()) return looks_.at[row] + static_cast<double>(of_row) * looks_.step;
  return number == looks_.at.size() * looks_.count ? end_ : std::numeric_limits<double>::infinity();
}

double OutputTimes::after(std::size_t count) const {
  if (!looks_.at.empty()) return close_look(count);
  if (count == 0) return start_;
  const double last = end_ * (1 - same_time), multiple = before_ + static_cast<double>(count);
  if (multiple * step_ < last) return multiple * step_;
  const bool ended = count > 1 && (multiple - 1) * step_ >= last;
  return ended ? std::numeric_limits<double>::infinity() : end_;
}

}  // namespace flexboom
