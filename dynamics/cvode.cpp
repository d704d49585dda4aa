#include "dynamics/cvode.hpp"

#include "dynamics/crossing.hpp"
#include "dynamics/workspace.hpp"
#include "fem/check.hpp"

#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <utility>

namespace flexboom {

namespace {

template <class T, auto Free>
struct Deleter {
  void operator()(T* p) const { Free(p); }
};
using VectorHandle = std::unique_ptr<_generic_N_Vector, Deleter<_generic_N_Vector, N_VDestroy>>;

struct ContextHandle {
  SUNContext context = nullptr;
  ContextHandle() {
    if (SUNContext_Create(nullptr, &context) != 0) throw NumericalError("SUNDIALS: no context");
  }
  ~ContextHandle() { SUNContext_Free(&context); }
  ContextHandle(const ContextHandle&) = delete;
  ContextHandle& operator=(const ContextHandle&) = delete;
};

void quiet(int, const char*, const char*, char*, void*) noexcept {}

/// CVODE on one System. The matrix handed to CVODE is a token: I - gamma J lives in the Workspace in its condensed
/// form, which costs a factorisation of u x u instead of y x y.
class CvodeStepper final : public Stepper {
 public:
  CvodeStepper(const System& system, const ErrorScale& scale, int method)
      : system_(system), scale_(scale), work_(system.workspace()) {
    const auto n = static_cast<sunindextype>(system.layout().size);
    const auto hinges = static_cast<int>(system.appendages().size());
    contact_.assign(static_cast<size_t>(hinges), 0);
    armed_.assign(static_cast<size_t>(hinges), 0);
    before_.resize(armed_.size());
    y_.reset(N_VNew_Serial(n, context_.context));
    out_.reset(N_VNewEmpty_Serial(n, context_.context));
    make_linear_solver();
    cvode_ = CVodeCreate(method, context_.context);
    if (cvode_ == nullptr || !y_ || !out_) throw NumericalError("SUNDIALS: out of memory");
    check(CVodeSetErrHandlerFn(cvode_, quiet, nullptr), "CVodeSetErrHandlerFn");
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
      self.system_.solve_newton(N_VGetArrayPointer(b), *self.work_, N_VGetArrayPointer(x));
      return 0;
    };
  }

  /// Of the gap on the side of its flag; slope per second.
  Clearance clearance(const Eigen::VectorXd& y, size_t i) const {
    const double side = contact_[i] ? 1 : -1;
    const int hinge = static_cast<int>(i);
    return {0, side * system_.gap(y.data(), hinge), side * system_.gap_rate(y.data(), hinge)};
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

  static int rhs(realtype, N_Vector y, N_Vector y_dot, void* user) noexcept {
    auto& self = *static_cast<CvodeStepper*>(user);
    self.system_.derivative(N_VGetArrayPointer(y), self.contact_, *self.work_, N_VGetArrayPointer(y_dot));
    return 0;
  }

  static int gaps(realtype, N_Vector y, realtype* g, void* user) noexcept {
    auto& self = *static_cast<CvodeStepper*>(user);
    const double* state = N_VGetArrayPointer(y);
    for (size_t i = 0; i < self.armed_.size(); ++i)
      g[i] = self.armed_[i] ? self.system_.gap(state, static_cast<int>(i)) : 1.0;
    return 0;
  }

  static int weights(N_Vector, N_Vector ewt, void* user) noexcept {
    const auto& self = *static_cast<CvodeStepper*>(user);
    const Eigen::VectorXd& scale = self.scale_.scale;
    Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(ewt), scale.size()) =
        (self.scale_.tolerance * scale.array()).inverse().matrix();
    return 0;
  }

  static int linear_system(realtype, N_Vector y, N_Vector, SUNMatrix, booleantype jacobian_is_current,
                           booleantype* jacobian_was_updated, realtype gamma, void* user, N_Vector, N_Vector,
                           N_Vector) noexcept {
    auto& self = *static_cast<CvodeStepper*>(user);
    try {
      if (!jacobian_is_current) {
        self.system_.jacobian(N_VGetArrayPointer(y), self.contact_, *self.work_);
        ++self.jacobians_;
      }
      *jacobian_was_updated = !jacobian_is_current;
      self.system_.factorise_newton(gamma, *self.work_);
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

  const System& system_;
  const ErrorScale& scale_;
  ContextHandle context_;
  WorkspaceHandle work_;
  VectorHandle y_, out_;
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
  return std::make_unique<CvodeStepper>(system, scale, CV_BDF);
}

std::unique_ptr<Stepper> make_cvode_adams(const System& system, const ErrorScale& scale) {
  return std::make_unique<CvodeStepper>(system, scale, CV_ADAMS);
}

}  // namespace flexboom
