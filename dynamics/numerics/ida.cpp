#include "dynamics/numerics/ida.hpp"

#include "dynamics/numerics/sundials.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <ida/ida.h>
#include <ida/ida_ls.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace flexboom {

struct Ida::Impl {
  DaeProblem& problem;
  sundials::Context context;
  sundials::Vector y, y_dot, id, out;
  sundials::Matrix matrix;
  sundials::LinearSolver solver;
  sundials::NonlinearSolver nonlinear;
  sundials::Memory<IDAFree> ida;
  double last_correction = 0;
  bool fresh = false;  // the matrix is of this step
  std::exception_ptr error;
  DaeCounts past;
  bool started = false;

  explicit Impl(DaeProblem& of) : problem(of) {
    const auto n = static_cast<sunindextype>(problem.size());
    for (sundials::Vector* v : {&y, &y_dot, &id}) v->reset(N_VNew_Serial(n, context.context));
    out.reset(N_VNewEmpty_Serial(n, context.context));
    matrix.reset(SUNSparseMatrix(n, n, static_cast<sunindextype>(problem.rows().size()), CSC_MAT, context.context));
    solver.reset(SUNLinSol_KLU(y.get(), matrix.get(), context.context));
    ida.reset(IDACreate(context.context));
    if (!ida || !y || !y_dot || !id || !out || !matrix || !solver) throw NumericalError("SUNDIALS: out of memory");
    Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(id.get()), n) = problem.differential();
    check(IDASetErrHandlerFn(ida.get(), sundials::quiet, nullptr), "IDASetErrHandlerFn");
    check(IDAInit(ida.get(), &Impl::residual, 0.0, y.get(), y_dot.get()), "IDAInit");
    check(IDASetUserData(ida.get(), this), "IDASetUserData");
    check(IDAWFtolerances(ida.get(), &Impl::weights), "IDAWFtolerances");
    check(IDASetId(ida.get(), id.get()), "IDASetId");
    check(IDASetSuppressAlg(ida.get(), SUNTRUE), "IDASetSuppressAlg");
    check(IDASetLinearSolver(ida.get(), solver.get(), matrix.get()), "IDASetLinearSolver");
    check(IDASetJacFn(ida.get(), &Impl::jacobian), "IDASetJacFn");
    // Algebraic rows do not scale with 1 / h: corrections by an old matrix must not be scaled either.
    check(IDASetLinearSolutionScaling(ida.get(), SUNFALSE), "IDASetLinearSolutionScaling");
    nonlinear.reset(SUNNonlinSol_Newton(y.get(), context.context));
    check(IDASetNonlinearSolver(ida.get(), nonlinear.get()), "IDASetNonlinearSolver");
    check(SUNNonlinSolSetConvTestFn(nonlinear.get(), &Impl::converged, this), "SUNNonlinSolSetConvTestFn");
    check(SUNNonlinSolSetMaxIters(nonlinear.get(), 7), "SUNNonlinSolSetMaxIters");
    check(IDASetMaxNumSteps(ida.get(), -1), "IDASetMaxNumSteps");
    if (problem.roots() > 0) check(IDARootInit(ida.get(), problem.roots(), &Impl::roots), "IDARootInit");
    check(IDASetNoInactiveRootWarn(ida.get()), "IDASetNoInactiveRootWarn");
  }

  void check(int flag, const char* function) const {
    if (flag >= 0) return;
    realtype t = 0, h = 0;
    IDAGetCurrentTime(ida.get(), &t);
    IDAGetLastStep(ida.get(), &h);
    sundials::fail("IDA", function, IDAGetReturnFlagName(flag), t, h);
  }

  template <class Call>
  static int guarded(void* user, const Call& call) noexcept {
    Impl& self = *static_cast<Impl*>(user);
    try {
      call(self);
      return 0;
    } catch (...) {
      self.error = std::current_exception();
      return -1;
    }
  }

  static int residual(realtype t, N_Vector y, N_Vector y_dot, N_Vector F, void* user) noexcept {
    return guarded(user, [&](Impl& self) {
      self.problem.residual(t, N_VGetArrayPointer(y), N_VGetArrayPointer(y_dot), N_VGetArrayPointer(F));
    });
  }

  static int jacobian(realtype t, realtype c, N_Vector y, N_Vector y_dot, N_Vector, SUNMatrix J, void* user, N_Vector,
                      N_Vector, N_Vector) noexcept {
    return guarded(user, [&](Impl& self) {
      self.fresh = true;
      std::ranges::copy(self.problem.column_starts(), SUNSparseMatrix_IndexPointers(J));
      std::ranges::copy(self.problem.rows(), SUNSparseMatrix_IndexValues(J));
      self.problem.newton_matrix(t, c, N_VGetArrayPointer(y), N_VGetArrayPointer(y_dot), SUNSparseMatrix_Data(J));
    });
  }

  static int weights(N_Vector, N_Vector w, void* user) noexcept {
    return guarded(user, [&](Impl& self) { self.problem.weights(N_VGetArrayPointer(w)); });
  }

  static int roots(realtype t, N_Vector y, N_Vector, realtype* values, void* user) noexcept {
    return guarded(user, [&](Impl& self) { self.problem.root_values(t, N_VGetArrayPointer(y), values); });
  }

  /// Constraints hold to what Newton's method leaves. So it must not stop after one correction because earlier steps
  /// converged well, as IDA's own test does. It must also stop where corrections are round-off.
  static int converged(SUNNonlinearSolver solver, N_Vector, N_Vector correction, realtype, N_Vector weights,
                       void* user) noexcept {
    constexpr double left = 1e-4, negligible = 1e-5, small = 3e-3, round_off = 0.3;  // of the error allowed per step
    constexpr double old_matrix = 0.1;  // slower convergence asks for a new matrix: IDA itself would keep it for ever
    Impl& self = *static_cast<Impl*>(user);
    int iteration = 0;
    SUNNonlinSolGetCurIter(solver, &iteration);
    const double size = N_VWrmsNorm(correction, weights);
    const double rate = iteration == 0 ? 1 : size / self.last_correction;
    self.last_correction = size;
    const auto success = [&] {
      self.fresh = false;
      return SUN_NLS_SUCCESS;
    };
    if (size <= negligible) return success();
    if (iteration == 0) return SUN_NLS_CONTINUE;
    if (rate < 1 && size * std::max(rate, old_matrix) <= left * (1 - rate)) return success();
    if (rate > old_matrix && !self.fresh && size >= small) return SUN_NLS_CONV_RECVR;
    if (rate <= 0.5) return SUN_NLS_CONTINUE;
    if (size < (self.fresh ? round_off : small) && iteration > 1) return success();
    return rate > 0.95 && size >= round_off ? SUN_NLS_CONV_RECVR : SUN_NLS_CONTINUE;
  }

  /// Since the last start.
  DaeCounts counts() const {
    DaeCounts c;
    IDAGetNumSteps(ida.get(), &c.steps);
    IDAGetNumResEvals(ida.get(), &c.residual_evaluations);
    IDAGetNumLinSolvSetups(ida.get(), &c.factorisations);
    IDAGetNumErrTestFails(ida.get(), &c.error_test_failures);
    IDAGetNumNonlinSolvIters(ida.get(), &c.newton_iterations);
    IDAGetNumNonlinSolvConvFails(ida.get(), &c.convergence_failures);
    return c;
  }
};

