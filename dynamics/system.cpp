#include "dynamics/system.hpp"

#include "dynamics/body_constants.hpp"
#include "dynamics/hub_check.hpp"
#include "dynamics/inner_loop.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/workspace.hpp"
#include "fem/check.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using spatial::vec3;
using spatial::Vec3;

namespace {

/// Boom axes at Theta = 0 -> hub axes.
Matrix3d hinge_axes(const Hinge& hinge) {
  Matrix3d B;
  B << hinge.stowed, hinge.outward, hinge.stowed.cross(hinge.outward);
  return B;
}

void check_hinge(const Hinge& h) {
  constexpr double tolerance = 1e-12;  // directions come from a file or a formula: round-off of a normalisation
  require(std::abs(h.stowed.norm() - 1) < tolerance && std::abs(h.outward.norm() - 1) < tolerance &&
              std::abs(h.stowed.dot(h.outward)) < tolerance,
          fmt::format("hinge {}: 'stowed' and 'outward' must be unit vectors normal to each other", h.name));
  const HingeMechanism& m = h.mechanism;
  require(m.stiffness >= 0 && m.damping >= 0 && m.stop_stiffness >= 0,
          fmt::format("hinge {}: stiffness, damping and stop stiffness must not be negative", h.name));
}

void pack_hinge(const Hinge& h, equations::Body& r) {
  const Matrix3d B = hinge_axes(h);
  r.d = vec3(h.point);
  for (int i = 0; i < 3; ++i) r.B.row[static_cast<size_t>(i)] = vec3(B.row(i).transpose());
  const HingeMechanism& m = h.mechanism;
  r.cos_threshold = std::cos(m.threshold);
  r.sin_threshold = std::sin(m.threshold);
  r.stiffness = m.stiffness;
  r.preload = m.stiffness * (m.rest - m.threshold);
  r.damping = m.damping;
  r.stop_stiffness = m.stop_stiffness;
}

/// M_xx of the appendage must be positive definite with room for round-off, else the hinge acceleration is noise.
void check_hinge_inertia(const Appendage& a) {
  const ReducedBody& b = a.body;
  double J_left = b.J0(2, 2);
  if (b.n()) J_left -= b.Cr0.row(2).dot(b.Me.llt().solve(b.Cr0.row(2).transpose()));
  require(J_left > 1e-10 * std::abs(b.J0(2, 2)) && J_left > 0,
          fmt::format("body {}: its {} modes leave the hinge row an inertia of {:.3g} of {:.3g} kg m^2: too little to "
                      "compute with; give the body inertia about the hinge, or fewer modes",
                      b.name, b.n(), J_left, b.J0(2, 2)));
}

}  // namespace

struct System::Impl {
  ReducedBody hub;
  std::vector<Appendage> appendages;
  bool fixed_hub = false;
  std::optional<OrbitalField> field;
  Layout layout;
  equations::Model model;
};

System::System(ReducedBody hub, std::vector<Appendage> appendages, bool fixed_hub, std::optional<OrbitalField> field)
    : impl_(std::make_unique<Impl>()) {
  Impl& s = *impl_;
  require(!(fixed_hub && field), "a hub that is fixed in inertial space is in no orbit: leave out one of the two");
  s.field = std::move(field);
  s.fixed_hub = fixed_hub;
  if (!fixed_hub) {
    hub.validate();
    require(hub.n() == 0, "the hub must be rigid; it has " + std::to_string(hub.n()) + " elastic coordinates");
  }
  s.model.hub_m = hub.m;
  s.model.hub_mc = vec3(hub.mc0);
  s.model.hub_J = spatial::sym3(hub.J0);
  s.model.fixed_hub = fixed_hub;
  Layout& l = s.layout;
  l.base = fixed_hub ? 0 : 3;
  for (const Appendage& a : appendages) {
    a.body.validate();
    check_hinge(a.hinge);
    check_hinge_inertia(a);
    equations::Body body;
    pack_invariants(a.body, body);
    pack_hinge(a.hinge, body);
    body.at = l.p;
    l.body.push_back(l.p);
    l.p += 1 + body.n;
    s.model.bodies.push_back(std::move(body));
  }
  if (!fixed_hub) check_hub_inertia(s.model);
  l.u = l.base + l.p;
  l.size = l.p + l.u + (fixed_hub ? 0 : 3 + 4 + 3) + 1;
  s.hub = std::move(hub);
  s.appendages = std::move(appendages);
}

