#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/equations.hpp"
#include "dynamics/redundant/scratch.hpp"

#include <algorithm>
#include <array>

namespace flexboom::redundant {

using Eigen::Index;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using spatial::eigen;
using spatial::vec3;

namespace {

Vec3<Lanes> lanes(const Vec3<double>& a) { return lifted<Lanes>(a); }
Mat3<Lanes> lanes(const Mat3<double>& a) { return {{lanes(a.row[0]), lanes(a.row[1]), lanes(a.row[2])}}; }

/// Derivative of A for a small rotation v in its own axes: A tilde(v).
void turn(Mat3<Lanes>& A, const Vec3<double>& v, int lane) {
  for (Vec3<Lanes>& r : A.row) {
    const Vec3<double> d = cross(Vec3<double>{r.x.v, r.y.v, r.z.v}, v);
    r.x.d[lane] = d.x, r.y.d[lane] = d.y, r.z.d[lane] = d.z;
  }
}

/// p-part of a small rotation: dtheta = 2 / |p|^2 E(p) dp.
Eigen::Matrix<double, 3, 4> quaternion_map(const double* p) {
  Eigen::Matrix<double, 3, 4> E;
  E << -p[1], p[0], p[3], -p[2], -p[2], -p[3], p[0], p[1], -p[3], p[2], -p[1], p[0];
  return E * (2 / (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]));
}

/// Directions of one place: R, theta, s, phi (groups 0 to 3), v, w, s_dot, phi_dot (4 to 7).
constexpr int side_size = 24;

struct Direction {
  bool b;
  int group, component;
  int column() const { return (b ? side_size : 0) + 3 * group + component; }
};

PairMotion<Lanes> lifted_pair(const PairMotion<double>& x) {
  const auto frame = [](const Frame<double>& f) {
    return Frame<Lanes>{lanes(f.R), lanes(f.v), lanes(f.w), lanes(f.A)};
  };
  const auto elastic = [](const Elastic<double>& e) {
    return Elastic<Lanes>{lanes(e.s), lanes(e.phi), lanes(e.s_dot), lanes(e.phi_dot)};
  };
  PairMotion<Lanes> r{frame(x.frame_a), frame(x.frame_b), elastic(x.elastic_a), elastic(x.elastic_b), {}};
  for (size_t i = 0; i < 2; ++i) r.drive[i] = {Lanes(x.drive[i].value), Lanes(x.drive[i].rate)};
  return r;
}

void seed(PairMotion<Lanes>& x, const Direction& d, int lane) {
  Frame<Lanes>& f = d.b ? x.frame_b : x.frame_a;
  Elastic<Lanes>& e = d.b ? x.elastic_b : x.elastic_a;
  if (d.group == 1) {
    const std::array<double, 3> axis = {d.component == 0 ? 1.0 : 0.0, d.component == 1 ? 1.0 : 0.0,
                                        d.component == 2 ? 1.0 : 0.0};
    return turn(f.A, three(axis.data()), lane);
  }
  Vec3<Lanes>* const groups[] = {&f.R, nullptr, &e.s, &e.phi, &f.v, &f.w, &e.s_dot, &e.phi_dot};
  component(*groups[d.group], d.component).d[lane] = 1;
}

struct PairResult {
  PairForces<Lanes> forces;
  std::array<Lanes, 6> g{}, g_dot{};
  Lanes power, loss;
};

/// Rows: forces on a (R, w, s, phi: 12), on b (12), g, g_dot, power, loss. Columns: directions of a, of b, and the
/// forces themselves.
template <class Evaluate>
MatrixXd pair_derivatives(const JointData& j, const PairMotion<double>& x, bool velocities, const Evaluate& evaluate) {
  std::vector<Direction> directions;
  for (const bool b : {true, false}) {
    const PlaceData& p = b ? j.b : j.a;
    if (p.body < 0 && !b) continue;
    for (int group = 0; group < (velocities ? 8 : 4); ++group) {
      const int kind = group % 4;
      if ((kind == 0 && !b) || (kind >= 2 && !p.flexible)) continue;  // a moves against b as b against a
      for (int c = 0; c < 3; ++c) directions.push_back({b, group, c});
    }
  }
  const auto m = static_cast<Index>(j.rows.size());
  MatrixXd L = MatrixXd::Zero(26 + 2 * m, 2 * side_size + 1);
  const PairMotion<Lanes> base = lifted_pair(x);
  for (size_t first = 0; first < directions.size(); first += 8) {
    const size_t count = std::min<size_t>(8, directions.size() - first);
    PairMotion<Lanes> seeded = base;
    for (size_t k = 0; k < count; ++k) seed(seeded, directions[first + k], static_cast<int>(k));
    PairResult r = evaluate(seeded);
    for (size_t k = 0; k < count; ++k) {
      const Index column = directions[first + k].column();
      const auto lane = static_cast<int>(k);
      Index row = 0;
      for (PlaceForce<Lanes>* f : {&r.forces.a, &r.forces.b})
        for (Vec3<Lanes>* v : {&f->R, &f->w, &f->s, &f->phi})
          for (int c = 0; c < 3; ++c) L(row++, column) = component(*v, c).d[lane];
      for (Index i = 0; i < m; ++i) {
        L(24 + i, column) = r.g[static_cast<size_t>(i)].d[lane];
        L(24 + m + i, column) = r.g_dot[static_cast<size_t>(i)].d[lane];
      }
      L(24 + 2 * m, column) = r.power.d[lane];
      L(25 + 2 * m, column) = r.loss.d[lane];
    }
    Index row = 0;
    for (PlaceForce<Lanes>* f : {&r.forces.a, &r.forces.b})
      for (Vec3<Lanes>* v : {&f->R, &f->w, &f->s, &f->phi})
        for (int c = 0; c < 3; ++c) L(row++, Index{2} * side_size) = component(*v, c).v;
  }
  for (const Index group : {0, 12}) L.middleCols(group, 3) = -L.middleCols(side_size + group, 3);
  if (!velocities)  // d g_dot / d velocity = dg / d position
    for (const Index side : {0, side_size}) L.block(24 + m, side + 12, m, 12) = L.block(24, side, m, 12);
  return L;
}

/// Freedoms [R theta q] -> R, theta, s, phi of a place, 12 x (6 + n).
MatrixXd freedom_map(const PlaceData& p, const double* q, Index n) {
  MatrixXd V = MatrixXd::Zero(12, 6 + n);
  V.topLeftCorner(6, 6).setIdentity();
  if (!p.flexible) return V;
  const PlaceShapes shapes = shapes_at(p, q);
  V.block(6, 6, 3, n) = shapes.S, V.block(9, 6, 3, n) = shapes.S_theta;
  return V;
}

/// The same from the unknowns [R p q], 12 x (7 + n).
MatrixXd unknown_map(const MatrixXd& freedoms, const double* quaternion) {
  MatrixXd V(12, freedoms.cols() + 1);
  V << freedoms.leftCols(3), MatrixXd::Zero(12, 4), freedoms.rightCols(freedoms.cols() - 6);
  V.block(3, 3, 3, 4) = quaternion_map(quaternion);
  return V;
}

}  // namespace

