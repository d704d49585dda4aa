#include "dynamics/methods/exponential.hpp"

#include "dynamics/methods/followers.hpp"
#include "dynamics/methods/linear_parts.hpp"
#include "dynamics/methods/renewal.hpp"
#include "dynamics/methods/stop_search.hpp"
#include "dynamics/numerics/small_product.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <limits>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int max_sweeps = 12;
constexpr double rung = 1.4142135623730951;  // between step sizes

/// The nearest of the step sizes that grids are kept for.
double on_ladder(double h) { return std::exp2(std::round(2 * std::log2(h)) / 2); }

class ExponentialStepper final : public Stepper {
 public:
  ExponentialStepper(std::unique_ptr<SplitProblem> problem, const ErrorScale& scale)
      : problem_(std::move(problem)),
        parts_(*problem_),
        layout_(problem_->layout()),
        scale_(scale),
        nx_(layout_.x),
        motion_(*problem_, scale),
        search_(layout_.gaps),
        renewal_(nx_),
        y_(VectorXd::Zero(layout_.size)),
        y_dot_(layout_.size),
        F_(nx_, points),
        scaled_coefficients_(collocation::coefficients()) {
    double factorial = 1;
    for (int m = 0; m < points; ++m, factorial *= m) {
      scaled_coefficients_.col(m) *= factorial;
      middle_[m] = collocation::middle_polynomial()[m] * factorial;
    }
    step_.X.resize(nx_, points);
    for (const SplitLayout::Turn& turn : layout_.turns) {
      for (int i = 0; i < 3; ++i) watched_.push_back(turn.omega + i);
      y_[turn.attitude] = 1;
    }
    for (const auto& [gap, rate] : layout_.gaps)
      for (const int entry : {gap, rate}) watched_.push_back(entry);
    watched_x_.resize(std::ssize(watched_), inner);
    x_at_end_.resize(nx_, 2);
    if (!(scale.tolerance > 4e-16))
      throw NumericalError(fmt::format(
          "exponential: the tolerance asks for {:.2g} of each step, which is below round-off", scale.tolerance));
  }

  void restart(double t, const VectorXd& y, std::span<const char> contact, std::span<const double> levels) override {
    step_.start = t;
    pending_ = false;
    contact_.assign(contact.begin(), contact.end());
    levels_.assign(levels.begin(), levels.end());
    parts_.close(contact_);
    step_.linear = &parts_.near(step_.start, y);
    begin(y);
    first_ = true;
    h_ = first_step();
    if (step_.linear->step > 0) h_ = std::min(h_, step_.linear->step);
    renewal_.restart(counts_.steps, counts_.rhs_evaluations, t);
  }

  void step(double t_end, double& t, VectorXd& y, std::span<int> crossed) override {
    std::ranges::fill(crossed, 0);
    if (pending_) advance_start();
    if (renewal_.is_due(counts_.steps, counts_.rhs_evaluations, step_.start)) try_relinearising();
    std::exception_ptr unfit;
    for (int failures = 0;; ++failures) {
      const double left = t_end - step_.start;
      const bool last = h_ >= left * (1 - 1e-12);
      step_.length = last ? left : h_;
      if (last) step_.linear->grid(step_.length, spare_);
      step_.grid = last ? &spare_ : &step_.linear->kept_grid(step_.length);
      double error = std::numeric_limits<double>::infinity();
      try {
        error = solve(left);
      } catch (const UnfitState&) {  // points that do not stand still may be anywhere
        unfit = std::current_exception();
      }
      if (error <= 1) {
        ++counts_.steps;
        choose_step(error, last);
        break;
      }
      ++counts_.error_test_failures;
      if (!(step_.length > 1e-14 * std::max(1.0, std::abs(step_.start)))) {
        if (unfit) std::rethrow_exception(unfit);
        throw MethodFailure(
            fmt::format("exponential: no step is small enough at t = {:.9g} s; eigenvalues reach {:.2g} 1/s, whose "
                        "round-off may be more than the tolerance: fewer modes, or a coarser one",
                        step_.start, step_.linear->lambda.cwiseAbs().maxCoeff()));
      }
      shorten(error, failures);
    }
    end_ = search_.first_crossing(step_, contact_, levels_, crossed);
    if (end_ == 0) {
      y = start_;
    } else if (end_ == 1) {
      y.head(nx_) = step_.X.col(degree);
      motion_.turn(step_, (*step_.grid)[degree], 1, y);
    } else {
      step_.linear->point(end_, step_.length, scratch_);
      step_.linear->combine(scratch_, 0, step_.Z.col(0), step_.M, integral_);
      step_.linear->to_x(integral_, y.head(nx_));
      motion_.turn(step_, scratch_, end_, y);
    }
    t = step_.start + end_ * step_.length;
    if (end_ == 1 && step_.length == t_end - step_.start) t = t_end;
    kept_ = motion_.keep_momentum(t, y);
    motion_.place(step_, end_, y);
    pending_ = true;
    reached_ = t;
    reached_state_ = y;
  }

