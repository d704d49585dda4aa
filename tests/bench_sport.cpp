// Speed of the SPORT scene, 2 modes per boom: the right-hand side against plain dense assembly, the Newton matrix
// against differences, and whole runs with the error they reach. Every figure stands beside one that was timed in the
// same run.

#include "apps/accuracy/output_errors.hpp"
#include "dynamics/methods/ode.hpp"
#include "dynamics/numerics/rotation.hpp"

#include "tests/bench_hub.hpp"

#include <benchmark/benchmark.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace {

using namespace flexboom;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// The same accelerations the plain way: the mass matrices of eq. 7 as in dynamics/README.md, one dense projection, one
/// dense solve. Rows: omega, then the rates in the order of the state.
VectorXd plain_accelerations(const Tree& tree, const VectorXd& y) {
  const TreeState s = tree.unpack(y);
  const TreeLayout& l = tree.layout();
  const Multibody& scene = tree.scene();
  const auto found = std::ranges::find(scene.joints, JointKind::free, &Joint::kind);
  const ReducedBody& hub = scene.bodies[static_cast<size_t>(found->b.body)];
  const Vector3d omega = s.joints[static_cast<size_t>(found - scene.joints.begin())].omega;
  const Eigen::Index n = 3 + l.u;
  MatrixXd M = MatrixXd::Zero(n, n);
  VectorXd f = VectorXd::Zero(n);
  M.topLeftCorner<3, 3>() = hub.m * Matrix3d::Identity();
  M.block<3, 3>(3, 3) = hub.J0;
  f.segment<3>(3) = -omega.cross(hub.J0 * omega);
  for (size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    if (joint.kind == JointKind::free) continue;
    const auto body = static_cast<size_t>(joint.b.body);
    const ReducedBody& b = scene.bodies[body];
    const double angle = s.joints[i].coordinate[0], rate = s.joints[i].rate[0];
    const int modes = b.n(), at = 6 + l.joints[i].scalar;
    const Matrix3d C = (joint.a.axes * Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix()).transpose();
    const Vector3d w0 = C * omega, w = w0 + rate * Vector3d::UnitZ();
    const VectorXd &q = s.q[body], &v = s.q_dot[body];
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
    B.block<3, 3>(0, 3) = -C * tilde(joint.a.position);
    B.block<3, 3>(3, 3) = C;
    B(5, at) = 1;
    B.block(6, at + 1, modes, modes).setIdentity();
    VectorXd Q(size), bias = VectorXd::Zero(size);
    Q.head<3>() = -w.cross(w.cross(mc)) - 2 * w.cross(b.Ct * v);
    Q.segment<3>(3) = -w.cross(J * w) - J_dot * w - w.cross(Cr * v);
    Q.tail(modes) = force;
    bias.head<3>() = C * omega.cross(omega.cross(joint.a.position));
    bias.segment<3>(3) = w0.cross(rate * Vector3d::UnitZ());
    M += B.transpose() * Mb * B;
    f += B.transpose() * (Q - Mb * bias);
    f[at] += joint.mechanism.stiffness * (joint.mechanism.rest - angle) - joint.mechanism.damping * rate;
  }
  return M.ldlt().solve(f);
}

void RightHandSide(benchmark::State& state) {
  const SceneInFlight f = sport(static_cast<int>(state.range(0)));
  const VectorXd y = moving_state(f);
  VectorXd y_dot(y.size());
  const std::vector<char> contact = all_open(f);
  const auto work = f.tree.workspace();
  for (auto _ : state) {
    f.tree.derivative(0, y.data(), contact, *work, y_dot.data());
    benchmark::DoNotOptimize(y_dot.data());
  }
  const TreeLayout& l = f.tree.layout();
  const VectorXd plain = plain_accelerations(f.tree, y);
  state.counters["difference_from_plain"] = (plain.tail(l.u) - y_dot.segment(l.p, l.u)).norm() / plain.norm();
}
BENCHMARK(RightHandSide)->Arg(1)->Arg(2)->Arg(4)->Arg(8);

void RightHandSidePlain(benchmark::State& state) {
  const SceneInFlight f = sport(static_cast<int>(state.range(0)));
  const VectorXd y = moving_state(f);
  for (auto _ : state) benchmark::DoNotOptimize(plain_accelerations(f.tree, y).data());
}
BENCHMARK(RightHandSidePlain)->Arg(2);

void JacobianAndNewton(benchmark::State& state) {
  const SceneInFlight f = sport(2);
  const VectorXd y = moving_state(f);
  VectorXd b = VectorXd::Ones(y.size());
  const std::vector<char> open(f.tree.stops().size(), 0);
  const Laws no_laws;
  const auto ode = ode_of(f.tree, no_laws);
  for (auto _ : state) {
    ode->jacobian(0, y.data(), open);
    ode->factorise(1e-4);
    ode->solve(b.data(), b.data());
    benchmark::DoNotOptimize(b.setOnes().data());
  }
}
BENCHMARK(JacobianAndNewton);

/// The same by differences, with a dense matrix of all unknowns, as CVODE's own dense solver would.
void JacobianAndNewtonPlain(benchmark::State& state) {
  const SceneInFlight f = sport(2);
  VectorXd y = moving_state(f), y_dot(y.size());
  VectorXd b = VectorXd::Ones(y.size());
  const std::vector<char> contact = all_open(f);
  const auto work = f.tree.workspace();
  MatrixXd J = MatrixXd::Zero(y.size(), y.size());
  for (auto _ : state) {
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      f.tree.derivative(0, y.data(), contact, *work, y_dot.data());
      J.col(i) = 1e-3 * y_dot;
    }
    benchmark::DoNotOptimize((MatrixXd::Identity(b.size(), b.size()) - 1e-4 * J).lu().solve(b).eval().data());
  }
}
BENCHMARK(JacobianAndNewtonPlain);

/// Largest error over 10 s of an output against the converged run.
double error_of(const OutputTable& run, const OutputTable& reference, const std::string& output) {
  return compare_outputs(run, reference, {output}).at(0).error;
}

const OutputTable& converged() {
  static const OutputTable table = [] {
    const SceneInFlight f = sport(2);
    IntegratorOptions o;
    o.method = "bdf";
    o.tolerance = 1e-11;
    return f.outputs(o);
  }();
  return table;
}

/// 10 s of SPORT; the argument is -log10 of the tolerance.
void TenSeconds(benchmark::State& state, const char* method) {
  const SceneInFlight f = sport(2);
  IntegratorOptions o;
  o.method = method;
  o.tolerance = std::pow(10.0, -static_cast<double>(state.range(0)));
  TreeTrajectory r;
  for (auto _ : state) r = f.fly(o);
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
  const SceneInFlight f = sport(static_cast<int>(state.range(0)));
  IntegratorOptions o;
  o.method = "exponential";
  o.duration = static_cast<double>(state.range(1));
  TreeTrajectory r;
  for (auto _ : state) r = f.fly(o);
  const OutputTable table = f.outputs(o);
  o.tolerance = 1e-9;
  state.counters["largest"] = largest(compare_outputs(table, f.outputs(o), {}));
  state.counters["coordinates"] = 6 + f.tree.layout().p;
  state.counters["steps"] = static_cast<double>(r.summary.steps);
  state.counters["evaluations"] = static_cast<double>(r.summary.rhs_evaluations);
}
BENCHMARK(MoreModes)->ArgsProduct({{1, 2, 4, 8, 16}, {10, 100}})->Unit(benchmark::kMillisecond);

}  // namespace