void Equations::body_newton(size_t i, double t, double c, const double* y, const double* y_dot, PatternSum& out) {
  const BodyPlaces& at = places_[i];
  const BodyData& body = prepared_.bodies[i];
  const Index n = at.n;
  const double *p = y + at.p, *w = y + at.w;
  for (int k = 0; k < 3; ++k) out.add(at.R + k, at.R + k, c), out.add(at.R + k, at.v + k, -1);
  for (int k = 0; k < at.n; ++k) out.add(at.q + k, at.q + k, c), out.add(at.q + k, at.u + k, -1);
  Eigen::Matrix4d P;  // 1/2 p (0, w) = P p
  P << 0, -w[0], -w[1], -w[2], w[0], 0, w[2], -w[1], w[1], -w[2], 0, w[0], w[2], w[1], -w[0], 0;
  out.add_block(at.p, at.p, Eigen::Matrix4d((c - y[at.nu]) * Eigen::Matrix4d::Identity() - 0.5 * P));
  for (int k = 0; k < 3; ++k) {
    const std::array<double, 4> column = half_product(p, {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0});
    for (int r = 0; r < 4; ++r) out.add(at.p + r, at.w + k, -column[static_cast<size_t>(r)]);
  }
  for (int k = 0; k < 4; ++k) out.add(at.p + k, at.nu, -p[k]), out.add(at.nu, at.p + k, p[k]);

  const MatrixXd D = body_force_derivatives(body, body_input(i, y, y_dot), scratch_->bodies[i].deformed);
  out.add_block(at.v, at.p, MatrixXd(D.leftCols(3) * quaternion_map(p)));
  out.add_block(at.v, at.q, D.middleCols(6, n));
  MatrixXd V = c * mass(i, y);  // of v, w, u
  V.middleCols(3, 3) += D.middleCols(3, 3);
  V.rightCols(n) += D.rightCols(n);
  for (size_t k = 0; k < scene_.wheels.size(); ++k) {
    const ReactionWheel& wheel_k = scene_.wheels[k];
    if (wheel_k.body != static_cast<int>(i)) continue;
    V.block<3, 3>(3, 3) -= tilde(y[wheel(k)] * wheel_k.axis);
    const Eigen::Vector3d column = Map<const Eigen::Vector3d>(w).cross(wheel_k.axis);
    out.add_block(at.w, wheel(k), column);
    out.add(wheel(k), wheel(k), c);
    const double torque = wheel_k.torque ? wheel_k.torque(t) : 0.0;
    out.add(work_, wheel(k), -torque / wheel_k.inertia);
    out.add_block(work_, at.w, torque * wheel_k.axis.transpose());
  }
  out.add_block(at.v, at.v, V);
  if (n > 0) out.add_block(dissipated(), at.u, -2 * Map<const VectorXd>(y + at.u, n).transpose() * body.De);
}

