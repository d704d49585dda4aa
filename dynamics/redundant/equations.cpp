#include "dynamics/redundant/equations.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/scratch.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom::redundant {

using Eigen::Index;
using Eigen::Map;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using spatial::eigen;
using spatial::vec3;

Equations::Equations(const Prepared& prepared) : prepared_(prepared), scene_(prepared.scene), joints_(prepared.joints) {
  for (const BodyData& b : prepared.bodies) {
    const int n = static_cast<int>(b.n), o = motion_;
    places_.push_back({o, o + 3, o + 7, o + 7 + n, o + 10 + n, o + 13 + n, n, 0, freedoms_});
    motion_ += 13 + 2 * n;
    freedoms_ += 6 + n;
  }
  wheels_ = motion_;
  motion_ += static_cast<int>(scene_.wheels.size());
  inverse_metric_.resize(freedoms_);
  for (size_t i = 0; i < places_.size(); ++i) {
    const BodyData& b = prepared.bodies[i];
    const Index at = places_[i].freedom;
    inverse_metric_.segment<3>(at).setConstant(1 / b.m);
    inverse_metric_.segment<3>(at + 3).setConstant(3 / (b.J0.xx + b.J0.yy + b.J0.zz));
    // Stiff coordinates leave the corrections to the rigid motion: an error of the method on them is large at once.
    constexpr double slow = 10;  // [rad/s]
    inverse_metric_.segment(at + 6, places_[i].n) = (b.Me.diagonal() + b.Ke.diagonal() / (slow * slow)).cwiseInverse();
  }
  energies_ = 2;
  for (const JointData& j : joints_) {
    losses_.push_back(j.mechanism ? energies_ : -1);
    if (j.mechanism) energies_ += 1 + (j.law ? static_cast<int>(law_losses.size()) : 0);
  }
  for (const JointData& j : joints_) all_rows_ += static_cast<int>(j.rows.size());
  keep_rows(std::vector<char>(static_cast<size_t>(all_rows_), 1));
  scratch_ = std::make_unique<EquationScratch>(prepared.bodies);
}

Equations::~Equations() = default;

void Equations::keep_rows(const std::vector<char>& kept) {
  size_ = motion_;
  size_t row = 0;
  for (JointData& j : joints_)
    for (Row& r : j.rows) {
      r.kept = kept[row++];
      r.lambda = r.kept ? size_++ : -1;
      r.mu = r.kept ? size_++ : -1;
    }
  for (BodyPlaces& b : places_) b.nu = size_++;
  work_ = size_;
  size_ += energies_;
}

int Equations::holding(size_t joint) const {
  const JointData& j = joints_[joint];
  const auto row = std::ranges::find_if(j.rows, [&](const Row& r) { return r.holds && r.kept && j.held_at; });
  return row == j.rows.end() ? -1 : row->lambda;
}

VectorXd Equations::pack(const std::vector<BodyState>& states) const {
  require(states.size() == scene_.bodies.size(),
          fmt::format("{} bodies need as many states, {} were given", scene_.bodies.size(), states.size()));
  for (size_t i = 0; i < states.size(); ++i)
    for (const VectorXd* q : {&states[i].q, &states[i].q_dot})
      require(q->size() == 0 || q->size() == scene_.bodies[i].n(),
              fmt::format("body \"{}\" has {} elastic coordinates, {} were given", scene_.bodies[i].name,
                          scene_.bodies[i].n(), q->size()));
  VectorXd y = VectorXd::Zero(size_);
  for (size_t i = 0; i < places_.size(); ++i) {
    const BodyPlaces& at = places_[i];
    const BodyState& s = states[i];
    y.segment<3>(at.R) = s.position;
    y.segment<4>(at.p) = s.attitude.normalized();
    y.segment<3>(at.v) = s.velocity;
    y.segment<3>(at.w) = s.omega;
    if (s.q.size() > 0) y.segment(at.q, at.n) = s.q;
    if (s.q_dot.size() > 0) y.segment(at.u, at.n) = s.q_dot;
  }
  for (size_t i = 0; i < scene_.wheels.size(); ++i) {
    const ReactionWheel& w = scene_.wheels[i];
    y[wheel(i)] = w.inertia * (w.spin + w.axis.dot(states[static_cast<size_t>(w.body)].omega));
  }
  return y;
}

