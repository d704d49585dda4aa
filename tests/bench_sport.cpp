// Speed of the SPORT scene, 2 modes per boom: the right-hand side against plain dense assembly, the Jacobian against
// differences, and whole runs with the error they reach. Every figure stands beside one that was timed in the same run.

#include "dynamics/integrator.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/workspace.hpp"

#include "tests/bench_hub.hpp"

#include <benchmark/benchmark.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <cmath>

namespace {

using namespace flexboom;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// The same accelerations the plain way: the mass matrices of eq. 7 as in dynamics/README.md, one dense
/// projection, one dense solve.
VectorXd plain_accelerations(const System& system, const VectorXd& y, const std::vector<char>& contact) {
  const State s = system.unpack(y);
  const Layout& l = system.layout();
  const Eigen::Index n = 3 + l.u;
  MatrixXd M = MatrixXd::Zero(n, n);
  VectorXd f = VectorXd::Zero(n);
  M.topLeftCorner<3, 3>() = system.hub().m * Matrix3d::Identity();
  M.block<3, 3>(3, 3) = system.hub().J0;
  f.segment<3>(3) = -s.omega.cross(system.hub().J0 * s.omega);
  for (size_t i = 0; i < system.appendages().size(); ++i) {
    const Appendage& a = system.appendages()[i];
    const ReducedBody& b = a.body;
    const int modes = b.n(), at = 6 + l.body[i];
    const Matrix3d C = system.boom_to_hub(static_cast<int>(i), s.angle[i]).transpose();
    const Vector3d w0 = C * s.omega, w = w0 + s.rate[i] * Vector3d::UnitZ();
    const VectorXd &q = s.q[i], &v = s.q_dot[i];
    Vector3d mc = b.mc0 + b.Ct * q;
    Matrix3d J = b.J0, J_dot = Matrix3d::Zero();
    Eigen::Matrix3Xd Cr = b.Cr0;
    VectorXd force = -b.Ke * q - b.De * v;
    for (int k = 0; k < modes; ++k) {
      const auto ku = static_cast<size_t>(k);
      Matrix3d slope = b.J1[ku];
      J += q[k] * b.J1[ku];
      Cr += q[k] * b.Cr1[ku];
      for (int m = 0; m < modes; ++m) {
        J += q[k] * q[m] * b.J2[ku][static_cast<size_t>(m)];
        slope += 2 * q[m] * b.J2[ku][static_cast<size_t>(m)];
      }
      J_dot += v[k] * slope;
      force[k] += 0.5 * w.dot(slope * w) + 2 * w.dot(b.Cr1[ku] * v);
    }
    const int size = 6 + modes;
    MatrixXd Mb = MatrixXd::Zero(size, size), B = MatrixXd::Zero(size, n);
    Mb.topLeftCorner<3, 3>() = b.m * Matrix3d::Identity();
    Mb.block<3, 3>(0, 3) = -tilde(mc);
    Mb.block<3, 3>(3, 0) = tilde(mc);
    Mb.block<3, 3>(3, 3) = J;
    Mb.block(0, 6, 3, modes) = b.Ct;
    Mb.block(6, 0, modes, 3) = b.Ct.transpose();
    Mb.block(3, 6, 3, modes) = Cr;
    Mb.block(6, 3, modes, 3) = Cr.transpose();
    Mb.block(6, 6, modes, modes) = b.Me;
    B.block<3, 3>(0, 0) = C;
    B.block<3, 3>(0, 3) = -C * tilde(a.hinge.point);
    B.block<3, 3>(3, 3) = C;
    B(5, at) = 1;
    B.block(6, at + 1, modes, modes).setIdentity();
    VectorXd Q(size), bias = VectorXd::Zero(size);
    Q.head<3>() = -w.cross(w.cross(mc)) - 2 * w.cross(b.Ct * v);
    Q.segment<3>(3) = -w.cross(J * w) - J_dot * w - w.cross(Cr * v);
    Q.tail(modes) = force;
    bias.head<3>() = C * s.omega.cross(s.omega.cross(a.hinge.point));
    bias.segment<3>(3) = w0.cross(s.rate[i] * Vector3d::UnitZ());
    M += B.transpose() * Mb * B;
    f += B.transpose() * (Q - Mb * bias);
    const HingeMechanism& h = a.hinge.mechanism;
    f[at] += h.stiffness * (h.rest - s.angle[i]) - h.damping * s.rate[i] -
             (contact[i] ? h.stop_stiffness * (s.angle[i] - h.threshold) : 0);
  }
  return M.ldlt().solve(f);
}

void RightHandSide(benchmark::State& state) {
  const HubInFlight f = sport(static_cast<int>(state.range(0)));
  const VectorXd y = moving_state(f);
  VectorXd y_dot(y.size());
  const std::vector<char> contact(4, 0);
  const auto work = f.system.workspace();
  for (auto _ : state) {
    f.system.derivative(y.data(), contact, *work, y_dot.data());
    benchmark::DoNotOptimize(y_dot.data());
  }
  const Layout& l = f.system.layout();
  const VectorXd plain = plain_accelerations(f.system, y, contact);
  state.counters["difference_from_plain"] = (plain.tail(l.u) - y_dot.segment(l.p, l.u)).norm() / plain.norm();
}
BENCHMARK(RightHandSide)->Arg(1)->Arg(2)->Arg(4)->Arg(8);

void RightHandSidePlain(benchmark::State& state) {
  const HubInFlight f = sport(static_cast<int>(state.range(0)));
  const VectorXd y = moving_state(f);
  const std::vector<char> contact(4, 0);
  for (auto _ : state) benchmark::DoNotOptimize(plain_accelerations(f.system, y, contact).data());
}
BENCHMARK(RightHandSidePlain)->Arg(2);

void Jacobian(benchmark::State& state) {
  const HubInFlight f = sport(2);
  const VectorXd y = moving_state(f);
  const std::vector<char> contact(4, 0);
  const auto work = f.system.workspace();
  for (auto _ : state) f.system.jacobian(y.data(), contact, *work);
}
BENCHMARK(Jacobian);

void JacobianByDifferences(benchmark::State& state) {
  const HubInFlight f = sport(2);
  VectorXd y = moving_state(f), y_dot(y.size());
  const std::vector<char> contact(4, 0);
  const auto work = f.system.workspace();
  for (auto _ : state)
    for (Eigen::Index i = 0; i < y.size(); ++i) f.system.derivative(y.data(), contact, *work, y_dot.data());
}
BENCHMARK(JacobianByDifferences);

void NewtonFactoriseAndSolve(benchmark::State& state) {
  const HubInFlight f = sport(2);
  const VectorXd y = moving_state(f);
  VectorXd b = VectorXd::Ones(y.size());
  const std::vector<char> contact(4, 0);
  const auto work = f.system.workspace();
  f.system.jacobian(y.data(), contact, *work);
  for (auto _ : state) {
    f.system.factorise_newton(1e-4, *work);
    f.system.solve_newton(b.data(), *work, b.data());
    benchmark::DoNotOptimize(b.setOnes().data());
  }
}
BENCHMARK(NewtonFactoriseAndSolve);

/// The same with a dense matrix of all unknowns, as CVODE's own dense solver would.
void NewtonDense(benchmark::State& state) {
  const HubInFlight f = sport(2);
  const VectorXd y = moving_state(f);
  VectorXd b = VectorXd::Ones(y.size());
  const std::vector<char> contact(4, 0);
  const auto work = f.system.workspace();
  f.system.jacobian(y.data(), contact, *work);
  const MatrixXd J = f.system.dense_jacobian(*work);
  for (auto _ : state)
    benchmark::DoNotOptimize((MatrixXd::Identity(b.size(), b.size()) - 1e-4 * J).lu().solve(b).eval().data());
}
BENCHMARK(NewtonDense);

/// Largest error over 10 s of an output against the converged run.
double error_of(const OutputTable& run, const OutputTable& reference, const std::string& output) {
  return compare_outputs(run, reference, {output}).at(0).error;
}

const OutputTable& converged() {
  static const OutputTable table = [] {
    const HubInFlight f = sport(2);
    IntegratorOptions o;
    o.method = "bdf";
    o.tolerance = 1e-11;
    return f.outputs(o);
  }();
  return table;
}

/// 10 s of SPORT; the argument is -log10 of the tolerance.
void TenSeconds(benchmark::State& state, const char* method) {
  const HubInFlight f = sport(2);
  IntegratorOptions o;
  o.method = method;
  o.tolerance = std::pow(10.0, -static_cast<double>(state.range(0)));
  Trajectory r;
  for (auto _ : state) r = integrate(f.system, f.y0, o);
  const OutputTable table = f.outputs(o);
  state.counters["hub.rotation"] = error_of(table, converged(), "hub.rotation");
  state.counters["slp.q"] = error_of(table, converged(), "slp.q");
  state.counters["largest"] = largest(compare_outputs(table, converged(), {}));
  state.counters["steps"] = static_cast<double>(r.summary.steps);
  state.counters["evaluations"] = static_cast<double>(r.summary.rhs_evaluations);
  state.counters["events"] = static_cast<double>(r.events.size());
  state.counters["us_per_evaluation"] =
      benchmark::Counter(1e-6 * static_cast<double>(r.summary.rhs_evaluations),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(TenSeconds, exponential, "exponential")->DenseRange(2, 9, 1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(TenSeconds, bdf, "bdf")->DenseRange(3, 9, 2)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(TenSeconds, dirk, "dirk")->DenseRange(3, 9, 2)->Unit(benchmark::kMillisecond);

/// The same with more modes (the fastest eigenvalue grows from 5e4 to 2e7 1/s), for so many seconds: the contacts are
/// in the first ten.
void MoreModes(benchmark::State& state) {
  const HubInFlight f = sport(static_cast<int>(state.range(0)));
  IntegratorOptions o;
  o.duration = static_cast<double>(state.range(1));
  Trajectory r;
  for (auto _ : state) r = integrate(f.system, f.y0, o);
  const OutputTable table = f.outputs(o);
  o.tolerance = 1e-9;
  state.counters["largest"] = largest(compare_outputs(table, f.outputs(o), {}));
  state.counters["coordinates"] = 6 + f.system.layout().p;
  state.counters["steps"] = static_cast<double>(r.summary.steps);
  state.counters["evaluations"] = static_cast<double>(r.summary.rhs_evaluations);
}
BENCHMARK(MoreModes)->ArgsProduct({{1, 2, 4, 8, 16}, {10, 100}})->Unit(benchmark::kMillisecond);

}  // namespace