void Equations::pair_newton(const JointData& j, const MatrixXd& L, bool velocities, int loss, const double* y,
                            PatternSum& out) {
  const auto m = static_cast<Index>(j.rows.size());
  const std::array<const PlaceData*, 2> sides = {&j.a, &j.b};
  for (size_t side = 0; side < 2; ++side) {
    const PlaceData& p = *sides[side];
    if (p.body < 0) continue;
    const BodyPlaces& at = places_[static_cast<size_t>(p.body)];
    const Index first = static_cast<Index>(side) * side_size;
    const MatrixXd V = freedom_map(p, y + at.q, at.n), E = unknown_map(V, y + at.p);
    MatrixXd of_positions = L.middleCols(first, 12) * E;
    const MatrixXd of_velocities = L.middleCols(first + 12, 12) * V;
    for (const auto& [slope, group] : {std::pair(&p.S_slope, 6), std::pair(&p.theta_slope, 9)})
      for (const Entry& e : *slope) {  // the shapes change: rates S(q) q_dot, and forces on q
        const auto c = static_cast<Index>(e.component), k = static_cast<Index>(e.k), l = static_cast<Index>(e.l);
        of_positions.col(7 + l) += L.col(first + 12 + group + c) * (e.value * y[at.u + k]);
        const double force = L(12 * static_cast<Index>(side) + group + c, Index{2} * side_size);
        out.add(at.u + static_cast<int>(k), at.q + static_cast<int>(l), -e.value * force);
      }
    for (size_t other = 0; other < 2; ++other) {
      const PlaceData& o = *sides[other];
      if (o.body < 0) continue;
      const BodyPlaces& on = places_[static_cast<size_t>(o.body)];
      const MatrixXd T = freedom_map(o, y + on.q, on.n).transpose();
      const Index row = 12 * static_cast<Index>(other);
      out.add_block(on.v, at.R, MatrixXd(-T * of_positions.middleRows(row, 12)));
      if (velocities) out.add_block(on.v, at.v, MatrixXd(-T * of_velocities.middleRows(row, 12)));
    }
    for (const auto& [energy, row] : {std::pair(work_, 24 + 2 * m), std::pair(loss, 25 + 2 * m)}) {
      out.add_block(energy, at.R, -of_positions.row(row));
      if (velocities) out.add_block(energy, at.v, -of_velocities.row(row));
    }
    const MatrixXd G = L.block(24, first, m, 12) * V;
    const Map<const VectorXd> metric(inverse_metric_.data() + at.freedom, 6 + at.n);
    for (Index i = 0; i < m; ++i) {
      const Row& r = j.rows[static_cast<size_t>(i)];
      if (!r.kept) continue;
      out.add_block(r.mu, at.R, of_positions.row(24 + i));
      out.add_block(r.lambda, at.R, of_positions.row(24 + m + i));
      out.add_block(r.lambda, at.v, of_velocities.row(24 + m + i));
      const VectorXd column = G.row(i).transpose();
      out.add_block(at.v, r.lambda, VectorXd(-column));
      const VectorXd correction = metric.cwiseProduct(column);
      out.add_block(at.R, r.mu, Eigen::Vector3d(-correction.head<3>()));
      const std::array<double, 4> turned = half_product(y + at.p, three(correction.data() + 3));
      for (int k = 0; k < 4; ++k) out.add(at.p + k, r.mu, -turned[static_cast<size_t>(k)]);
      out.add_block(at.q, r.mu, VectorXd(-correction.tail(at.n)));
    }
  }
}

