#include "dynamics/environment/encke.hpp"

#include "dynamics/numerics/sundials.hpp"
#include "fem/base/check.hpp"

#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <utility>

namespace flexboom {
namespace {

using Eigen::Map;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

void check(int flag, const char* function) {
  if (flag < 0) throw NumericalError(fmt::format("orbit: {} of SUNDIALS returned {}", function, flag));
}

/// CVODE on the difference from one arc after the other.
class Encke {
 public:
  Encke(const Planet& planet, const OrbitState& start, double duration, double tolerance)
      : planet_(planet), duration_(duration) {
    path_.arcs.push_back({0, start});
    for (sundials::Vector* vector : {&y_, &scale_, &term_}) vector->reset(N_VNew_Serial(6, context_.context));
    solver_.reset(SUNNonlinSol_FixedPoint(y_.get(), 0, context_.context));
    cvode_.reset(CVodeCreate(CV_ADAMS, context_.context));
    if (!y_ || !scale_ || !term_ || !solver_ || !cvode_) throw NumericalError("SUNDIALS: out of memory");
    difference(y_.get()).setZero();
    difference(scale_.get()).head<3>().setConstant(tolerance * start.position.norm());
    difference(scale_.get()).tail<3>().setConstant(tolerance * start.velocity.norm());
    check(CVodeSetErrHandlerFn(cvode_.get(), sundials::quiet, nullptr), "CVodeSetErrHandlerFn");
    check(CVodeInit(cvode_.get(), &Encke::derivative, 0.0, y_.get()), "CVodeInit");
    check(CVodeSVtolerances(cvode_.get(), 0.0, scale_.get()), "CVodeSVtolerances");
    check(CVodeSetUserData(cvode_.get(), this), "CVodeSetUserData");
    check(CVodeSetNonlinearSolver(cvode_.get(), solver_.get()), "CVodeSetNonlinearSolver");
  }

  EnckePath path() {
    const double largest = 0.01 * path_.arcs[0].start.position.norm();
    for (double t = 0; t < duration_;) {
      check(CVode(cvode_.get(), 2 * duration_, y_.get(), &t, CV_ONE_STEP), "CVode");
      keep_step(t);
      if (difference(y_.get()).head<3>().norm() > largest) new_arc(t);
    }
    return std::move(path_);
  }

 private:
  static Map<Vector6d> difference(N_Vector v) { return Map<Vector6d>(N_VGetArrayPointer(v)); }

  /// d'' = [g0(r + d) - g0(r)] + J2 term(r + d), g0 the gravity of the point mass that r follows.
  static int derivative(double t, N_Vector y, N_Vector y_dot, void* user) noexcept {
    const Encke& self = *static_cast<const Encke*>(user);
    const EnckeArc& arc = self.path_.arcs.back();
    const OrbitState r = kepler(self.planet_.mu, arc.start, t - arc.begin);
    const Vector3d d = difference(y).head<3>();
    difference(y_dot).head<3>() = difference(y).tail<3>();
    difference(y_dot).tail<3>() =
        differential_gravity({.mu = self.planet_.mu}, r.position, d) + oblateness_gravity(self.planet_, r.position + d);
    return 0;
  }

  void keep_step(double t) {
    int order = 0;
    check(CVodeGetLastOrder(cvode_.get(), &order), "CVodeGetLastOrder");
    EnckeStep step{t, static_cast<int>(path_.arcs.size()) - 1, {}};
    step.c.resize(6, order + 1);
    double factorial = 1;
    for (int k = 0; k <= order; factorial *= ++k) {
      check(CVodeGetDky(cvode_.get(), t, k, term_.get()), "CVodeGetDky");
      step.c.col(k) = difference(term_.get()) / factorial;
    }
    path_.steps.push_back(std::move(step));
  }

  void new_arc(double t) {
    const EnckeArc& arc = path_.arcs.back();
    OrbitState s = kepler(planet_.mu, arc.start, t - arc.begin);
    s.position += difference(y_.get()).head<3>();
    s.velocity += difference(y_.get()).tail<3>();
    path_.arcs.push_back({t, s});
    difference(y_.get()).setZero();
    check(CVodeReInit(cvode_.get(), t, y_.get()), "CVodeReInit");
  }

  const Planet& planet_;
  double duration_;
  EnckePath path_;
  sundials::Context context_;
  sundials::Vector y_, scale_, term_;
  sundials::NonlinearSolver solver_;
  sundials::Memory<CVodeFree> cvode_;
};

}  // namespace

EnckePath encke_path(const Planet& planet, const OrbitState& start, double duration, double tolerance) {
  return Encke(planet, start, duration, tolerance).path();
}

}  // namespace flexboom
