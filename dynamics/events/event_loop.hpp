#pragma once

#include "dynamics/events/contacts.hpp"
#include "dynamics/events/laws.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace flexboom {

/// One run: the loop around a method, whatever the coordinates. A motion says how it steps, what it records and where
/// its stops are; the loop says when. Result: time, events and summary, and rows that the motion records.
template <class Result>
class Flight : protected StopMotion, protected LawMotion {
 public:
  Flight(const FlightOptions& options, const Checkpoint<Result>& so_far, std::vector<Stop> stops, std::size_t joints,
         Laws laws = {})
      : options_(options),
        contacts_(std::move(stops), options, joints),
        laws_(std::move(laws)),
        outputs_(options),
        t_(options.start),
        so_far_(so_far) {}

  /// @throws NumericalError when the method fails, InputError where a function of time has no value; what was flown
  /// until then was told to the checkpoint.
  Result fly() {
    record(t_, y_);
    checkpoint();
    try {
      restart();
      while (t_ < options_.duration && !stopped()) {
        advance();
        if (since_checkpoint_.seconds() >= options_.checkpoint_every && t_ < options_.duration) checkpoint();
      }
    } catch (const std::exception&) {
      try {
        checkpoint();
      } catch (const std::exception&) {  // the first failure is the one to tell
      }
      throw;
    }
    close();
    return std::move(result_);
  }

 protected:
  /// The method begins at t_ and y_, with contacts_ and laws_ as they are.
  virtual void restart() = 0;
  /// One step to t and y, not beyond `limit`, and what contacts_.crossed() and laws_.crossed() it ended at. Where it
  /// throws, t_ and y_ stay.
  virtual void step(double limit, double& t, Eigen::VectorXd& y) = 0;
  /// States within the last step, a column each; Y may have more columns.
  virtual void interpolate(std::span<const double> times, Eigen::MatrixXd& Y) = 0;
  /// Adds a row to the result.
  virtual void record(double t, Eigen::VectorXd y) = 0;
  /// Forgets all rows but the first.
  virtual void keep_rows(std::size_t rows) = 0;
  /// Fills in the summary of what was recorded.
  virtual void finish() = 0;
  /// The state that a step arrived at: what errors are weighed by.
  virtual void observe(const Eigen::VectorXd& y) = 0;

  double output_time() const { return outputs_.after(result_.time.size()); }

  bool stopped() {
    const bool stop = options_.interrupt != nullptr && options_.interrupt->load(std::memory_order_relaxed);
    result_.summary.interrupted = result_.summary.interrupted || stop;
    return stop;
  }

  long steps() const { return steps_; }
  double seconds() const { return watch_.seconds(); }

  const FlightOptions& options_;
  Contacts contacts_;
  Laws laws_;
  OutputTimes outputs_;
  double t_;
  Eigen::VectorXd y_;
  Result result_;

 private:
  void advance() {
    const double from = t_;
    double t = t_;
    next_y_ = y_;
    step(limit(), t, next_y_);
    if (++steps_ > options_.max_steps)
      throw NumericalError(
          fmt::format("{} steps were not enough: t = {:.9g} s of {:g} s", steps_, t, options_.duration));
    if (!next_y_.allFinite()) throw NumericalError(fmt::format("the state is not finite at t = {:.9g} s", t));
    t_ = t, y_.swap(next_y_);
    const std::optional<double> corner = corner_reached();
    if (corner) t_ = *corner;
    if (!write_outputs(from)) return;
    observe(y_);
    const bool met = contacts_.update(*this, t_, result_.events), changed = laws_.update(*this, t_, result_.events);
    if (changed) observe(y_);  // sudden losses are large at once
    if (met || changed || corner) {
      restart();
      ++result_.summary.restarts;
    }
    if (options_.progress && steps_ % 256 == 0) options_.progress(t_, options_.duration);
  }

  /// Outputs up to t_: those within the step as many at a time as go at once. False where the flight is stopped before
  /// the last of them. The flight is then where the last row is, or where the step came `from`. next_y_ was its state
  /// there.
  bool write_outputs(double from) {
    constexpr std::size_t at_once = 16;
    samples_.resize(y_.size(), at_once);
    for (double written = from;;) {
      times_.clear();
      double next = output_time();
      for (; times_.size() < at_once && next < t_; next = outputs_.after(result_.time.size() + times_.size()))
        times_.push_back(next);
      if (times_.empty()) break;
      if (stopped()) {
        t_ = written, y_ = next_y_;
        return false;
      }
      interpolate(times_, samples_);
      for (std::size_t i = 0; i < times_.size(); ++i) {
        if (options_.progress && result_.time.size() % 1024 == 0) options_.progress(times_[i], options_.duration);
        record(times_[i], samples_.col(static_cast<Eigen::Index>(i)));
      }
      written = times_.back(), next_y_ = samples_.col(static_cast<Eigen::Index>(times_.size()) - 1);
    }
    if (output_time() == t_) record(t_, y_);
    return true;
  }

  /// Where the next step must end at the latest. What is nearer than round-off is reached.
  double limit() const {
    const double reached = t_ + round_off();
    double end = options_.duration;
    const auto corner = std::ranges::upper_bound(options_.corners, reached);
    if (corner != options_.corners.end()) end = std::min(end, std::nextafter(*corner, t_));
    const auto other = std::ranges::upper_bound(options_.step_ends, reached);
    if (other != options_.step_ends.end()) end = std::min(end, *other);
    return end;
  }

  /// The corner that t_ has come to, the last of those that are one but for round-off, or nothing. A step ends before
  /// it, the next one begins on it: what jumps there has one value within a step.
  std::optional<double> corner_reached() const {
    const auto beyond = std::ranges::upper_bound(options_.corners, t_ + round_off());
    if (beyond == options_.corners.begin() || !(*std::prev(beyond) > t_)) return {};
    return *std::prev(beyond);
  }

  double round_off() const { return 1e-14 * options_.duration; }

  /// The summary, and where a flight that was interrupted between two outputs is, a row of that.
  void close() {
    if (result_.summary.interrupted && result_.time.back() < t_) record(t_, y_);
    result_.summary.seconds = seconds();
    result_.summary.stops = contacts_.histories();
    laws_.add_histories(result_.summary.stops);
    finish();
  }

  /// What an interruption here would leave.
  void checkpoint() {
    if (so_far_) {
      const std::size_t rows = result_.time.size();
      const auto before = result_.summary;
      result_.summary.interrupted = true;
      close();
      so_far_(result_, rows);
      result_.summary = before;
      result_.time.resize(rows);
      keep_rows(rows);
    }
    since_checkpoint_ = Stopwatch();
  }

  const Checkpoint<Result>& so_far_;
  Stopwatch since_checkpoint_;
  Stopwatch watch_;
  Eigen::VectorXd next_y_;
  std::vector<double> times_;  // of outputs within a step, and their states
  Eigen::MatrixXd samples_;
  long steps_ = 0;
};

}  // namespace flexboom