void Equations::newton(double t, double c, const double* y, const double* y_dot, const JointMemory& memory,
                       PatternSum& out) {
  for (size_t i = 0; i < places_.size(); ++i) body_newton(i, t, c, y, y_dot, out);
  for (size_t i = 0; i < joints_.size(); ++i) {
    const JointData& j = joints_[i];
    if (j.rows.empty() && !j.mechanism) continue;
    const Joint& joint = scene_.joints[i];
    const RowMultipliers of = multipliers(j, y);
    const bool damped = j.law || (j.mechanism && joint.mechanism.damping != 0);
    const MatrixXd L = pair_derivatives(j, pair(j, t, y, &joint), damped, [&](const PairMotion<Lanes>& x) {
      const JoinedPlaces<Lanes> at(j, x);
      PairResult r;
      constrain(at, of, r.g.data(), r.g_dot.data(), r.forces, nullptr, r.power);
      if (j.mechanism)
        act_mechanism(at, joint.mechanism, joint.kind == JointKind::hinge, memory.of(i), r.forces, r.loss);
      return r;
    });
    pair_newton(j, L, damped, j.mechanism ? losses(i) : dissipated(), y, out);
    const PairMotion<double> now = pair(j, t, y, &joint);
    const JoinedPlaces<double> at(j, now);
    for (const Row& r : j.rows)
      if (r.kept && !r.holds && r.drive != Row::Drive::none) out.add(work_, r.lambda, -row_vectors(r, at).power);
  }
  for (size_t i = 0; i < scene_.springs.size(); ++i) {
    const JointData& j = prepared_.springs[i];
    const bool damped = scene_.springs[i].damping != 0;
    const MatrixXd L = pair_derivatives(j, pair(j, t, y, nullptr), damped, [&](const PairMotion<Lanes>& x) {
      PairResult r;
      act_spring(JoinedPlaces<Lanes>(j, x), scene_.springs[i], r.forces, r.loss);
      return r;
    });
    pair_newton(j, L, damped, dissipated(), y, out);
  }
  for (size_t i = 0; i < scene_.loads.size(); ++i) {
    JointData j;
    j.b = prepared_.loads[i];
    const Load& load = scene_.loads[i];
    const ForceAndTorque own = load_in_own_axes(load, t);
    const MatrixXd L = pair_derivatives(j, pair(j, t, y, nullptr), true, [&](const PairMotion<Lanes>& x) {
      const PlaceMotion<Lanes> b = place_motion(j.b, x.frame_b, x.elastic_b);
      PairResult r;
      Vec3<Lanes> force = lanes(own.force), torque = lanes(own.torque);
      if (!load.inertial_axes) force = b.axes * force, torque = b.axes * torque;
      add_force(j.b, x.frame_b, b, force, torque, r.forces.b);
      r.power = dot(force, b.r_dot) + dot(torque, b.omega);
      return r;
    });
    pair_newton(j, L, true, dissipated(), y, out);
  }
  for (int energy = work_; energy < size_; ++energy) out.add(energy, energy, c);
}

