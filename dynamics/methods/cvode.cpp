#include "dynamics/methods/cvode.hpp"

#include "dynamics/methods/ode.hpp"
#include "dynamics/methods/sundials_problem.hpp"
#include "dynamics/numerics/sundials.hpp"
#include "fem/base/check.hpp"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>

#include <utility>

namespace flexboom {

namespace {

class CvodeStepper final : public Stepper {
 public:
  CvodeStepper(std::unique_ptr<Ode> ode, const ErrorScale& scale, int method)
      : problem_(std::move(ode), scale, context_.context) {
    const auto n = static_cast<sunindextype>(problem_.size());
    y_.reset(N_VNew_Serial(n, context_.context));
    out_.reset(N_VNewEmpty_Serial(n, context_.context));
    cvode_.reset(CVodeCreate(method, context_.context));
    if (!cvode_ || !y_ || !out_) throw NumericalError("SUNDIALS: out of memory");
    check(CVodeSetErrHandlerFn(cvode_.get(), sundials::quiet, nullptr), "CVodeSetErrHandlerFn");
    check(CVodeInit(cvode_.get(), &sundials::Problem::derivative, 0.0, y_.get()), "CVodeInit");
    check(CVodeSetUserData(cvode_.get(), &problem_), "CVodeSetUserData");
    check(CVodeWFtolerances(cvode_.get(), &sundials::Problem::weights), "CVodeWFtolerances");
    check(CVodeSetLinearSolver(cvode_.get(), problem_.solver(), problem_.matrix()), "CVodeSetLinearSolver");
    check(CVodeSetLinSysFn(cvode_.get(), &CvodeStepper::linear_system), "CVodeSetLinSysFn");
    check(CVodeSetMaxNumSteps(cvode_.get(), -1), "CVodeSetMaxNumSteps");
  }

  void restart(double t, const Eigen::VectorXd& y, std::span<const char> contact,
               std::span<const double> levels) override {
    problem_.set_contacts(contact);
    crossings_.watch(levels);
    Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(y_.get()), y.size()) = y;
    if (started_) add_counts(past_);
    started_ = true;
    check(CVodeReInit(cvode_.get(), t, y_.get()), "CVodeReInit");
  }

  void step(double t_end, double& t, Eigen::VectorXd& y, std::span<int> crossed) override {
    check(CVodeSetStopTime(cvode_.get(), t_end), "CVodeSetStopTime");
    const double start = t;
    realtype reached = t;
    crossings_.begin(problem_, start, y.data());
    const int flag = CVode(cvode_.get(), t_end, y_.get(), &reached, CV_ONE_STEP);
    problem_.rethrow(flag, start, reached);
    check(flag, "CVode");
    const double length = reached - start;
    between_.resize(y.size());
    const auto state_at = [&](double c) {
      state_at_time(start + c * length, between_);
      return between_.data();
    };
    const double c = crossings_.first(problem_, start, length, N_VGetArrayPointer(y_.get()), state_at, crossed);
    t = c < 1 ? start + c * length : reached;
    if (c < 1)
      state_at_time(t, y);
    else
      y = Eigen::Map<const Eigen::VectorXd>(N_VGetArrayPointer(y_.get()), y.size());
  }

  void interpolate(std::span<const double> times, Eigen::MatrixXd& Y) override {
    for (size_t i = 0; i < times.size(); ++i) state_at_time(times[i], Y.col(static_cast<Eigen::Index>(i)));
  }

  StepCounts counts() const override {
    StepCounts c = past_;
    if (started_) add_counts(c);
    return c;
  }

 private:
  static int linear_system(realtype t, N_Vector y, N_Vector, SUNMatrix, booleantype jacobian_is_current,
                           booleantype* jacobian_was_updated, realtype gamma, void* problem, N_Vector, N_Vector,
                           N_Vector) noexcept {
    return sundials::Problem::linear_system(t, y, jacobian_is_current, jacobian_was_updated, gamma, problem);
  }

  /// Within the last step.
  void state_at_time(double t, Eigen::Ref<Eigen::VectorXd> y) {
    N_VSetArrayPointer(y.data(), out_.get());
    check(CVodeGetDky(cvode_.get(), t, 0, out_.get()), "CVodeGetDky");
  }

  void check(int flag, const char* function) const {
    if (flag >= 0) return;
    realtype t = 0, h = 0;
    CVodeGetCurrentTime(cvode_.get(), &t);
    CVodeGetLastStep(cvode_.get(), &h);
    sundials::fail("CVODE", function, CVodeGetReturnFlagName(flag), t, h);
  }

  void add_counts(StepCounts& c) const {
    long steps = 0, rhs = 0, setups = 0, failures = 0, newton = 0;
    CVodeGetNumSteps(cvode_.get(), &steps);
    CVodeGetNumRhsEvals(cvode_.get(), &rhs);
    CVodeGetNumLinSolvSetups(cvode_.get(), &setups);
    CVodeGetNumErrTestFails(cvode_.get(), &failures);
    CVodeGetNumNonlinSolvIters(cvode_.get(), &newton);
    c.steps += steps;
    c.rhs_evaluations += rhs;
    c.factorisations += setups;
    c.error_test_failures += failures;
    c.newton_iterations += newton;
    c.jacobian_evaluations = problem_.jacobians();
  }

  sundials::Context context_;
  sundials::Problem problem_;
  sundials::StepCrossings crossings_;
  sundials::Vector y_, out_;
  sundials::Memory<CVodeFree> cvode_;
  Eigen::VectorXd between_;  // a state within a step
  StepCounts past_;
  bool started_ = false;
};

}  // namespace

std::unique_ptr<Stepper> make_cvode_bdf(std::unique_ptr<Ode> ode, const ErrorScale& scale) {
  return std::make_unique<CvodeStepper>(std::move(ode), scale, CV_BDF);
}

std::unique_ptr<Stepper> make_cvode_adams(std::unique_ptr<Ode> ode, const ErrorScale& scale) {
  return std::make_unique<CvodeStepper>(std::move(ode), scale, CV_ADAMS);
}

}  // namespace flexboom