  /// By the linear part alone, with the remainder as it is at the start: as far as that part is good for.
  void predict(double t_end, const std::function<void(const VectorXd& y)>& look) override {
    const double left = t_end - step_.start;
    step_.M.setZero();
    VectorXd y = start_;
    for (double t = left; t > 1e-10 * left; t /= 2) {
      step_.length = t;
      step_.M.col(0) = t * step_.N.col(0);
      step_.linear->point(1, t, scratch_);
      step_.linear->combine(scratch_, 0, step_.Z.col(0), step_.M, integral_);
      step_.linear->to_x(integral_, y.head(nx_));
      motion_.turn(step_, scratch_, 1, y);
      motion_.place(step_, 1, y);
      if (y.allFinite() && parts_.serves(*step_.linear, y)) look(y);
    }
  }

  void interpolate(std::span<const double> times, MatrixXd& Y) override {
    const auto count = std::ssize(times);
    between_.resize(step_.linear->size(), count);
    const auto fraction = [&](Index i) { return (times[static_cast<size_t>(i)] - step_.start) / step_.length; };
    for (Index i = 0; i < count; ++i) {
      step_.linear->point(fraction(i), step_.length, scratch_);
      step_.linear->combine(scratch_, 0, step_.Z.col(0), step_.M, between_.col(i));
      motion_.turn(step_, scratch_, fraction(i), Y.col(i));
    }
    step_.linear->to_x(between_, Y.topLeftCorner(nx_, count));
    for (Index i = 0; i < count; ++i) motion_.place(step_, fraction(i), Y.col(i));
  }

  double fastest() const override { return step_.linear->fastest; }

  StepCounts counts() const override {
    StepCounts counts = counts_;
    counts.jacobian_evaluations = counts.factorisations = parts_.made();
    counts.rhs_evaluations += splitting_;
    return counts;
  }

 private:
  static constexpr int degree = collocation::degree;
  static constexpr int points = collocation::points;
  static constexpr int inner = points - 2;

  /// After a step that failed.
  void shorten(double error, int failures) {
    constexpr int many = 6;
    const bool diverges = !std::isfinite(error), is_fresh = renewal_.is_fresh(counts_.steps);
    h_ = diverges ? on_ladder(step_.length / (rung * rung)) : smaller(error);
    if (diverges && is_fresh && failures < many)
      longest_ = on_ladder(step_.length / rung), since_longest_ = 0;
    else if (diverges)
      relinearise(failures < many ? 1e-3 : 1e-9);
    else if (failures >= 2 && !first_ && !is_fresh)  // what is stiff and not in L keeps the error from falling
      try_relinearising();
  }

  /// Takes L where the step starts, unless it was taken near there: that costs as much as some steps.
  void relinearise(double near) {
    VectorXd base = base_here();
    const auto there = step_.linear->base.head(nx_), here = base.head(nx_);
    if ((there - here).norm() <= near * std::max(there.norm(), here.norm())) return;
    take_linear_part(base);
  }

  /// The state at the start of the step, but for the rates of coordinates.
  VectorXd base_here() const {
    VectorXd base = start_;
    for (const auto& [value, rate] : layout_.coordinates) base[rate] = 0;
    return base;
  }

  void take_linear_part(VectorXd base) {
    renewal_.taken(counts_.steps);
    try {
      step_.linear = &parts_.renew(step_.start, base);
    } catch (const NumericalError&) {  // with its angular velocity L may have too few eigenvectors
      for (const SplitLayout::Turn& turn : layout_.turns) base.segment<3>(turn.omega).setZero();
      step_.linear = &parts_.renew(step_.start, base);
    }
    begin(start_);
    first_ = true;
  }

