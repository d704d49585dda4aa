#include "dynamics/inner_loop.hpp"
#include "dynamics/system_impl.hpp"
#include "fem/check.hpp"
#include "reduction/tilde.hpp"

#include <Eigen/Cholesky>

#include <algorithm>

namespace flexboom {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using spatial::Vec3;

namespace {

/// Where an input of bodies side by side stands among the columns (p, u), lane by lane: their own Delta and q, the
/// rates of these, omega.
struct Inputs {
  int size = 0;  // 1 + n
  int p = 0;     // of the layout
  int base = 0;

  int count() const { return 2 * size + base; }
  bool of_hub(int input) const { return input >= 2 * size; }
  int column(int input, int at) const {
    if (of_hub(input)) return p + input - 2 * size;
    return input < size ? at + input : p + base + at + input - size;
  }
};

template <int N, class V>
auto direction(const Dual<N, V>& a, int i) {
  return V(a.d[i]);
}

template <int N, class V>
void seed(Dual<N, V>& a, int i) {
  a.d[i] = 1;
}

/// Slopes of the equations of bodies side by side at given accelerations of the hub, by their own unknowns and by
/// omega, N at a time: of the hub's equations to `hub`, of their own to `own` (rows: as p).
template <class C, int N>
void slopes(const equations::SideBySide<C>& bodies, const double* p, const double* u, const Layout& l,
            std::span<const char> contact, const Vec3<double>& a_hub, const Vec3<double>& alpha_hub,
            equations::SideBySideScratch<Dual<N, C>>& s, MatrixXd& hub, Eigen::Ref<MatrixXd> own) {
  using D = Dual<N, C>;
  const Inputs inputs = {1 + bodies.body.n, l.p, l.base};
  const C closed = equations::closed_stops(bodies, contact);
  for (int first = 0; first < inputs.count(); first += N) {
    const int count = std::min(N, inputs.count() - first);
    equations::load(bodies, p, u + l.base, s);
    Vec3<D> w = l.base ? Vec3<D>{D(u[0]), D(u[1]), D(u[2])} : Vec3<D>{};
    for (int j = 0; j < count; ++j) {
      const int input = first + j;
      if (inputs.of_hub(input))
        seed(component(w, input - 2 * inputs.size), j);
      else
        seed(input < inputs.size ? s.p[static_cast<size_t>(input)] : s.u[static_cast<size_t>(input - inputs.size)], j);
    }
    equations::HubSystem<D> part;
    equations::condense(bodies.body, w, s.p.data(), s.u.data(), closed, s.body, l.base == 0, part);
    equations::release(bodies.body, s.body, a_hub, alpha_hub, s.out.data());
    const Vec3<D> t = part.ft - (part.tt * a_hub + part.tw * alpha_hub);
    const Vec3<D> r = part.fw - (transposed_product(part.tw, a_hub) + part.ww * alpha_hub);
    for (int j = 0; j < count; ++j) {
      const C six[] = {direction(t.x, j), direction(t.y, j), direction(t.z, j),
                       direction(r.x, j), direction(r.y, j), direction(r.z, j)};
      for (int i = 0; i < bodies.count; ++i) {
        const int at = bodies.at[static_cast<size_t>(i)], column = inputs.column(first + j, at);
        if (l.base)
          for (int k = 0; k < 6; ++k) hub(k, column) += lane(six[k], i);
        for (int k = 0; k < inputs.size; ++k)
          own(at + k, column) = lane(direction(s.out[static_cast<size_t>(k)], j), i);
      }
    }
  }
}

/// How Delta_ddot and q_ddot of the bodies follow the hub's accelerations, 6 columns.
template <class C>
void responses(const equations::SideBySide<C>& bodies, equations::SideBySideScratch<C>& s, MatrixXd& response) {
  for (int j = 0; j < 6; ++j) {
    Vec3<double> a, alpha;
    component(j < 3 ? a : alpha, j % 3) = 1;
    equations::respond(bodies.body, s.body, a, alpha, s.out.data());
    for (int i = 0; i < bodies.count; ++i)
      for (size_t k = 0; k < s.out.size(); ++k)
        response(bodies.at[static_cast<size_t>(i)] + static_cast<int>(k), j) = lane(s.out[k], i);
  }
}

}  // namespace

// The hub's equations M(x) (a, alpha) = f(x), the bodies' own accelerations = g(x) + R(x) (a, alpha): with slopes at
// constant (a, alpha), d(a, alpha) = M^-1 (df - dM (a, alpha)), and what the bodies do is dg + dR (a, alpha) + R d(a,
// alpha).
FLEXBOOM_INNER_LOOP
void System::jacobian(const double* y, std::span<const char> contact, Workspace& w) const {
  const Layout& l = impl_->layout;
  const equations::Model& model = impl_->model;
  std::copy_n(y, l.size, w.y.data());
  const double* u = y + l.u_begin();
  const equations::HubSystem<double> hub = equations::condensed_hub(model, y, u, contact, w.scratch, nullptr);
  Vec3<double> a, alpha;
  if (l.base) equations::solve_hub(hub, a, alpha);
  w.dudot.setZero();
  w.hub_columns.setZero();
  const auto own = w.dudot.bottomRows(l.p);
  equations::for_each_side_by_side(model, w.dual_scratch, [&](const auto& bodies, auto& s) {
    slopes(bodies, y, u, l, contact, a, alpha, s, w.hub_columns, own);
  });
  if (!l.base) return;

  using D = Workspace::D;
  Vec3<D> omega = {D(u[0]), D(u[1]), D(u[2])};
  for (int i = 0; i < 3; ++i) seed(component(omega, i), i);
  equations::HubSystem<D> bare = equations::bare_hub(model, omega);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      w.hub_columns(k, l.p + i) += direction(component(bare.ft, k), i);
      w.hub_columns(3 + k, l.p + i) += direction(component(bare.fw, k), i);
    }
  equations::mass_matrix(hub).llt().solveInPlace(w.hub_columns);
  equations::for_each_side_by_side(model, w.scratch,
                                   [&w](const auto& bodies, auto& s) { responses(bodies, s, w.response); });
  w.dudot.bottomRows(l.p) += w.response.lazyProduct(w.hub_columns);
  w.dudot.topRows<3>() = w.hub_columns.bottomRows<3>();
  w.dahub = w.hub_columns.topRows<3>();
  w.a_hub = spatial::eigen(a);
}