System::~System() = default;
System::System(System&&) noexcept = default;

const ReducedBody& System::hub() const { return impl_->hub; }
const std::vector<Appendage>& System::appendages() const { return impl_->appendages; }
bool System::fixed_hub() const { return impl_->fixed_hub; }
const std::optional<OrbitalField>& System::field() const { return impl_->field; }
const Layout& System::layout() const { return impl_->layout; }

void WorkspaceDeleter::operator()(Workspace* w) const { delete w; }

WorkspaceHandle System::workspace() const { return WorkspaceHandle(new Workspace(impl_->model, impl_->layout)); }

Matrix3d System::boom_to_hub(int appendage, double angle) const {
  const Hinge& h = impl_->appendages[static_cast<size_t>(appendage)].hinge;
  return hinge_axes(h) * Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix();
}

State System::at_rest(const std::vector<double>& angles) const {
  require(angles.size() == impl_->appendages.size(), "one start angle per hinge is needed");
  State s;
  s.angle = angles;
  s.rate.assign(angles.size(), 0.0);
  for (const Appendage& a : impl_->appendages) {
    s.q.push_back(VectorXd::Zero(a.body.n()));
    s.q_dot.push_back(VectorXd::Zero(a.body.n()));
  }
  return s;
}

VectorXd System::pack(const State& s) const {
  const Layout& l = impl_->layout;
  VectorXd y = VectorXd::Zero(l.size);
  for (size_t i = 0; i < impl_->appendages.size(); ++i) {
    const int n = impl_->appendages[i].body.n(), at = l.body[i], rate = l.u_begin() + l.base + at;
    y[at] = s.angle[i] - impl_->appendages[i].hinge.mechanism.threshold;
    y[rate] = s.rate[i];
    y.segment(at + 1, n) = s.q[i];
    y.segment(rate + 1, n) = s.q_dot[i];
  }
  if (!impl_->fixed_hub) {
    y.segment<3>(l.u_begin()) = s.omega;
    y.segment<3>(l.position()) = s.position;
    y.segment<4>(l.attitude()) = s.attitude.normalized();
    y.segment<3>(l.velocity()) = s.velocity;
  }
  y[l.dissipated()] = s.dissipated;
  return y;
}

State System::unpack(const Eigen::Ref<const VectorXd>& y) const {
  const Layout& l = impl_->layout;
  State s;
  for (size_t i = 0; i < impl_->appendages.size(); ++i) {
    const int n = impl_->appendages[i].body.n(), at = l.body[i], rate = l.u_begin() + l.base + at;
    s.angle.push_back(y[at] + impl_->appendages[i].hinge.mechanism.threshold);
    s.rate.push_back(y[rate]);
    s.q.emplace_back(y.segment(at + 1, n));
    s.q_dot.emplace_back(y.segment(rate + 1, n));
  }
  if (!impl_->fixed_hub) {
    s.omega = y.segment<3>(l.u_begin());
    s.position = y.segment<3>(l.position());
    s.attitude = y.segment<4>(l.attitude());
    s.velocity = y.segment<3>(l.velocity());
  }
  s.dissipated = y[l.dissipated()];
  return s;
}

namespace {

/// Power lost in hinge dampers and structural damping [W].
double dissipated_power(const equations::Model& model, const double* u, int base) {
  double power = 0;
  for (const equations::Body& b : model.bodies) {
    const double* v = u + base + b.at;
    power += b.damping * v[0] * v[0];
    const auto n = static_cast<size_t>(b.n);
    for (size_t k = 0; k < n; ++k)
      for (size_t l = 0; l < n; ++l) power += v[1 + k] * b.De[k * n + l] * v[1 + l];
  }
  return power;
}

/// 1/2 quaternion * (0, omega).
void quaternion_rate(const double* q, const double* w, double* q_dot) {
  q_dot[0] = 0.5 * (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2]);
  q_dot[1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]);
  q_dot[2] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]);
  q_dot[3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);
}

/// Vector from hub to inertial axes by a quaternion that is unit up to integration error.
Vector3d to_inertial(const double* q, const Vector3d& a) {
  const Vector3d v(q[1], q[2], q[3]);
  const Vector3d t = 2 * v.cross(a);
  return a + q[0] * t + v.cross(t);
}

