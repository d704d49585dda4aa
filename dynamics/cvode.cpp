#include "dynamics/cvode.hpp"

#include "dynamics/crossing.hpp"
#include "dynamics/ode.hpp"
#include "dynamics/sundials.hpp"
#include "fem/check.hpp"

#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <utility>

namespace flexboom {

namespace {

/// CVODE on one system. The matrix handed to CVODE is a token: I - gamma J lives in the Ode in its own form.
class CvodeStepper final : public Stepper {
 public:
  CvodeStepper(std::unique_ptr<Ode> ode, const ErrorScale& scale, int method) : ode_(std::move(ode)), scale_(scale) {
    const auto n = static_cast<sunindextype>(ode_->size());
    const int hinges = ode_->stops();
    contact_.assign(static_cast<size_t>(hinges), 0);
    armed_.assign(static_cast<size_t>(hinges), 0);
    before_.resize(armed_.size());
    y_.reset(N_VNew_Serial(n, context_.context));
    out_.reset(N_VNewEmpty_Serial(n, context_.context));
    make_linear_solver();
    cvode_ = CVodeCreate(method, context_.context);
    if (cvode_ == nullptr || !y_ || !out_) throw NumericalError("SUNDIALS: out of memory");
    check(CVodeSetErrHandlerFn(cvode_, sundials::quiet, nullptr), "CVodeSetErrHandlerFn");
    check(CVodeInit(cvode_, &CvodeStepper::rhs, 0.0, y_.get()), "CVodeInit");
    check(CVodeSetUserData(cvode_, this), "CVodeSetUserData");
    check(CVodeWFtolerances(cvode_, &CvodeStepper::weights), "CVodeWFtolerances");
    check(CVodeSetLinearSolver(cvode_, solver_, matrix_), "CVodeSetLinearSolver");
    check(CVodeSetLinSysFn(cvode_, &CvodeStepper::linear_system), "CVodeSetLinSysFn");
    check(CVodeSetMaxNumSteps(cvode_, -1), "CVodeSetMaxNumSteps");
    if (hinges > 0) check(CVodeRootInit(cvode_, hinges, &CvodeStepper::gaps), "CVodeRootInit");
    check(CVodeSetNoInactiveRootWarn(cvode_), "CVodeSetNoInactiveRootWarn");
  }

  ~CvodeStepper() override {
    CVodeFree(&cvode_);
    SUNLinSolFreeEmpty(solver_);
    SUNMatFreeEmpty(matrix_);
  }
  CvodeStepper(const CvodeStepper&) = delete;
  CvodeStepper& operator=(const CvodeStepper&) = delete;

  void restart(double t, const Eigen::VectorXd& y, std::span<const char> contact,
               std::span<const char> armed) override {
    std::copy(contact.begin(), contact.end(), contact_.begin());
    std::copy(armed.begin(), armed.end(), armed_.begin());
    Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(y_.get()), y.size()) = y;
    if (started_) add_counts(past_);
    started_ = true;
    check(CVodeReInit(cvode_, t, y_.get()), "CVodeReInit");
  }

  void step(double t_end, double& t, Eigen::VectorXd& y, std::span<int> crossed) override {
    check(CVodeSetStopTime(cvode_, t_end), "CVodeSetStopTime");
    realtype reached = t;
    const double start = t;
    for (size_t i = 0; i < armed_.size(); ++i) before_[i] = clearance(y, i);
    const int flag = CVode(cvode_, t_end, y_.get(), &reached, CV_ONE_STEP);
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    check(flag, "CVode");
    t = reached;
    y = Eigen::Map<const Eigen::VectorXd>(N_VGetArrayPointer(y_.get()), y.size());
    std::fill(crossed.begin(), crossed.end(), 0);
    if (flag == CV_ROOT_RETURN)
      check(CVodeGetRootInfo(cvode_, crossed.data()), "CVodeGetRootInfo");
    else
      find_short_contacts(start, t, y, crossed);
  }

  void interpolate(double t, Eigen::VectorXd& y) override {
    N_VSetArrayPointer(y.data(), out_.get());
    check(CVodeGetDky(cvode_, t, 0, out_.get()), "CVodeGetDky");
  }

  StepCounts counts() const override {
    StepCounts c = past_;
    if (started_) add_counts(c);
    return c;
  }

 private:
  void make_linear_solver() {
    matrix_ = SUNMatNewEmpty(context_.context);
    solver_ = SUNLinSolNewEmpty(context_.context);
    if (matrix_ == nullptr || solver_ == nullptr) throw NumericalError("SUNDIALS: out of memory");
    matrix_->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
    matrix_->ops->zero = [](SUNMatrix) { return 0; };
    solver_->content = this;
    solver_->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
    solver_->ops->initialize = [](SUNLinearSolver) { return 0; };
    solver_->ops->setup = [](SUNLinearSolver, SUNMatrix) { return 0; };
    solver_->ops->solve = [](SUNLinearSolver s, SUNMatrix, N_Vector x, N_Vector b, realtype) {
      auto& self = *static_cast<CvodeStepper*>(s->content);
      self.ode_->solve(N_VGetArrayPointer(b), N_VGetArrayPointer(x));
      return 0;
    };
  }

  /// Of the gap on the side of its flag; slope per second.
  Clearance clearance(const Eigen::VectorXd& y, size_t i) const {
    const double side = contact_[i] ? 1 : -1;
    const int hinge = static_cast<int>(i);
    return {0, side * ode_->gap(y.data(), hinge), side * ode_->gap_rate(y.data(), hinge)};
  }