// p_dot = E u with E picking the rates, so (I - gamma J) condenses to u: (I - gamma A_u - gamma^2 A_p E) du = r_u +
// gamma A_p r_p.
void System::factorise_newton(double gamma, Workspace& w) const {
  const Layout& l = impl_->layout;
  w.gamma = gamma;
  w.newton.noalias() = -gamma * w.dudot.rightCols(l.u);
  w.newton.rightCols(l.p) -= gamma * gamma * w.dudot.leftCols(l.p);
  w.newton.diagonal().array() += 1.0;
  if (!w.newton.allFinite()) throw NumericalError("the Jacobian of the equations of motion is not finite");
  w.lu.compute(w.newton);
}

namespace {

/// How the power lost in hinge dampers and structural damping at u changes with du.
double power_slope(const Layout& l, const std::vector<Appendage>& appendages, const double* u, const double* du) {
  double power = 0;
  for (size_t i = 0; i < appendages.size(); ++i) {
    const int at = l.base + l.body[i], n = appendages[i].body.n();
    const Eigen::Map<const VectorXd> v(u + at + 1, n), dv(du + at + 1, n);
    power += 2 * appendages[i].hinge.mechanism.damping * u[at] * du[at];
    power += 2 * v.dot(appendages[i].body.De.lazyProduct(dv));
  }
  return power;
}

/// d(A(quat) a)/d(quat), 3 x 4, for to_inertial.
Eigen::Matrix<double, 3, 4> rotated_vector_slope(const double* q, const Vector3d& a) {
  const Vector3d v(q[1], q[2], q[3]);
  Eigen::Matrix<double, 3, 4> r;
  r.col(0) = 2 * v.cross(a);
  r.rightCols<3>() = -2 * q[0] * tilde(a) - 2 * (tilde(v.cross(a)) + tilde(v) * tilde(a));
  return r;
}

}  // namespace