/// Gravity about the hub's origin, hub axes.
[[gnu::noinline]] equations::Gravity hub_gravity(const OrbitalField& field, double t, const Layout& l,
                                                 const double* y) {
  const Matrix3d A = rotation_matrix(Eigen::Map<const Vector4d>(y + l.attitude()));
  const LocalGravity g = field.at(t, Eigen::Map<const Vector3d>(y + l.position())).in_axes(A);
  return {vec3(g.acceleration), spatial::sym3(g.gradient)};
}

/// Velocity of the hub's origin, hub axes.
[[gnu::noinline]] Vec3<double> hub_velocity(const Layout& l, const double* y) {
  const Matrix3d A = rotation_matrix(Eigen::Map<const Vector4d>(y + l.attitude()));
  return vec3(A.transpose() * Eigen::Map<const Vector3d>(y + l.velocity()));
}

}  // namespace

FLEXBOOM_INNER_LOOP
void System::derivative(double t, const double* y, std::span<const char> contact, Workspace& w, double* y_dot) const {
  const Layout& l = impl_->layout;
  const double* u = y + l.u_begin();
  equations::Gravity gravity;
  if (impl_->field) gravity = hub_gravity(*impl_->field, t, l, y);
  Vec3<double> a_hub;
  equations::accelerations(impl_->model, y, u, contact, w.scratch, y_dot + l.u_begin(), a_hub,
                           impl_->field ? &gravity : nullptr);
  for (int i = 0; i < l.p; ++i) y_dot[i] = u[l.base + i];
  if (!impl_->fixed_hub) {
    for (int i = 0; i < 3; ++i) y_dot[l.position() + i] = y[l.velocity() + i];
    quaternion_rate(y + l.attitude(), u, y_dot + l.attitude());
    Eigen::Map<Vector3d>(y_dot + l.velocity()) = to_inertial(y + l.attitude(), spatial::eigen(a_hub));
  }
  y_dot[l.dissipated()] = dissipated_power(impl_->model, u, l.base);
  if (impl_->field)
    y_dot[l.dissipated()] -=
        equations::gravity_power(impl_->model, gravity, w.scratch, hub_velocity(l, y), {u[0], u[1], u[2]});
}

namespace {

/// Writes the derivatives of dual_out and a_hub by the inputs at `columns`, one lane each.
void store_columns(Workspace& w, const Vec3<Workspace::D>& a_hub, std::span<const int> columns) {
  for (size_t lane = 0; lane < columns.size(); ++lane) {
    const int column = columns[lane], i = static_cast<int>(lane);
    for (Eigen::Index r = 0; r < w.dudot.rows(); ++r) w.dudot(r, column) = w.dual_out[static_cast<size_t>(r)].d[i];
    w.dahub.col(column) << a_hub.x.d[i], a_hub.y.d[i], a_hub.z.d[i];
  }
}

/// Columns of one body's own Delta, q and their rates: only that body is differentiated, the others' parts of the hub
/// system are constants.
void body_columns(const equations::Model& model, const Layout& l, size_t i, std::span<const char> contact,
                  Workspace& w) {
  using D = Workspace::D;
  const equations::Body& body = model.bodies[i];
  const Vec3<double> w_hub = model.fixed_hub ? Vec3<double>{} : Vec3<double>{w.y[l.p], w.y[l.p + 1], w.y[l.p + 2]};
  equations::HubSystem<double> others = equations::bare_hub(model, w_hub);
  for (size_t j = 0; j < model.bodies.size(); ++j)
    if (j != i) others += w.parts[j];
  const int size = 1 + body.n;
  std::array<int, Workspace::lanes> columns{};
  for (int first = 0; first < 2 * size; first += Workspace::lanes) {
    const int count = std::min(Workspace::lanes, 2 * size - first);
    D* p = w.dual_in.data();
    D* u = p + size;
    for (int k = 0; k < size; ++k) {
      p[k] = w.y[body.at + k];
      u[k] = w.y[l.p + l.base + body.at + k];
    }
    for (int lane = 0; lane < count; ++lane) {
      const int input = first + lane;
      p[input].d[lane] = 1;
      columns[static_cast<size_t>(lane)] = input < size ? body.at + input : l.p + l.base + body.at + input - size;
    }
    equations::HubSystem<D> hub = equations::lift<D>(others);
    equations::condense(body, equations::lift<D>(w_hub), p, u, contact[i] != 0, w.dual_scratch.bodies[i],
                        model.fixed_hub, hub);
    Vec3<D> a{}, alpha{};
    if (!model.fixed_hub) {
      equations::solve_hub(hub, a, alpha);
      w.dual_out[0] = alpha.x, w.dual_out[1] = alpha.y, w.dual_out[2] = alpha.z;
    }
    for (size_t j = 0; j < model.bodies.size(); ++j) {
      D* out = w.dual_out.data() + l.base + model.bodies[j].at;
      if (j == i)
        equations::release(model.bodies[j], w.dual_scratch.bodies[j], a, alpha, out);
      else
        equations::release(model.bodies[j], w.scratch.bodies[j], a, alpha, out);
    }
    store_columns(w, a, std::span(columns).first(static_cast<size_t>(count)));
  }
}

/// Columns of the hub's angular velocity, which every body feels.
void hub_columns(const equations::Model& model, const Layout& l, std::span<const char> contact, Workspace& w) {
  for (int i = 0; i < l.p + l.u; ++i) w.dual_in[static_cast<size_t>(i)] = w.y[i];
  std::array<int, 3> columns{};
  for (int lane = 0; lane < 3; ++lane) {
    columns[static_cast<size_t>(lane)] = l.p + lane;
    w.dual_in[static_cast<size_t>(l.p + lane)].d[lane] = 1;
  }
  Vec3<Workspace::D> a_hub;
  equations::accelerations(model, w.dual_in.data(), w.dual_in.data() + l.p, contact, w.dual_scratch, w.dual_out.data(),
                           a_hub);
  store_columns(w, a_hub, columns);
  w.a_hub << a_hub.x.v, a_hub.y.v, a_hub.z.v;
}

}  // namespace