  /// CVODE looks at the signs at both ends of a step: a contact that begins and ends within it is found here.
  void find_short_contacts(double start, double& t, Eigen::VectorXd& y, std::span<int> crossed) {
    const double length = t - start, resolution = 4e-16 * t;
    double first = length;
    Eigen::VectorXd& state = between_;
    state.resize(y.size());
    for (size_t i = 0; i < armed_.size(); ++i) {
      if (!armed_[i] || !(before_[i].slope < 0)) continue;
      Clearance to = clearance(y, i);
      to.c = length;
      if (!(to.slope > 0) || to.value < 0) continue;
      const auto at = [&](double c) {
        interpolate(start + c, state);
        Clearance here = clearance(state, i);
        here.c = c;
        return here;
      };
      const double root = crossing_between(at, before_[i], to, resolution);
      if (root >= first) continue;
      std::fill(crossed.begin(), crossed.end(), 0);
      crossed[i] = contact_[i] ? -1 : 1;
      first = root;
    }
    if (first == length) return;
    t = start + first;
    interpolate(t, state);
    y = state;
  }

  static int rhs(realtype t, N_Vector y, N_Vector y_dot, void* user) noexcept {
    auto& self = *static_cast<CvodeStepper*>(user);
    try {
      self.ode_->derivative(t, N_VGetArrayPointer(y), self.contact_, N_VGetArrayPointer(y_dot));
      return 0;
    } catch (...) {  // a function of time may throw
      self.error_ = std::current_exception();
      return -1;
    }
  }

  static int gaps(realtype, N_Vector y, realtype* g, void* user) noexcept {
    auto& self = *static_cast<CvodeStepper*>(user);
    const double* state = N_VGetArrayPointer(y);
    for (size_t i = 0; i < self.armed_.size(); ++i)
      g[i] = self.armed_[i] ? self.ode_->gap(state, static_cast<int>(i)) : 1.0;
    return 0;
  }

  static int weights(N_Vector, N_Vector ewt, void* user) noexcept {
    const auto& self = *static_cast<CvodeStepper*>(user);
    const Eigen::VectorXd& scale = self.scale_.scale;
    Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(ewt), scale.size()) =
        (self.scale_.tolerance * scale.array()).inverse().matrix();
    return 0;
  }

  static int linear_system(realtype t, N_Vector y, N_Vector, SUNMatrix, booleantype jacobian_is_current,
                           booleantype* jacobian_was_updated, realtype gamma, void* user, N_Vector, N_Vector,
                           N_Vector) noexcept {
    auto& self = *static_cast<CvodeStepper*>(user);
    try {
      if (!jacobian_is_current) {
        self.ode_->jacobian(t, N_VGetArrayPointer(y), self.contact_);
        ++self.jacobians_;
      }
      *jacobian_was_updated = !jacobian_is_current;
      self.ode_->factorise(gamma);
      return 0;
    } catch (...) {
      self.error_ = std::current_exception();
      return -1;
    }
  }

  void check(int flag, const char* function) const {
    if (flag >= 0) return;
    realtype t = 0, h = 0;
    if (cvode_ != nullptr) {
      CVodeGetCurrentTime(cvode_, &t);
      CVodeGetLastStep(cvode_, &h);
    }
    std::unique_ptr<char, decltype(&std::free)> name(CVodeGetReturnFlagName(flag), &std::free);
    throw NumericalError(
        fmt::format("CVODE: {} returned {} at t = {:.9g} s, last step {:.3g} s", function, name.get(), t, h));
  }

  void add_counts(StepCounts& c) const {
    long steps = 0, rhs = 0, setups = 0, failures = 0, newton = 0;
    CVodeGetNumSteps(cvode_, &steps);
    CVodeGetNumRhsEvals(cvode_, &rhs);
    CVodeGetNumLinSolvSetups(cvode_, &setups);
    CVodeGetNumErrTestFails(cvode_, &failures);
    CVodeGetNumNonlinSolvIters(cvode_, &newton);
    c.steps += steps;
    c.rhs_evaluations += rhs;
    c.factorisations += setups;
    c.error_test_failures += failures;
    c.newton_iterations += newton;
    c.jacobian_evaluations = jacobians_;
  }

  std::unique_ptr<Ode> ode_;
  const ErrorScale& scale_;
  sundials::Context context_;
  sundials::Vector y_, out_;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver solver_ = nullptr;
  void* cvode_ = nullptr;
  std::vector<char> contact_, armed_;
  std::vector<Clearance> before_;  // at the start of a step
  Eigen::VectorXd between_;        // a state within one
  std::exception_ptr error_;
  StepCounts past_;
  long jacobians_ = 0;
  bool started_ = false;
};

}  // namespace

std::unique_ptr<Stepper> make_cvode_bdf(const System& system, const ErrorScale& scale) {
  return make_cvode_bdf(ode_of(system), scale);
}

std::unique_ptr<Stepper> make_cvode_adams(const System& system, const ErrorScale& scale) {
  return make_cvode_adams(ode_of(system), scale);
}

std::unique_ptr<Stepper> make_cvode_bdf(std::unique_ptr<Ode> ode, const ErrorScale& scale) {
  return std::make_unique<CvodeStepper>(std::move(ode), scale, CV_BDF);
}

std::unique_ptr<Stepper> make_cvode_adams(std::unique_ptr<Ode> ode, const ErrorScale& scale) {
  return std::make_unique<CvodeStepper>(std::move(ode), scale, CV_ADAMS);
}

}  // namespace flexboom
