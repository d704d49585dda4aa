#include "dynamics/numerics/ida.hpp"

#include "dynamics/numerics/sundials.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <ida/ida.h>
#include <ida/ida_ls.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_dense.h>
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
  double last_correction = 0;
  bool fresh = false;  // the matrix is of this step
  void* ida = nullptr;
  std::exception_ptr error;
  DaeCounts past;
  bool started = false;

  Impl(DaeProblem& of, const std::string& linear_solver) : problem(of) {
    const auto n = static_cast<sunindextype>(problem.size());
    for (sundials::Vector* v : {&y, &y_dot, &id}) v->reset(N_VNew_Serial(n, context.context));
    out.reset(N_VNewEmpty_Serial(n, context.context));
    make_solver(linear_solver, n);
    ida = IDACreate(context.context);
    if (ida == nullptr || !y || !y_dot || !id || !out || !matrix || !solver)
      throw NumericalError("SUNDIALS: out of memory");
    Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(id.get()), n) = problem.differential();
    check(IDASetErrHandlerFn(ida, sundials::quiet, nullptr), "IDASetErrHandlerFn");
    check(IDAInit(ida, &Impl::residual, 0.0, y.get(), y_dot.get()), "IDAInit");
    check(IDASetUserData(ida, this), "IDASetUserData");
    check(IDAWFtolerances(ida, &Impl::weights), "IDAWFtolerances");
    check(IDASetId(ida, id.get()), "IDASetId");
    check(IDASetSuppressAlg(ida, SUNTRUE), "IDASetSuppressAlg");
    check(IDASetLinearSolver(ida, solver.get(), matrix.get()), "IDASetLinearSolver");
    check(IDASetJacFn(ida, &Impl::jacobian), "IDASetJacFn");
    // Algebraic rows do not scale with 1 / h: corrections by an old matrix must not be scaled either.
    check(IDASetLinearSolutionScaling(ida, SUNFALSE), "IDASetLinearSolutionScaling");
    nonlinear.reset(SUNNonlinSol_Newton(y.get(), context.context));
    check(IDASetNonlinearSolver(ida, nonlinear.get()), "IDASetNonlinearSolver");
    check(SUNNonlinSolSetConvTestFn(nonlinear.get(), &Impl::converged, this), "SUNNonlinSolSetConvTestFn");
    check(SUNNonlinSolSetMaxIters(nonlinear.get(), 7), "SUNNonlinSolSetMaxIters");
    check(IDASetMaxNumSteps(ida, -1), "IDASetMaxNumSteps");
    if (problem.roots() > 0) check(IDARootInit(ida, problem.roots(), &Impl::roots), "IDARootInit");
    check(IDASetNoInactiveRootWarn(ida), "IDASetNoInactiveRootWarn");
  }
  ~Impl() { IDAFree(&ida); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void make_solver(const std::string& name, sunindextype n) {
    if (name == "dense") {
      matrix.reset(SUNDenseMatrix(n, n, context.context));
      solver.reset(SUNLinSol_Dense(y.get(), matrix.get(), context.context));
    } else if (name == "klu") {
      const auto entries = static_cast<sunindextype>(problem.rows().size());
      matrix.reset(SUNSparseMatrix(n, n, entries, CSC_MAT, context.context));
      solver.reset(SUNLinSol_KLU(y.get(), matrix.get(), context.context));
    } else {
      throw InputError(fmt::format("linear solver '{}' is not known; there are: 'klu' 'dense'", name));
    }
  }

  void check(int flag, const char* function) const {
    if (flag >= 0) return;
    realtype t = 0, h = 0;
    if (ida != nullptr) {
      IDAGetCurrentTime(ida, &t);
      IDAGetLastStep(ida, &h);
    }
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
      double* values = nullptr;
      if (SUNMatGetID(J) == SUNMATRIX_SPARSE) {
        std::copy(self.problem.column_starts().begin(), self.problem.column_starts().end(),
                  SUNSparseMatrix_IndexPointers(J));
        std::copy(self.problem.rows().begin(), self.problem.rows().end(), SUNSparseMatrix_IndexValues(J));
        values = SUNSparseMatrix_Data(J);
      } else {
        values = SUNDenseMatrix_Data(J);
      }
      self.problem.newton_matrix(t, c, N_VGetArrayPointer(y), N_VGetArrayPointer(y_dot), values);
    });
  }

  static int weights(N_Vector, N_Vector w, void* user) noexcept {
    return guarded(user, [&](Impl& self) { self.problem.weights(N_VGetArrayPointer(w)); });
  }

  static int roots(realtype t, N_Vector y, N_Vector, realtype* values, void* user) noexcept {
    return guarded(user, [&](Impl& self) { self.problem.root_values(t, N_VGetArrayPointer(y), values); });
  }

  /// Constraints hold to what Newton's method leaves, so it must not stop after one correction because earlier steps
  /// converged well (IDA's own test does), and it must stop where corrections are round-off.
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

  void add_counts(DaeCounts& c) const {
    long steps = 0, residuals = 0, setups = 0, failures = 0, newton = 0, convergence = 0;
    IDAGetNumSteps(ida, &steps);
    IDAGetNumResEvals(ida, &residuals);
    IDAGetNumLinSolvSetups(ida, &setups);
    IDAGetNumErrTestFails(ida, &failures);
    IDAGetNumNonlinSolvIters(ida, &newton);
    IDAGetNumNonlinSolvConvFails(ida, &convergence);
    c.steps += steps;
    c.residual_evaluations += residuals;
    c.factorisations += setups;
    c.error_test_failures += failures;
    c.newton_iterations += newton;
    c.convergence_failures += convergence;
  }
};

Ida::Ida(DaeProblem& problem, const std::string& linear_solver)
    : impl_(std::make_unique<Impl>(problem, linear_solver)) {}
Ida::~Ida() = default;

void Ida::restart(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& y_dot) {
  Impl& s = *impl_;
  Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(s.y.get()), y.size()) = y;
  Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(s.y_dot.get()), y.size()) = y_dot;
  if (s.started) s.add_counts(s.past);
  s.started = true;
  s.check(IDAReInit(s.ida, t, s.y.get(), s.y_dot.get()), "IDAReInit");
}

void Ida::step(double t_end, double& t, Eigen::VectorXd& y, std::span<int> crossed) {
  Impl& s = *impl_;
  s.check(IDASetStopTime(s.ida, t_end), "IDASetStopTime");
  realtype reached = t;
  const int flag = IDASolve(s.ida, t_end, &reached, s.y.get(), s.y_dot.get(), IDA_ONE_STEP);
  if (s.error) std::rethrow_exception(std::exchange(s.error, nullptr));
  s.check(flag, "IDASolve");
  t = reached;
  y = Eigen::Map<const Eigen::VectorXd>(N_VGetArrayPointer(s.y.get()), y.size());
  std::fill(crossed.begin(), crossed.end(), 0);
  if (flag == IDA_ROOT_RETURN) s.check(IDAGetRootInfo(s.ida, crossed.data()), "IDAGetRootInfo");
}

void Ida::interpolate(double t, Eigen::VectorXd& y) {
  Impl& s = *impl_;
  N_VSetArrayPointer(y.data(), s.out.get());
  s.check(IDAGetDky(s.ida, t, 0, s.out.get()), "IDAGetDky");
}

DaeCounts Ida::counts() const {
  DaeCounts c = impl_->past;
  if (impl_->started) impl_->add_counts(c);
  return c;
}

}  // namespace flexboom
