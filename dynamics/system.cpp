#include "dynamics/system.hpp"

#include "dynamics/body_constants.hpp"
#include "dynamics/hub_check.hpp"
#include "dynamics/inner_loop.hpp"
#include "dynamics/multibody_check.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/side_by_side.hpp"
#include "dynamics/system_impl.hpp"
#include "fem/check.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>

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
  check_mechanism(h.mechanism, "hinge " + h.name);
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

System::System(ReducedBody hub, std::vector<Appendage> appendages, bool fixed_hub, std::optional<OrbitalField> field)
    : impl_(std::make_unique<Impl>()) {
  Impl& s = *impl_;
  require(!(fixed_hub && appendages.empty()), "the hub is fixed and nothing hangs on it: nothing moves");
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
  std::vector<equations::Body> bodies;
  for (const Appendage& a : appendages) {
    a.body.validate();
    check_hinge(a.hinge);
    check_hinge_inertia(a);
    equations::Body& body = bodies.emplace_back();
    pack_invariants(a.body, body);
    pack_hinge(a.hinge, body);
    l.body.push_back(l.p);
    l.p += 1 + body.n;
  }
  place_side_by_side(std::move(bodies), l.body, s.model);
  if (!fixed_hub) check_hub_inertia(s.model, l.p);
  l.u = l.base + l.p;
  l.size = l.p + l.u + (fixed_hub ? 0 : 3 + 4 + 3) + 2;
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
  y[l.dissipated()] = s.dissipated, y[l.work()] = s.work;
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
  s.dissipated = y[l.dissipated()], s.work = y[l.work()];
  return s;
}

namespace {

/// Gravity about the hub's origin, hub axes.
[[gnu::noinline]] equations::Gravity<double> hub_gravity(const OrbitalField& field, double t, const Layout& l,
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
  equations::Gravity<double> gravity;
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
  y_dot[l.dissipated()] = equations::dissipated_power(impl_->model, w.scratch);
  y_dot[l.work()] =
      impl_->field ? equations::gravity_power(impl_->model, gravity, w.scratch, hub_velocity(l, y), {u[0], u[1], u[2]})
                   : 0;
}

Vector3d System::tip_displacement(const State& s, int appendage) const {
  const auto i = static_cast<size_t>(appendage);
  for (const Marker& m : impl_->appendages[i].body.markers)
    if (m.name == "tip") return m.S * s.q[i];
  return Vector3d::Zero();
}

}  // namespace flexboom