  /// Even where only time has changed what L is. Without another L, the one that there is serves on.
  void try_relinearising() {
    try {
      take_linear_part(base_here());
    } catch (const NumericalError&) {
    }
  }

  double first_step() const {
    // A tenth of the period of the slowest vibration that is not overdamped; the error test takes it from there.
    double slowest = 0;
    for (Index k = 0; k < step_.linear->lambda.size(); ++k) {
      const double w = std::abs(step_.linear->lambda[k].imag());
      if (w > 1e-3) slowest = slowest == 0 ? w : std::min(slowest, w);
    }
    return std::exp2(std::floor(std::log2(slowest > 0 ? 0.6 / slowest : 0.01)));
  }

  void begin(const VectorXd& y) {
    const Index m = step_.linear->size();
    start_ = y;
    step_.Z.resize(m, points);
    step_.M.resize(m, points);
    step_.N.resize(m, points);
    integral_.resize(m);
    zero_.setZero(m);
    at_end_.resize(m, 2);
    if (step_.linear->watched_modes.size() == 0)
      step_.linear->watched_modes = step_.linear->from_modes(watched_, Eigen::all);
    step_.linear->to_z(y.head(nx_), step_.Z.leftCols(1));
    step_.X.col(0) = y.head(nx_);
    motion_.start(step_.start, y);
    if (layout_.loads_work) split_powers();
    evaluate(0);
    step_.linear->remainder(F_.leftCols(1), step_.Z.leftCols(1), step_.N.leftCols(1));
  }

  /// The power of a load, as it is now, vibrates with the point where it acts. By central differences about rest, which
  /// are exact: powers are of second order in the rates at most.
  void split_powers() {
    const int energies = layout_.size - layout_.energies;
    MatrixXd of_x = MatrixXd::Zero(energies, nx_);
    VectorXd y = start_;
    y.head(nx_) = step_.linear->base.head(nx_);
    const auto add = [&](int i, double sign) {
      y_ = y;
      y_[i] += sign;
      motion_.place(step_, 0, y_);
      problem_->derivative(step_.start, y_.data(), contact_, y_dot_.data());
      ++splitting_;
      of_x.col(i) += 0.5 * sign * y_dot_.tail(energies);
    };
    for (const auto& [value, rate] : layout_.coordinates) add(rate, 1), add(rate, -1);
    for (const SplitLayout::Turn& turn : layout_.turns)
      for (int i = 0; i < 3; ++i) add(turn.omega + i, 1), add(turn.omega + i, -1);
    motion_.split_powers(of_x, of_x * step_.linear->from_modes);
  }

  /// The end of the last step is the start of the next; N and the power there are those before momentum was kept, which
  /// is less than the error that was allowed.
  void advance_start() {
    pending_ = false;
    motion_.go_on(step_, reached_state_);
    step_.start = reached_;
    start_ = reached_state_;
    step_.Z.col(0) = step_.Z.col(degree).eval();
    step_.X.col(0) = reached_state_.head(nx_);
    step_.N.col(0) = step_.N.col(degree).eval();
    if (!kept_.isZero(0)) step_.Z.col(0) += step_.linear->to_modes.middleCols<3>(layout_.roots.front().omega) * kept_;
    first_ = false;
  }

  /// The time at a fraction c. What is given as a function of time may jump where a step starts or ends: inside of it,
  /// by round-off, there is one value.
  double within_step(double c) const {
    const double end = step_.start + step_.length;
    const double inside = std::min(0.25 * step_.length, 4e-16 * std::max(std::abs(step_.start), std::abs(end)));
    return std::clamp(step_.start + c * step_.length, step_.start + inside, end - inside);
  }

  /// F and what follows x needs at point j.
  void evaluate(int j) {
    const double c = collocation::node(j);
    y_.head(nx_) = step_.X.col(j);
    if (layout_.attitudes_matter && j == 0) y_ = start_;
    if (layout_.attitudes_matter && j > 0) follow_to((*step_.grid)[static_cast<size_t>(j)], c);
    force(c);
    F_.col(j) = y_dot_.head(nx_);
    motion_.take(j, y_, y_dot_);
  }

