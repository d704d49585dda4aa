#include "dynamics/methods/arkode.hpp"

#include "dynamics/methods/sundials_problem.hpp"
#include "dynamics/numerics/sundials.hpp"
#include "fem/base/check.hpp"

#include <arkode/arkode_arkstep.h>
#include <nvector/nvector_serial.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace flexboom {

namespace {

struct ButcherTables {
  ARKODE_DIRKTableID implicit_one;
  ARKODE_ERKTableID explicit_one;
};

/// One method of ARKODE on one system, with steps that it chooses or is given.
class Arkode {
 public:
  Arkode(std::unique_ptr<Ode> ode, const ErrorScale& scale, const ButcherTables& tables)
      : problem_(std::move(ode), scale, context_.context) {
    y_.reset(N_VNew_Serial(static_cast<sunindextype>(problem_.size()), context_.context));
    if (!y_) throw NumericalError("SUNDIALS: out of memory");
    N_VConst(0.0, y_.get());
    const bool implicit = tables.implicit_one != ARKODE_DIRK_NONE;
    const ARKRhsFn f = &sundials::Problem::derivative;
    arkode_.reset(ARKStepCreate(implicit ? nullptr : f, implicit ? f : nullptr, 0.0, y_.get(), context_.context));
    if (!arkode_) throw NumericalError("SUNDIALS: out of memory");
    check(ARKStepSetErrHandlerFn(arkode_.get(), sundials::quiet, nullptr), "ARKStepSetErrHandlerFn");
    check(ARKStepSetUserData(arkode_.get(), &problem_), "ARKStepSetUserData");
    check(ARKStepWFtolerances(arkode_.get(), &sundials::Problem::weights), "ARKStepWFtolerances");
    check(ARKStepSetTableNum(arkode_.get(), tables.implicit_one, tables.explicit_one), "ARKStepSetTableNum");
    check(ARKStepSetMaxNumSteps(arkode_.get(), -1), "ARKStepSetMaxNumSteps");
    // After a stop the step that was right before it may be far too long.
    check(ARKStepSetMaxErrTestFails(arkode_.get(), 40), "ARKStepSetMaxErrTestFails");
    check(ARKStepSetMaxConvFails(arkode_.get(), 40), "ARKStepSetMaxConvFails");
    // What is between two steps comes from shorter steps: the polynomials of ARKODE have less digits.
    check(ARKStepSetInterpolantType(arkode_.get(), ARK_INTERP_LAGRANGE), "ARKStepSetInterpolantType");
    if (!implicit) return;
    check(ARKStepSetLinearSolver(arkode_.get(), problem_.solver(), problem_.matrix()), "ARKStepSetLinearSolver");
    check(ARKStepSetLinSysFn(arkode_.get(), &Arkode::linear_system), "ARKStepSetLinSysFn");
    check(ARKStepSetDeduceImplicitRhs(arkode_.get(), SUNTRUE), "ARKStepSetDeduceImplicitRhs");
    // Newton stops when a correction is below a tenth of the error allowed per step. ARKODE's own test takes the rate
    // of convergence of earlier stages for that of this one, and a matrix of another step length: 20 % wrong without a
    // word.
    check(ARKStepSetNonlinCRDown(arkode_.get(), 1.0), "ARKStepSetNonlinCRDown");
    check(ARKStepSetDeltaGammaMax(arkode_.get(), 1e-12), "ARKStepSetDeltaGammaMax");
  }

  sundials::Problem& problem() { return problem_; }

  void restart(double t, const double* y) {
    std::copy_n(y, problem_.size(), N_VGetArrayPointer(y_.get()));
    check(ARKStepReset(arkode_.get(), t, y_.get()), "ARKStepReset");
  }

  /// One step, to t_end at most. Returns where it ends.
  double step(double t_end) {
    check(ARKStepSetStopTime(arkode_.get(), t_end), "ARKStepSetStopTime");
    realtype start = 0, reached = t_end;
    check(ARKStepGetCurrentTime(arkode_.get(), &start), "ARKStepGetCurrentTime");
    const int flag = ARKStepEvolve(arkode_.get(), t_end, y_.get(), &reached, ARK_ONE_STEP);
    problem_.rethrow(flag, start, reached);
    check(flag, "ARKStepEvolve");
    return reached;
  }

  /// Steps of this length from here on.
  void set_step(double length) { check(ARKStepSetFixedStep(arkode_.get(), length), "ARKStepSetFixedStep"); }

  const double* y() const { return N_VGetArrayPointer(y_.get()); }