FLEXBOOM_INNER_LOOP
void System::jacobian(const double* y, std::span<const char> contact, Workspace& w) const {
  const Layout& l = impl_->layout;
  const equations::Model& model = impl_->model;
  w.y = Eigen::Map<const VectorXd>(y, l.size);
  const double* u = y + l.u_begin();
  const Vec3<double> w_hub = model.fixed_hub ? Vec3<double>{} : Vec3<double>{u[0], u[1], u[2]};
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const equations::Body& body = model.bodies[i];
    w.parts[i] = {};
    equations::condense(body, w_hub, y + body.at, u + l.base + body.at, contact[i] != 0, w.scratch.bodies[i],
                        model.fixed_hub, w.parts[i]);
  }
  for (size_t i = 0; i < model.bodies.size(); ++i) body_columns(model, l, i, contact, w);
  if (!model.fixed_hub) hub_columns(model, l, contact, w);
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
  double dissipated = b[l.dissipated()];
  for (const equations::Body& body : impl_->model.bodies) {
    const double* v = u + l.base + body.at;
    const double* dv = w.delta.data() + l.p + l.base + body.at;
    const auto n = static_cast<size_t>(body.n);
    dissipated += gamma * 2 * body.damping * v[0] * dv[0];
    for (size_t k = 0; k < n; ++k)
      for (size_t m = 0; m < n; ++m) dissipated += gamma * 2 * v[1 + k] * body.De[k * n + m] * dv[1 + m];
  }
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
  x[l.dissipated()] = dissipated;
}

MatrixXd System::dense_jacobian(const Workspace& w) const {
  const Layout& l = impl_->layout;
  MatrixXd J = MatrixXd::Zero(l.size, l.size);
  J.block(0, l.p + l.base, l.p, l.p).setIdentity();
  J.block(l.p, 0, l.u, l.p + l.u) = w.dudot;
  const double* y = w.y.data();
  for (const equations::Body& body : impl_->model.bodies) {
    const int at = l.p + l.base + body.at;
    J(l.dissipated(), at) = 2 * body.damping * y[at];
    for (int k = 0; k < body.n; ++k)
      for (int m = 0; m < body.n; ++m)
        J(l.dissipated(), at + 1 + k) += 2 * body.De[static_cast<size_t>(k * body.n + m)] * y[at + 1 + m];
  }
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

Vector3d System::tip_displacement(const State& s, int appendage) const {
  const auto i = static_cast<size_t>(appendage);
  for (const Marker& m : impl_->appendages[i].body.markers)
    if (m.name == "tip") return m.S * s.q[i];
  return Vector3d::Zero();
}

}  // namespace flexboom
