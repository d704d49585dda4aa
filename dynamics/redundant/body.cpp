#include "dynamics/redundant/body.hpp"

#include "reduction/body/tilde.hpp"

#include <Eigen/Geometry>

#include <iterator>

namespace flexboom::redundant {

using Eigen::Index;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using spatial::eigen;

namespace {

using Components = Eigen::Matrix<double, 6, Eigen::Dynamic>;  // xx, yy, zz, xy, yz, zx of symmetric tensors, by columns

/// Rates of the shapes that follow, from those of the coordinates; after deform.
void set_rates(const BodyData& b, const double* q_dot, DeformedBody& d) {
  for (size_t k = 0; k < b.n; ++k) d.q_dot[k] = q_dot[k];
  for (size_t a = b.n; a < b.shapes; ++a) {
    d.q_dot[a] = 0;
    for (size_t k = 0; k < b.n; ++k) d.q_dot[a] += d.slope[(a - b.n) * b.n + k] * q_dot[k];
  }
}

/// Accelerations likewise; after set_rates.
void set_accelerations(const BodyData& b, const double* q_ddot, DeformedBody& d) {
  for (size_t k = 0; k < b.n; ++k) d.q_ddot[k] = q_ddot[k];
  for (size_t a = b.n; a < b.shapes; ++a) {
    d.q_ddot[a] = 0;
    for (size_t k = 0; k < b.n; ++k) d.q_ddot[a] += q_ddot[k] * d.slope[(a - b.n) * b.n + k];
  }
  for (const Entry& e : b.follow) d.q_ddot[b.n + e.component] += e.value * (d.q_dot[e.k] * d.q_dot[e.l]);
}

/// Row k of the mass matrix of the shapes times a vector over them. What follows is orthogonal, with mean square 1.
double mass_times(const BodyData& b, size_t k, const std::vector<double>& v) {
  double sum = k < b.n ? 0 : b.m * v[k];
  const auto at = [](size_t i) { return static_cast<Index>(i); };
  if (k < b.n) {
    for (size_t l = 0; l < b.n; ++l)
      if (const double Me = b.Me(at(k), at(l)); Me != 0) sum += Me * v[l];
    for (size_t a = b.n; a < b.shapes; ++a) sum += b.Me_follow(at(a - b.n), at(k)) * v[a];
  } else {
    for (size_t l = 0; l < b.n; ++l) sum += b.Me_follow(at(k - b.n), at(l)) * v[l];
  }
  return sum;
}

/// What acts on the shapes, on the coordinates that they follow.
double projected(const BodyData& b, size_t k, const std::vector<double>& on_shapes, const std::vector<double>& slope) {
  double sum = on_shapes[k];
  for (size_t a = b.n; a < b.shapes; ++a) sum += slope[(a - b.n) * b.n + k] * on_shapes[a];
  return sum;
}

/// Symmetric tensors times a vector.
Matrix3Xd times(const Components& J, const Vector3d& v) {
  Eigen::Matrix<double, 3, 6> of_components;
  of_components << v.x(), 0, 0, v.y(), 0, v.z(), 0, v.y(), 0, v.x(), v.z(), 0, 0, 0, v.z(), 0, v.y(), v.x();
  return of_components * J;
}

template <class Six>
Matrix3d symmetric(const Six& J) {
  Matrix3d S;
  S << J[0], J[3], J[5], J[3], J[1], J[4], J[5], J[4], J[2];
  return S;
}

Map<const Matrix3Xd> columns(const std::vector<Vec3<double>>& v) {
  static_assert(sizeof(Vec3<double>) == 3 * sizeof(double));
  return {v.empty() ? nullptr : &v.front().x, 3, std::ssize(v)};
}

/// How the shapes change with the coordinates: those among them one to one, those that follow by a slope.
struct ShapeMap {
  MatrixXd slope;