std::vector<BodyState> Equations::unpack(const double* y) const {
  std::vector<BodyState> states;
  for (const BodyPlaces& at : places_) {
    BodyState s;
    s.position = Map<const Vector3d>(y + at.R);
    s.attitude = Map<const Vector4d>(y + at.p);
    s.velocity = Map<const Vector3d>(y + at.v);
    s.omega = Map<const Vector3d>(y + at.w);
    s.q = Map<const VectorXd>(y + at.q, at.n);
    s.q_dot = Map<const VectorXd>(y + at.u, at.n);
    states.push_back(std::move(s));
  }
  return states;
}

Frame<double> Equations::frame(int body, const double* y) const {
  Frame<double> f;
  f.A.row = {Vec3<double>{1, 0, 0}, Vec3<double>{0, 1, 0}, Vec3<double>{0, 0, 1}};
  if (body < 0) return f;
  const BodyPlaces& at = places_[static_cast<size_t>(body)];
  f.R = three(y + at.R), f.v = three(y + at.v), f.w = three(y + at.w);
  f.A = rotation(y + at.p);
  return f;
}

Elastic<double> Equations::elastic(const PlaceData& p, const double* y) const {
  if (!p.flexible) return {};
  const BodyPlaces& at = places_[static_cast<size_t>(p.body)];
  return elastic_at(p, y + at.q, y + at.u);
}

PairMotion<double> Equations::pair(const JointData& j, double t, const double* y, const Joint* joint) const {
  PairMotion<double> x{frame(j.a.body, y), frame(j.b.body, y), elastic(j.a, y), elastic(j.b, y), {}};
  if (joint != nullptr)
    for (size_t i = 0; i < joint->prescribed.size(); ++i)
      x.drive[i] = {joint->prescribed[i].value(t), joint->prescribed[i].rate(t)};
  if (joint != nullptr && j.held_at) x.drive[0] = {*j.held_at, 0};
  return x;
}

RowMultipliers Equations::multipliers(const JointData& j, const double* y) {
  RowMultipliers m;
  for (size_t i = 0; i < j.rows.size(); ++i)
    if (j.rows[i].kept) m.lambda[i] = y[j.rows[i].lambda], m.mu[i] = y[j.rows[i].mu];
  return m;
}

namespace {

/// Subtracts scale_k times the force on q_k.
template <class Scale>
void subtract_elastic(const PlaceData& p, const PlaceForce<double>& f, const double* q, const Scale& scale, double* F) {
  const std::array<double, 6> force = {f.s.x, f.s.y, f.s.z, f.phi.x, f.phi.y, f.phi.z};
  for (Index k = 0; k < p.S.cols(); ++k)
    F[k] -= scale(k) * (dot(three(p.S.col(k).data()), f.s) + dot(three(p.S_theta.col(k).data()), f.phi));
  for (const Entry& e : p.S_slope) F[e.k] -= scale(static_cast<Index>(e.k)) * (e.value * q[e.l] * force[e.component]);
  for (const Entry& e : p.theta_slope)
    F[e.k] -= scale(static_cast<Index>(e.k)) * (e.value * q[e.l] * force[3 + e.component]);
}

}  // namespace

void Equations::scatter(const PlaceData& p, const PlaceForce<double>& f, const double* y, double* F) const {
  if (p.body < 0) return;
  const BodyPlaces& at = places_[static_cast<size_t>(p.body)];
  subtract(f.R, F + at.v);
  subtract(f.w, F + at.w);
  if (p.flexible)
    subtract_elastic(
        p, f, y + at.q, [](Index) { return 1.0; }, F + at.u);
}