void System::solve_newton(const double* b, Workspace& w, double* x) const {
  const Layout& l = impl_->layout;
  const double gamma = w.gamma;
  const Eigen::Map<const VectorXd> r(b, l.size);
  w.rhs_p = r.head(l.p);
  w.rhs.noalias() = r.segment(l.p, l.u) + gamma * (w.dudot.leftCols(l.p).lazyProduct(w.rhs_p));
  w.delta.tail(l.u) = w.lu.solve(w.rhs);
  w.delta.head(l.p) = w.rhs_p + gamma * w.delta.tail(l.p);

  // The followers, exactly: attitude, velocity, position, dissipated energy depend on p and u, not the other way round.
  const double* y = w.y.data();
  const double* u = y + l.u_begin();
  const double dissipated = b[l.dissipated()] + gamma * power_slope(l, impl_->appendages, u, w.delta.data() + l.p);
  if (!impl_->fixed_hub) {
    const Vector3d domega = w.delta.segment<3>(l.p);
    double rate[4];
    quaternion_rate(y + l.attitude(), domega.data(), rate);
    const Vector4d rhs = r.segment<4>(l.attitude()) + gamma * Eigen::Map<const Vector4d>(rate);
    // (I - gamma/2 Omega)^-1 = (I + gamma/2 Omega) / (1 + gamma^2 |omega|^2 / 4), Omega^2 = -|omega|^2 I.
    quaternion_rate(rhs.data(), u, rate);
    const double w2 = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    const Vector4d dq = (rhs + gamma * Eigen::Map<const Vector4d>(rate)) / (1 + 0.25 * gamma * gamma * w2);
    const Vector3d da = w.dahub.lazyProduct(w.delta);
    const Vector3d dv = r.segment<3>(l.velocity()) + gamma * (to_inertial(y + l.attitude(), da) +
                                                              rotated_vector_slope(y + l.attitude(), w.a_hub) * dq);
    const Vector3d dr = r.segment<3>(l.position()) + gamma * dv;
    Eigen::Map<Vector4d>(x + l.attitude()) = dq;
    Eigen::Map<Vector3d>(x + l.velocity()) = dv;
    Eigen::Map<Vector3d>(x + l.position()) = dr;
  }
  Eigen::Map<VectorXd>(x, l.p + l.u) = w.delta;
  x[l.dissipated()] = dissipated, x[l.work()] = b[l.work()];
}

MatrixXd System::dense_jacobian(const Workspace& w) const {
  const Layout& l = impl_->layout;
  MatrixXd J = MatrixXd::Zero(l.size, l.size);
  J.block(0, l.p + l.base, l.p, l.p).setIdentity();
  J.block(l.p, 0, l.u, l.p + l.u) = w.dudot;
  const double* y = w.y.data();
  for (int i = 0; i < l.u; ++i)
    J(l.dissipated(), l.p + i) =
        power_slope(l, impl_->appendages, y + l.u_begin(), VectorXd::Unit(l.u, i).eval().data());
  if (impl_->fixed_hub) return J;
  J.block<3, 3>(l.position(), l.velocity()).setIdentity();
  for (int i = 0; i < 3; ++i)
    quaternion_rate(y + l.attitude(), Vector3d::Unit(i).eval().data(), &J(l.attitude(), l.p + i));
  for (int i = 0; i < 4; ++i) {
    const Vector4d e = Vector4d::Unit(i);
    quaternion_rate(e.data(), y + l.u_begin(), &J(l.attitude(), l.attitude() + i));
  }
  for (int i = 0; i < l.p + l.u; ++i) J.block<3, 1>(l.velocity(), i) = to_inertial(y + l.attitude(), w.dahub.col(i));
  J.block<3, 4>(l.velocity(), l.attitude()) = rotated_vector_slope(y + l.attitude(), w.a_hub);
  return J;
}

}  // namespace flexboom