  /// Attitudes and places of y_ at a fraction of the step.
  void follow_to(const GridPoint& point, double c) {
    motion_.turn(step_, point, c, y_);
    motion_.place(step_, c, y_);
  }

  /// The derivative of y_ at a fraction of the step, but for what is prescribed.
  void force(double c) {
    problem_->derivative(within_step(c), y_.data(), contact_, y_dot_.data());
    ++counts_.rhs_evaluations;
    for (const int i : layout_.prescribed) y_dot_[i] = 0;
  }

  /// Sweeps until the points stand still; returns the error in units of the one allowed, infinite when they do not.
  double solve(double left) {
    predict();
    motion_.forget();  // a failed step left what it had
    double last_change = 0;
    for (int sweep = 0; sweep < max_sweeps; ++sweep) {
      small_product(step_.N, step_.length * scaled_coefficients_, step_.M);
      for (int j = 1; j < points; ++j)
        step_.linear->combine((*step_.grid)[static_cast<size_t>(j)], 0, step_.Z.col(0), step_.M, step_.Z.col(j));
      double change = std::numeric_limits<double>::infinity();
      if (sweep == 0) {
        step_.linear->to_x(step_.Z.rightCols(degree), step_.X.rightCols(degree));
      } else {  // the end says whether the points stand still: at the others not all of x is wanted then
        at_end_.col(0) = step_.Z.col(degree);
        predict_error(at_end_.col(1));
        step_.linear->to_x(at_end_, x_at_end_);
        change = norm(x_at_end_.col(0) - step_.X.col(degree));
        step_.X.col(degree) = x_at_end_.col(0);
      }
      if (!std::isfinite(change) && sweep > 0) return change;
      if (sweep > 1 && change > last_change && change > 1) return std::numeric_limits<double>::infinity();
      const double ratio = sweep > 1 ? std::min(0.9, change / last_change) : contraction_;
      if (sweep > 1) contraction_ = std::max(1e-3, ratio);
      if (sweep > 0 && change * ratio <= 0.1) break;
      if (sweep + 1 == max_sweeps) return std::numeric_limits<double>::infinity();
      last_change = change;
      if (sweep > 0) step_.linear->to_x(step_.Z.middleCols<inner>(1), step_.X.middleCols<inner>(1));
      if (layout_.attitudes_matter) motion_.follow(step_);
      for (int j = 1; j < points; ++j) evaluate(j);
      step_.linear->remainder(F_.rightCols(degree), step_.Z.rightCols(degree), step_.N.rightCols(degree));
    }
    small_product(step_.linear->watched_modes, step_.Z.middleCols<inner>(1), watched_x_);
    step_.X.middleCols<inner>(1)(watched_, Eigen::all) = watched_x_;
    motion_.follow(step_);
    const double error = std::max(norm(x_at_end_.col(1)), motion_.error(step_, at_end_.col(1), left));
    return first_ && error <= 1 ? std::max(error, error_between()) : error;
  }

  /// Of a first step, the error by what the remainder is soon after the start. What rings and has decayed before the
  /// first point inside is seen by none; a later step has grown from where it was not.
  double error_between() {
    constexpr double soon[] = {0.02, 0.07};
    double error = 0;
    for (const double c : soon) {
      const GridPoint& point = point_at(c);
      step_.linear->combine(point, 0, step_.Z.col(0), step_.M, at_end_.col(0));
      step_.linear->to_x(at_end_.leftCols<1>(), x_at_end_.leftCols<1>());
      y_.head(nx_) = x_at_end_.col(0);
      if (layout_.attitudes_matter) follow_to(point, c);
      force(c);
      step_.linear->remainder(y_dot_.head(nx_), at_end_.leftCols<1>(), at_end_.rightCols<1>());
      error_modes_.noalias() = at_end_.col(1) - step_.N * (collocation::coefficients() * collocation::monomials(c));
      carry_error(at_end_.col(1), degree / 2);
      step_.linear->to_x(at_end_.rightCols<1>(), x_at_end_.rightCols<1>());
      error = std::max(error, norm(x_at_end_.col(1)));
    }
    return error;
  }