/// The same in the kinematic rows, weighed with the inverse metric.
void Equations::scatter_correction(const PlaceData& p, const PlaceForce<double>& f, const double* y, double* F) const {
  if (p.body < 0) return;
  const BodyPlaces& at = places_[static_cast<size_t>(p.body)];
  const double* metric = inverse_metric_.data() + at.freedom;
  subtract(metric[0] * f.R, F + at.R);
  const std::array<double, 4> turn = half_product(y + at.p, metric[3] * f.w);
  for (size_t k = 0; k < 4; ++k) F[at.p + static_cast<int>(k)] -= turn[k];
  if (p.flexible)
    subtract_elastic(
        p, f, y + at.q, [&](Index k) { return metric[6 + k]; }, F + at.q);
}

BodyInput Equations::body_input(size_t i, const double* y, const double* y_dot) const {
  const BodyPlaces& at = places_[i];
  return {rotation(y + at.p),  three(y + at.w), y + at.q, y + at.u, three(y_dot + at.v) - vec3(scene_.gravity),
          three(y_dot + at.w), y_dot + at.u};
}

Eigen::MatrixXd Equations::mass(size_t i, const double* y) const {
  return body_mass(prepared_.bodies[i], rotation(y + places_[i].p), y + places_[i].q, scratch_->bodies[i].deformed);
}

void Equations::body_residual(size_t i, const double* y, const double* y_dot, double* F) {
  const BodyPlaces& at = places_[i];
  const double *p = y + at.p, nu = y[at.nu];
  for (int k = 0; k < 3; ++k) F[at.R + k] += y_dot[at.R + k] - y[at.v + k];
  const std::array<double, 4> turn = half_product(p, three(y + at.w));
  for (int k = 0; k < 4; ++k) F[at.p + k] += y_dot[at.p + k] - turn[static_cast<size_t>(k)] - nu * p[k];
  for (int k = 0; k < at.n; ++k) F[at.q + k] += y_dot[at.q + k] - y[at.u + k];
  F[at.nu] = 0.5 * (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3] - 1);

  Vec3<double> on_R, on_w;
  BodyScratch& s = scratch_->bodies[i];
  body_forces(prepared_.bodies[i], body_input(i, y, y_dot), on_R, on_w, s.on_q.data(), s.deformed);
  subtract(-on_R, F + at.v);
  subtract(-on_w, F + at.w);
  for (int k = 0; k < at.n; ++k) F[at.u + k] += s.on_q[static_cast<size_t>(k)];
}

double Equations::pull_by_field(size_t i, double t, const double* y, double* F) const {
  const BodyPlaces& at = places_[i];
  const Eigen::Matrix3d A = rotation_matrix(Map<const Eigen::Vector4d>(y + at.p));
  const Map<const VectorXd> q(y + at.q, at.n), u(y + at.u, at.n);
  const ReducedBody& body = scene_.bodies[i];
  const Eigen::Vector3d centre = A * (body.mc0 / body.m);  // about which the field is linear
  const LocalGravity field = scene_.field->at(t, Map<const Eigen::Vector3d>(y + at.R) + centre).at(-centre);
  const BodyGravity g = body_gravity(body, field.in_axes(A), q);
  const Eigen::Vector3d force = A * g.force;
  Map<Eigen::Vector3d>(F + at.v) -= force;
  Map<Eigen::Vector3d>(F + at.w) -= g.torque;
  Map<VectorXd>(F + at.u, at.n) -= g.modal;
  return force.dot(Map<const Eigen::Vector3d>(y + at.v)) + g.torque.dot(Map<const Eigen::Vector3d>(y + at.w)) +
         g.modal.dot(u);
}