MatrixXd Equations::gradient(double t, const double* y) {
  MatrixXd G = MatrixXd::Zero(all_rows_, freedoms_);
  Index first = 0;
  for (size_t i = 0; i < joints_.size(); ++i) {
    const JointData& j = joints_[i];
    const auto m = static_cast<Index>(j.rows.size());
    if (m == 0) continue;
    const MatrixXd L = pair_derivatives(j, pair(j, t, y, &scene_.joints[i]), false, [&](const PairMotion<Lanes>& x) {
      PairResult r;
      Lanes power;
      constrain(JoinedPlaces<Lanes>(j, x), RowMultipliers{}, r.g.data(), r.g_dot.data(), r.forces, nullptr, power);
      return r;
    });
    for (const bool b : {false, true}) {
      const PlaceData& p = b ? j.b : j.a;
      if (p.body < 0) continue;
      const BodyPlaces& at = places_[static_cast<size_t>(p.body)];
      G.block(first, at.freedom, m, 6 + at.n) += L.block(24, b ? side_size : 0, m, 12) * freedom_map(p, y + at.q, at.n);
    }
    first += m;
  }
  return G;
}

void Equations::row_values(double t, const double* y, RowValues& out) {
  out.g.resize(all_rows_), out.g_dot.resize(all_rows_), out.bias.resize(all_rows_);
  Index row = 0;
  for (size_t i = 0; i < joints_.size(); ++i) {
    const JointData& j = joints_[i];
    if (j.rows.empty()) continue;
    const Joint& joint = scene_.joints[i];
    const PairMotion<double> now = pair(j, t, y, &joint);
    PairMotion<Lanes> x = lifted_pair(now);  // lane 0: time, no acceleration
    const auto move = [](Vec3<Lanes>& a, const Vec3<double>& rate) {
      a.x.d[0] = rate.x, a.y.d[0] = rate.y, a.z.d[0] = rate.z;
    };
    for (const bool b : {false, true}) {
      Frame<Lanes>& f = b ? x.frame_b : x.frame_a;
      Elastic<Lanes>& e = b ? x.elastic_b : x.elastic_a;
      const Frame<double>& f0 = b ? now.frame_b : now.frame_a;
      const Elastic<double>& e0 = b ? now.elastic_b : now.elastic_a;
      move(f.R, f0.v), move(e.s, e0.s_dot), move(e.phi, e0.phi_dot);
      turn(f.A, f0.w, 0);
      const PlaceData& p = b ? j.b : j.a;
      if (!p.flexible) continue;
      const Elastic<double> bias = elastic_bias(p, y + places_[static_cast<size_t>(p.body)].u);
      move(e.s_dot, bias.s_dot), move(e.phi_dot, bias.phi_dot);
    }
    for (size_t k = 0; k < joint.prescribed.size(); ++k) {
      x.drive[k].value.d[0] = now.drive[k].rate;
      x.drive[k].rate.d[0] = joint.prescribed[k].acceleration(t);
    }
    PairResult r;
    Lanes power;
    constrain(JoinedPlaces<Lanes>(j, x), RowMultipliers{}, r.g.data(), r.g_dot.data(), r.forces, nullptr, power);
    for (size_t k = 0; k < j.rows.size(); ++k, ++row) {
      out.g[row] = r.g[k].v;
      out.g_dot[row] = r.g_dot[k].v;
      out.bias[row] = r.g_dot[k].d[0];
    }
  }
}

}  // namespace flexboom::redundant