  StepCounts counts() const {
    long steps = 0, explicit_rhs = 0, implicit_rhs = 0, setups = 0, failures = 0, newton = 0;
    ARKStepGetNumSteps(arkode_.get(), &steps);
    ARKStepGetNumRhsEvals(arkode_.get(), &explicit_rhs, &implicit_rhs);
    ARKStepGetNumErrTestFails(arkode_.get(), &failures);
    ARKStepGetNumLinSolvSetups(arkode_.get(), &setups);
    ARKStepGetNumNonlinSolvIters(arkode_.get(), &newton);
    return {steps, explicit_rhs + implicit_rhs, problem_.jacobians(), setups, newton, failures};
  }

 private:
  void check(int flag, const char* function) const {
    if (flag >= 0) return;
    realtype t = 0, h = 0;
    ARKStepGetCurrentTime(arkode_.get(), &t);
    ARKStepGetLastStep(arkode_.get(), &h);
    sundials::fail("ARKODE", function, ARKStepGetReturnFlagName(flag), t, h);
  }

  static int linear_system(realtype t, N_Vector y, N_Vector, SUNMatrix, SUNMatrix, booleantype jacobian_is_current,
                           booleantype* jacobian_was_updated, realtype gamma, void* problem, N_Vector, N_Vector,
                           N_Vector) noexcept {
    return sundials::Problem::linear_system(t, y, jacobian_is_current, jacobian_was_updated, gamma, problem);
  }

  sundials::Context context_;
  sundials::Problem problem_;
  sundials::Vector y_;
  sundials::Memory<ARKStepFree> arkode_;
};

class ArkodeStepper final : public Stepper {
 public:
  ArkodeStepper(std::unique_ptr<Ode> ode, const ErrorScale& scale, const ButcherTables& tables)
      : within_(ode->another(), scale, tables), run_(std::move(ode), scale, tables), start_(run_.problem().size()) {}

  void restart(double t, const Eigen::VectorXd& y, std::span<const char> contact,
               std::span<const double> levels) override {
    run_.problem().set_contacts(contact);
    within_.problem().set_contacts(contact);
    crossings_.watch(levels);
    run_.restart(t, y.data());
    start_ = y;
    start_time_ = t;
  }

  void step(double t_end, double& t, Eigen::VectorXd& y, std::span<int> crossed) override {
    start_ = y;
    start_time_ = t;
    crossings_.begin(run_.problem(), start_time_, start_.data());
    const double reached = run_.step(t_end), length = reached - t;
    const auto state_at = [&](double c) { return state(start_time_ + c * length); };
    const double c = crossings_.first(run_.problem(), start_time_, length, run_.y(), state_at, crossed);
    t = c < 1 ? start_time_ + c * length : reached;
    const double* const end = c < 1 ? state(t) : run_.y();
    std::copy_n(end, y.size(), y.data());
  }

  void interpolate(std::span<const double> times, Eigen::MatrixXd& Y) override {
    for (size_t i = 0; i < times.size(); ++i)
      std::copy_n(state(times[i]), Y.rows(), Y.col(static_cast<Eigen::Index>(i)).data());
  }

  StepCounts counts() const override {
    StepCounts all = run_.counts();
    const StepCounts more = within_.counts();
    all.rhs_evaluations += more.rhs_evaluations;
    all.jacobian_evaluations += more.jacobian_evaluations;
    all.factorisations += more.factorisations;
    all.newton_iterations += more.newton_iterations;
    return all;
  }

 private:
  /// Within the last step: by one step of the method itself that ends there.
  const double* state(double t) {
    if (!(t > start_time_)) return start_.data();
    within_.restart(start_time_, start_.data());
    within_.set_step(t - start_time_);
    within_.step(t);
    return within_.y();
  }

  Arkode within_, run_;
  sundials::StepCrossings crossings_;
  Eigen::VectorXd start_;  // of the last step
  double start_time_ = 0;
};

}  // namespace

// Of ARKODE's implicit tables this took the least work on SPORT at tolerances from 1e-6 to 1e-10. Explicit ones are
// bound by stability there, whatever their order; elsewhere order pays.

std::unique_ptr<Stepper> make_arkode_implicit(std::unique_ptr<Ode> ode, const ErrorScale& scale) {
  return std::make_unique<ArkodeStepper>(std::move(ode), scale,
                                         ButcherTables{ARKODE_ARK548L2SA_DIRK_8_4_5, ARKODE_ERK_NONE});
}

std::unique_ptr<Stepper> make_arkode_explicit(std::unique_ptr<Ode> ode, const ErrorScale& scale) {
  return std::make_unique<ArkodeStepper>(std::move(ode), scale, ButcherTables{ARKODE_DIRK_NONE, ARKODE_VERNER_8_5_6});
}

}  // namespace flexboom