void Equations::residual(double t, const double* y, const double* y_dot, const JointMemory& memory, double* F) {
  std::fill(F, F + size_, 0.0);
  double power = 0, loss = 0;
  for (size_t i = 0; i < places_.size(); ++i) {
    body_residual(i, y, y_dot, F);
    if (scene_.field) power += pull_by_field(i, t, y, F);
  }
  for (size_t i = 0; i < joints_.size(); ++i) {
    const JointData& j = joints_[i];
    if (j.rows.empty() && !j.mechanism) continue;
    const Joint& joint = scene_.joints[i];
    const PairMotion<double> x = pair(j, t, y, &joint);
    const JoinedPlaces<double> at(j, x);
    PairForces<double> forces, correction;
    std::array<double, 6> g{}, g_dot{};
    constrain(at, multipliers(j, y), g.data(), g_dot.data(), forces, &correction, power);
    if (j.mechanism) {
      const MechanismState state = memory.of(i);
      double in_joint = 0;
      const DriveMotion<double> c =
          act_mechanism(at, joint.mechanism, joint.kind == JointKind::hinge, state, forces, in_joint);
      F[losses(i)] = y_dot[losses(i)] - in_joint;
      for (int k = 0; j.law && k < static_cast<int>(law_losses.size()); ++k)
        F[losses(i) + 1 + k] = y_dot[losses(i) + 1 + k] - state.law.power(static_cast<LawLoss>(k), c.value, c.rate);
    }
    for (size_t k = 0; k < j.rows.size(); ++k)
      if (j.rows[k].kept) F[j.rows[k].mu] = g[k], F[j.rows[k].lambda] = g_dot[k];
    scatter(j.a, forces.a, y, F);
    scatter(j.b, forces.b, y, F);
    scatter_correction(j.a, correction.a, y, F);
    scatter_correction(j.b, correction.b, y, F);
  }
  for (size_t i = 0; i < scene_.springs.size(); ++i) {
    const JointData& j = prepared_.springs[i];
    const PairMotion<double> x = pair(j, t, y, nullptr);
    PairForces<double> forces;
    act_spring(JoinedPlaces<double>(j, x), scene_.springs[i], forces, loss);
    scatter(j.a, forces.a, y, F);
    scatter(j.b, forces.b, y, F);
  }
  for (size_t i = 0; i < scene_.loads.size(); ++i) {
    const PlaceData& p = prepared_.loads[i];
    const Frame<double> f = frame(p.body, y);
    const PlaceMotion<double> m = place_motion(p, f, elastic(p, y));
    const auto [force, torque] = load_at(scene_.loads[i], m, t);
    PlaceForce<double> forces;
    add_force(p, f, m, force, torque, forces);
    scatter(p, forces, y, F);
    power += dot(force, m.r_dot) + dot(torque, m.omega);
  }
  for (size_t i = 0; i < scene_.wheels.size(); ++i) {
    const ReactionWheel& wheel_i = scene_.wheels[i];
    const BodyPlaces& at = places_[static_cast<size_t>(wheel_i.body)];
    const double torque = wheel_i.torque ? wheel_i.torque(t) : 0.0, h = y[wheel(i)];
    const Vec3<double> axis = vec3(wheel_i.axis), w = three(y + at.w);
    F[wheel(i)] = y_dot[wheel(i)] - torque;
    subtract(-(torque * axis + cross(w, h * axis)), F + at.w);
    power += torque * (h / wheel_i.inertia - dot(axis, w));
  }
  for (size_t i = 0; i < prepared_.bodies.size(); ++i) {
    const BodyPlaces& at = places_[i];
    if (at.n == 0) continue;
    const Map<const VectorXd> u(y + at.u, at.n);
    loss += u.dot(prepared_.bodies[i].De.lazyProduct(u));
  }
  F[work_] = y_dot[work_] - power;
  F[dissipated()] = y_dot[dissipated()] - loss;
}