  /// Kept for steps of the same size, as their grid is.
  const GridPoint& point_at(double c) {
    if (step_.grid != &spare_) return step_.linear->kept_point(c, step_.length);
    step_.linear->point(c, step_.length, scratch_);
    return scratch_;
  }

  /// What the middle point adds to the interpolation by the others, carried to the end of the step.
  void predict_error(Eigen::Ref<VectorXd> z) {
    error_modes_.noalias() = step_.N * collocation::middle_difference();
    carry_error(z, degree);
  }

  /// What an error of the remainder makes of z at a point.
  void carry_error(Eigen::Ref<VectorXd> z, int point) {
    M_error_.noalias() = step_.length * error_modes_ * middle_.transpose();
    step_.linear->combine((*step_.grid)[static_cast<size_t>(point)], 0, zero_, M_error_, z);
  }

  double norm(const Eigen::Ref<const VectorXd>& e) const {
    return (e.array() / (scale_.tolerance * scale_.scale.head(nx_).array())).abs().maxCoeff();
  }

  /// The remainder at the points of a new step: the polynomial of the last one goes on, or it stays as it is.
  void predict() {
    if (first_ || last_used_ <= 0) {
      for (int j = 1; j < points; ++j) step_.N.col(j) = step_.N.col(0);
      return;
    }
    collocation::Table beyond;
    for (int j = 0; j < points; ++j)
      beyond.col(j) = collocation::monomials(1 + collocation::node(j) * step_.length / last_used_);
    small_product(last_N_, beyond.rightCols<degree>(), step_.N.rightCols<degree>());
  }

  void choose_step(double error, bool last) {
    last_N_.resizeLike(step_.N);
    small_product(step_.N, collocation::coefficients(), last_N_);
    last_used_ = step_.length;
    if (last) return;
    const double growth = std::pow(std::max(error, 1e-10), -1.0 / (degree + 1));
    // Half of what the error allows, up to four times: after a stop the first steps follow what decays at once.
    if (growth > 1.25 * rung) h_ = on_ladder(step_.length * std::clamp(growth / 2, rung, 4.0));
    constexpr int patience = 20;  // steps until one that diverged is tried again
    if (++since_longest_ > patience) longest_ *= rung, since_longest_ = 0;
    h_ = std::min(h_, longest_);
    // What the next restart with these stops tries: a failed step costs less than many short ones.
    if (first_) step_.linear->step = error < 1e-3 ? 8 * step_.length : step_.length;
  }
  double smaller(double error) const {
    double h = step_.length;
    for (double left = error; left > 1; left /= std::pow(rung, degree + 1)) h /= rung;
    return on_ladder(h);
  }

  std::unique_ptr<SplitProblem> problem_;
  LinearParts parts_;
  const SplitLayout& layout_;
  const ErrorScale& scale_;
  int nx_;
  std::vector<char> contact_;
  std::vector<double> levels_;
  std::vector<int> watched_;  // entries of x that are wanted at every point: angular velocities, gaps and their rates
  CollocatedStep step_;
  Followers motion_;
  StopSearch search_;
  Renewal renewal_;
  Grid spare_;
  GridPoint scratch_;

  double longest_ = std::numeric_limits<double>::infinity();  // step that does not diverge, as far as is known
  int since_longest_ = 0;                                     // steps
  double h_ = 0, end_ = 1, last_used_ = 0, reached_ = 0, contraction_ = 0.1;
  bool first_ = true, pending_ = false;
  VectorXd start_, reached_state_;
  VectorXd y_, y_dot_;
  MatrixXd F_, last_N_, M_error_, watched_x_, between_;
  MatrixXd at_end_, x_at_end_;  // of the step: z and x there, and their errors
  VectorXd error_modes_, zero_, integral_;
  collocation::Values middle_ = collocation::Values::Zero();
  collocation::Table scaled_coefficients_;
  Vector3d kept_ = Vector3d::Zero();
  StepCounts counts_;
  long splitting_ = 0;  // evaluations, which say nothing of how steps go
};

}  // namespace

std::unique_ptr<Stepper> make_exponential(std::unique_ptr<SplitProblem> problem, const ErrorScale& scale) {
  return std::make_unique<ExponentialStepper>(std::move(problem), scale);
}

}  // namespace flexboom