  /// of_shapes: columns over the shapes.
  MatrixXd from(const Eigen::Ref<const MatrixXd>& of_shapes) const {
    const Index n = slope.cols();
    return of_shapes.leftCols(n) + of_shapes.rightCols(slope.rows()) * slope;
  }
  /// on_shapes: rows over the shapes.
  MatrixXd onto(const Eigen::Ref<const MatrixXd>& on_shapes) const {
    const Index n = slope.cols();
    return on_shapes.topRows(n) + slope.transpose() * on_shapes.bottomRows(slope.rows());
  }
};

Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> slope_of(const BodyData& b,
                                                                                           const DeformedBody& d) {
  return {d.slope.data(), static_cast<Index>(b.shapes - b.n), static_cast<Index>(b.n)};
}

/// The slope's own change along a rate of the coordinates.
MatrixXd slope_along(const BodyData& b, const std::vector<double>& rate) {
  MatrixXd slope = MatrixXd::Zero(static_cast<Index>(b.shapes - b.n), static_cast<Index>(b.n));
  for (const Entry& e : b.follow)
    slope(static_cast<Index>(e.component), static_cast<Index>(e.k)) += e.value * rate[e.l];
  return slope;
}

/// The mass matrix of all shapes.
MatrixXd mass_of_shapes(const BodyData& b) {
  const auto n = static_cast<Index>(b.n), r = static_cast<Index>(b.shapes) - n;
  MatrixXd M(n + r, n + r);
  M.topLeftCorner(n, n) = b.Me;
  if (r == 0) return M;
  M.bottomLeftCorner(r, n) = b.Me_follow, M.topRightCorner(n, r) = b.Me_follow.transpose();
  M.bottomRightCorner(r, r) = b.m * MatrixXd::Identity(r, r);
  return M;
}

}  // namespace

void deform(const BodyData& b, const double* q, DeformedBody& d) {
  for (size_t k = 0; k < b.n; ++k) d.q[k] = q[k];
  for (size_t a = b.n; a < b.shapes; ++a) d.q[a] = 0;
  for (double& s : d.slope) s = 0;
  for (const Entry& e : b.follow) {
    const double v = e.value * q[e.l];
    d.slope[e.component * b.n + e.k] += v;
    d.q[b.n + e.component] += 0.5 * (v * q[e.k]);
  }
  d.mc = b.mc0;
  d.J = {b.J0.xx, b.J0.yy, b.J0.zz, b.J0.xy, b.J0.yz, b.J0.zx};
  for (size_t k = 0; k < b.shapes; ++k) {
    d.mc += d.q[k] * b.Ct[k];
    d.Cr[k] = b.Cr0[k];
  }
  for (const Entry& e : b.Cr1) component(d.Cr[e.l], e.component) += e.value * d.q[e.k];
  for (const Entry& e : b.J1) d.J[e.component] += e.value * d.q[e.k];
  for (const Entry& e : b.J2) d.J[e.component] += e.value * (d.q[e.k] * d.q[e.l]);
}

void body_forces(const BodyData& b, const BodyInput& x, Vec3<double>& on_R, Vec3<double>& on_w, double* on_q,
                 DeformedBody& d) {
  const Vec3<double>&w = x.w, a = transposed_product(x.A, x.acceleration);
  const std::array<double, 6> ww = {w.x * w.x,         w.y * w.y,         w.z * w.z,
                                    2.0 * (w.x * w.y), 2.0 * (w.y * w.z), 2.0 * (w.z * w.x)};
  deform(b, x.q, d);
  set_rates(b, x.q_dot, d);
  set_accelerations(b, x.q_ddot, d);
  Vec3<double> P{}, Cr_rate{}, Ct_acceleration{}, Cr_acceleration{};
  std::array<double, 6> J_dot{};
  for (size_t k = 0; k < b.shapes; ++k) d.on_q[k] = mass_times(b, k, d.q_ddot);
  for (const Entry& e : b.J1) {
    J_dot[e.component] += e.value * d.q_dot[e.k];
    d.on_q[e.k] -= (0.5 * e.value) * ww[e.component];
  }
  for (const Entry& e : b.J2) {  // symmetric in k, l
    const double vq = e.value * d.q[e.l];
    J_dot[e.component] += 2.0 * (vq * d.q_dot[e.k]);
    d.on_q[e.k] -= vq * ww[e.component];
  }
  Vec3<double> twice = 2.0 * w;
  for (const Entry& e : b.Cr1) d.on_q[e.k] -= e.value * (component(twice, e.component) * d.q_dot[e.l]);
  for (size_t k = 0; k < b.shapes; ++k) {
    P += d.q_dot[k] * b.Ct[k];
    Cr_rate += d.q_dot[k] * d.Cr[k];
    Ct_acceleration += d.q_ddot[k] * b.Ct[k];
    Cr_acceleration += d.q_ddot[k] * d.Cr[k];
    d.on_q[k] += dot(b.Ct[k], a) + dot(d.Cr[k], x.w_dot);
  }
  for (size_t k = 0; k < b.n; ++k) {
    double f = projected(b, k, d.on_q, d.slope);
    const auto row = static_cast<Index>(k);
    for (size_t l = 0; l < b.n; ++l) {
      const auto column = static_cast<Index>(l);
      if (b.Ke(row, column) != 0) f += b.Ke(row, column) * x.q[l];
      if (b.De(row, column) != 0) f += b.De(row, column) * x.q_dot[l];
    }
    on_q[k] = f;
  }
  const Sym3<double> inertia = {d.J[0], d.J[1], d.J[2], d.J[3], d.J[4], d.J[5]};
  const Sym3<double> rate = {J_dot[0], J_dot[1], J_dot[2], J_dot[3], J_dot[4], J_dot[5]};
  // m a + w_dot x mc + Ct q_ddot + w x (w x mc + 2 Ct q_dot)
  on_R = x.A * (b.m * a + cross(x.w_dot, d.mc) + Ct_acceleration + cross(w, cross(w, d.mc) + 2.0 * P));
  // mc x a + J w_dot + Cr q_ddot + w x (J w + Cr q_dot) + J_dot w
  on_w = cross(d.mc, a) + inertia * x.w_dot + Cr_acceleration + cross(w, inertia * w + Cr_rate) + rate * w;
}

MatrixXd body_force_derivatives(const BodyData& b, const BodyInput& x, DeformedBody& d) {
  const auto n = static_cast<Index>(b.n), shapes = static_cast<Index>(b.shapes);
  const auto at = [](size_t i) { return static_cast<Index>(i); };
  Eigen::VectorXd on_q(n);
  Vec3<double> on_R, on_w;
  body_forces(b, x, on_R, on_w, on_q.data(), d);
  const Matrix3d A = eigen(x.A), W = tilde(eigen(x.w)), W_dot = tilde(eigen(x.w_dot)), mc = tilde(eigen(d.mc));
  const Vector3d w = eigen(x.w), a = A.transpose() * eigen(x.acceleration), force = A.transpose() * eigen(on_R);
  const std::array<double, 6> ww = {w.x() * w.x(),     w.y() * w.y(),     w.z() * w.z(),
                                    2 * w.x() * w.y(), 2 * w.y() * w.z(), 2 * w.z() * w.x()};

  // By the shapes: of J, of J_dot, of Cr q_dot and Cr q_ddot by the shapes themselves, and what acts on the shapes.
  Components J = Components::Zero(6, shapes), J_rate = Components::Zero(6, shapes);
  Matrix3Xd Cr_rate = Matrix3Xd::Zero(3, shapes), Cr_acceleration = Matrix3Xd::Zero(3, shapes);
  MatrixXd by_shapes = MatrixXd::Zero(shapes, shapes), by_rates = MatrixXd::Zero(shapes, shapes);
  for (const Entry& e : b.J1) J(at(e.component), at(e.k)) += e.value;
  for (const Entry& e : b.J2) {
    J(at(e.component), at(e.k)) += 2 * e.value * d.q[e.l];
    J_rate(at(e.component), at(e.k)) += 2 * e.value * d.q_dot[e.l];
    by_shapes(at(e.k), at(e.l)) -= e.value * ww[e.component];
  }
  for (const Entry& e : b.Cr1) {
    Cr_rate(at(e.component), at(e.k)) += e.value * d.q_dot[e.l];
    Cr_acceleration(at(e.component), at(e.k)) += e.value * d.q_ddot[e.l];
    by_shapes(at(e.l), at(e.k)) += e.value * eigen(x.w_dot)[at(e.component)];
    by_rates(at(e.k), at(e.l)) -= 2 * e.value * w[at(e.component)];
  }
  const Map<const Matrix3Xd> Ct = columns(b.Ct), Cr = columns(d.Cr);
  const Map<const Eigen::VectorXd> q_dot(d.q_dot.data(), shapes);
  const Matrix3Xd Jw = times(J, w);
  const MatrixXd M = mass_of_shapes(b);
  const ShapeMap now{slope_of(b, d)}, rate{slope_along(b, d.q_dot)}, acceleration{slope_along(b, d.q_ddot)};
  // Columns over the shapes, their rates and their accelerations, as columns over q and q_dot.
  const auto by_q = [&](const auto& of_shapes, const auto& of_rates, const auto& of_accelerations) -> MatrixXd {
    const Index follow = shapes - n;
    return now.from(of_shapes) + of_rates.rightCols(follow) * rate.slope +
           of_accelerations.rightCols(follow) * acceleration.slope;
  };
  const auto by_q_dot = [&](const auto& of_rates, const auto& of_accelerations) -> MatrixXd {
    return now.from(of_rates) + 2 * of_accelerations.rightCols(shapes - n) * rate.slope;
  };

  MatrixXd D(6 + n, 6 + 2 * n);
  D.block<3, 3>(0, 0) = A * (b.m * tilde(a) - tilde(force));
  D.block<3, 3>(0, 3) = -A * (tilde(w.cross(eigen(d.mc)) + 2 * Ct * q_dot) + W * mc);
  const Matrix3Xd R_by_shapes = A * (W_dot + W * W) * Ct, R_by_rates = 2 * A * W * Ct, R_by_accelerations = A * Ct;
  D.block(0, 6, 3, n) = by_q(R_by_shapes, R_by_rates, R_by_accelerations);
  D.block(0, 6 + n, 3, n) = by_q_dot(R_by_rates, R_by_accelerations);

  const Matrix3d inertia = symmetric(d.J);
  const Eigen::Matrix<double, 6, 1> inertia_rate = J * q_dot;
  D.block<3, 3>(3, 0) = mc * tilde(a);
  D.block<3, 3>(3, 3) = W * inertia - tilde(inertia * w + Cr * q_dot) + symmetric(inertia_rate);
  const Matrix3Xd w_by_shapes =
      times(J, eigen(x.w_dot)) + times(J_rate, w) + Cr_acceleration + W * (Jw + Cr_rate) - tilde(a) * Ct;
  const Matrix3Xd w_by_rates = W * Cr + Jw;
  D.block(3, 6, 3, n) = by_q(w_by_shapes, w_by_rates, Cr);
  D.block(3, 6 + n, 3, n) = by_q_dot(w_by_rates, Cr);

  D.block(6, 0, n, 3) = now.onto(Ct.transpose() * tilde(a));
  D.block(6, 3, n, 3) = now.onto(-(Jw + 2 * Cr_rate).transpose());
  D.block(6, 6, n, n) = b.Ke + now.onto(by_q(by_shapes, by_rates, M));
  D.block(6, 6 + n, n, n) = b.De + now.onto(by_q_dot(by_rates, M));
  for (const Entry& e : b.follow) D(6 + at(e.k), 6 + at(e.l)) += e.value * d.on_q[b.n + e.component];
  return D;
}

MatrixXd body_mass(const BodyData& b, const Mat3<double>& axes, const double* q, DeformedBody& d) {
  deform(b, q, d);
  const auto n = static_cast<Index>(b.n);
  const Matrix3d A = eigen(axes);
  const ShapeMap now{slope_of(b, d)};
  MatrixXd M(6 + n, 6 + n);  // the lower half
  M.topLeftCorner<3, 3>() = b.m * Matrix3d::Identity();
  M.block<3, 3>(3, 0) = tilde(eigen(d.mc)) * A.transpose();
  M.block<3, 3>(3, 3) = symmetric(d.J);
  M.block(6, 0, n, 3) = (A * now.from(columns(b.Ct))).transpose();
  M.block(6, 3, n, 3) = now.from(columns(d.Cr)).transpose();
  M.bottomRightCorner(n, n) = now.onto(now.from(mass_of_shapes(b)));
  return M.selfadjointView<Eigen::Lower>();
}

void body_momenta(const BodyData& b, const Vec3<double>& v, const Vec3<double>& w, const double* q, const double* q_dot,
                  Vec3<double>& P, Vec3<double>& H, double& kinetic, DeformedBody& d) {
  deform(b, q, d);
  set_rates(b, q_dot, d);
  const Sym3<double> inertia = {d.J[0], d.J[1], d.J[2], d.J[3], d.J[4], d.J[5]};
  P = b.m * v + cross(w, d.mc);
  H = cross(d.mc, v) + inertia * w;
  double modal = 0;
  for (size_t k = 0; k < b.shapes; ++k) {
    P += d.q_dot[k] * b.Ct[k];
    H += d.q_dot[k] * d.Cr[k];
    modal += d.q_dot[k] * (dot(b.Ct[k], v) + dot(d.Cr[k], w) + mass_times(b, k, d.q_dot));
  }
  kinetic = 0.5 * (dot(v, P) + dot(w, H) + modal);
}

}  // namespace flexboom::redundant