DaeCounts& DaeCounts::operator+=(const DaeCounts& c) {
  steps += c.steps, residual_evaluations += c.residual_evaluations, factorisations += c.factorisations;
  newton_iterations += c.newton_iterations, error_test_failures += c.error_test_failures;
  convergence_failures += c.convergence_failures;
  return *this;
}

Ida::Ida(DaeProblem& problem) : impl_(std::make_unique<Impl>(problem)) {}
Ida::~Ida() = default;

void Ida::restart(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& y_dot) {
  Impl& s = *impl_;
  s.error = nullptr;
  Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(s.y.get()), y.size()) = y;
  Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(s.y_dot.get()), y.size()) = y_dot;
  if (s.started) s.past += s.counts();
  s.started = true;
  s.check(IDAReInit(s.ida.get(), t, s.y.get(), s.y_dot.get()), "IDAReInit");
}

void Ida::step(double t_end, double& t, Eigen::VectorXd& y, std::span<int> crossed) {
  Impl& s = *impl_;
  s.check(IDASetStopTime(s.ida.get(), t_end), "IDASetStopTime");
  realtype reached = t;
  const int flag = IDASolve(s.ida.get(), t_end, &reached, s.y.get(), s.y_dot.get(), IDA_ONE_STEP);
  if (s.error) std::rethrow_exception(std::exchange(s.error, nullptr));
  s.check(flag, "IDASolve");
  t = reached;
  y = Eigen::Map<const Eigen::VectorXd>(N_VGetArrayPointer(s.y.get()), y.size());
  std::fill(crossed.begin(), crossed.end(), 0);
  if (flag == IDA_ROOT_RETURN) s.check(IDAGetRootInfo(s.ida.get(), crossed.data()), "IDAGetRootInfo");
}

void Ida::interpolate(double t, Eigen::VectorXd& y) {
  Impl& s = *impl_;
  N_VSetArrayPointer(y.data(), s.out.get());
  s.check(IDAGetDky(s.ida.get(), t, 0, s.out.get()), "IDAGetDky");
}

DaeCounts Ida::counts() const {
  DaeCounts c = impl_->past;
  if (impl_->started) c += impl_->counts();
  return c;
}

}  // namespace flexboom