void Equations::row_violations(double t, const double* y, double* g, double* g_dot) const {
  for (size_t i = 0; i < joints_.size(); ++i) {
    const JointData& j = joints_[i];
    if (j.rows.empty()) continue;
    const PairMotion<double> x = pair(j, t, y, &scene_.joints[i]);
    PairForces<double> unused;
    double power = 0;
    constrain(JoinedPlaces<double>(j, x), RowMultipliers{}, g, g_dot, unused, nullptr, power);
    g += j.rows.size(), g_dot += j.rows.size();
  }
}

DriveMotion<double> Equations::gap(size_t i, const double* y, double near) const {
  const JointData& j = joints_[i];
  const PairMotion<double> x = pair(j, 0, y, nullptr);
  return joint_gap(scene_.joints[i].kind == JointKind::hinge, scene_.joints[i].mechanism.threshold,
                   JoinedPlaces<double>(j, x), near);
}

std::vector<JointReaction> Equations::loads(double t, const double* y) {
  std::vector<JointReaction> loads(joints_.size());
  for (size_t i = 0; i < joints_.size(); ++i) {
    const JointData& j = joints_[i];
    const PairMotion<double> x = pair(j, t, y, &scene_.joints[i]);
    const JoinedPlaces<double> at(j, x);
    Vec3<double> force, torque;
    for (const Row& row : j.rows) {
      if (!row.kept) continue;
      const RowVectors<double> v = row_vectors(row, at);
      if (row.kind == Row::Kind::along)
        force += y[row.lambda] * v.e;
      else
        torque += y[row.lambda] * cross(v.f, v.e);
    }
    loads[i] = {eigen(transposed_product(at.a.axes, force)), eigen(transposed_product(at.a.axes, torque))};
  }
  return loads;
}

EnergyLedger Equations::ledger(const double* y, const JointMemory& memory) const {
  EnergyLedger e;
  for (size_t i = 0; i < joints_.size(); ++i) {
    if (!joints_[i].mechanism) continue;
    const Joint& joint = scene_.joints[i];
    const double x = gap(i, y, memory.near[i]).value;
    if (joints_[i].law) {
      const LawModel law(joint);
      e.springs += law.spring_energy(x), e.stops += law.stop_energy(x);
      for (size_t k = 0; k < law_losses.size(); ++k) e.laws[k] += y[losses(i) + 1 + static_cast<int>(k)];
    } else {
      const double in_stop = energy({.stop_stiffness = joint.mechanism.stop_stiffness}, x);
      e.springs += energy(joint.mechanism, x) - in_stop, e.stops += in_stop;
    }
    e.dampers += y[losses(i)];
  }
  for (size_t i = 0; i < scene_.springs.size(); ++i) {
    const JointData& j = prepared_.springs[i];
    const PairMotion<double> x = pair(j, 0, y, nullptr);
    const JoinedPlaces<double> at(j, x);
    const Vec3<double> d = at.b.r - at.a.r;
    const double stretch = std::sqrt(dot(d, d)) - scene_.springs[i].free_length;
    e.springs += 0.5 * scene_.springs[i].stiffness * stretch * stretch;
  }
  for (size_t i = 0; i < places_.size(); ++i) {
    const Map<const VectorXd> q(y + places_[i].q, places_[i].n);
    if (places_[i].n > 0) e.structures += 0.5 * q.dot(scene_.bodies[i].Ke * q);
  }
  e.elsewhere = y[dissipated()];
  return e;
}

Equations::Momenta Equations::momenta(size_t i, const double* y) const {
  const BodyPlaces& at = places_[i];
  const BodyData& b = prepared_.bodies[i];
  const Mat3<double> A = rotation(y + at.p);
  DeformedBody& deformed = scratch_->bodies[i].deformed;
  Vec3<double> P, H;
  Momenta of;
  body_momenta(b, transposed_product(A, three(y + at.v)), three(y + at.w), y + at.q, y + at.u, P, H, of.kinetic,
               deformed);
  of.linear = eigen(A * P);
  of.angular = eigen(A * H);
  of.first_moment = eigen(A * deformed.mc);
  return of;
}

}  // namespace flexboom::redundant
