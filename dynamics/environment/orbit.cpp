#include "dynamics/environment/orbit.hpp"

#include "dynamics/environment/encke.hpp"
#include "fem/base/check.hpp"
#include "reduction/body/tilde.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double pi = std::numbers::pi;

/// x with x - a sin x + b (1 - cos x) = M, |M| <= pi: Newton in a bracket; the left side ascends.
double anomaly_passed(double a, double b, double M) {
  constexpr double circle = 1e-16;
  if (std::abs(a) + std::abs(b) < circle) return M;
  double low = M - 2.5, high = M + 2.5, x = M;  // |a sin x - b (1 - cos x)| <= 2 e
  for (int i = 0; i < 60; ++i) {
    const double s = std::sin(x), half = std::sin(x / 2), F = x - a * s + 2 * b * half * half - M;
    (F > 0 ? high : low) = x;
    double next = x - F / (1 - a * std::cos(x) + b * s);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - x) <= 2e-16 * std::max(1.0, std::abs(x))) return next;
    x = next;
  }
  return x;
}

double eccentric_anomaly(double e, double M) { return anomaly_passed(e, 0, std::remainder(M, 2 * pi)); }

OrbitState start_state(const OrbitalElements& o, double mu) {
  const double e = o.eccentricity, a = o.semi_major_axis, E = eccentric_anomaly(e, o.mean_anomaly);
  const double b = std::sqrt((1 - e) * (1 + e)), rate = std::sqrt(mu / a) / (1 - e * std::cos(E));
  const Matrix3d A =
      (Eigen::AngleAxisd(o.node, Vector3d::UnitZ()) * Eigen::AngleAxisd(o.inclination, Vector3d::UnitX()) *
       Eigen::AngleAxisd(o.periapsis, Vector3d::UnitZ()))
          .toRotationMatrix();
  return {A * (a * Vector3d(std::cos(E) - e, b * std::sin(E), 0)),
          A * (rate * Vector3d(-std::sin(E), b * std::cos(E), 0))};
}

void check(const OrbitalElements& o, const Planet& p, double duration) {
  require(p.mu > 0 && p.radius > 0, "orbit: the planet's mu and radius must be positive");
  require(p.J2 == 0 || p.pole == Vector3d::UnitZ(),
          "orbit: elements refer to a pole along z; turn the orbit with in_axes");
  require(o.eccentricity >= 0 && o.eccentricity < 1,
          fmt::format("orbit: eccentricity {:g} must lie in [0, 1)", o.eccentricity));
  require(
      o.semi_major_axis > 0 && std::isfinite(o.semi_major_axis + o.inclination + o.node + o.periapsis + o.mean_anomaly),
      fmt::format("orbit: semi-major axis {:g} m must be positive, angles finite", o.semi_major_axis));
  require(p.J2 == 0 || o.semi_major_axis * (1 - o.eccentricity) > p.radius / 2,
          fmt::format("orbit: with J2 the periapsis, {:.6g} m, must not lie deep in the planet",
                      o.semi_major_axis * (1 - o.eccentricity)));
  require(p.J2 == 0 || (duration > 0 && std::isfinite(duration)), "orbit: with J2 a duration is needed [s]");
}

}  // namespace

OrbitalElements circular_orbit(double altitude, double inclination, const Planet& planet) {
  return {.semi_major_axis = planet.radius + altitude, .inclination = inclination};
}

// f and g by the eccentric anomaly that is passed (Battin, sec. 4.3), whole turns left out.
OrbitState kepler(double mu, const OrbitState& s, double t) {
  const Vector3d &r0 = s.position, &v0 = s.velocity;
  const double R = r0.norm(), a = 1 / (2 / R - v0.squaredNorm() / mu), n = std::sqrt(mu / a) / a;
  const double sigma = r0.dot(v0) / std::sqrt(mu), root = std::sqrt(a);
  const double x = anomaly_passed(1 - R / a, sigma / root, std::remainder(n * t, 2 * pi));
  const double sin = std::sin(x), half = std::sin(x / 2), versed = 2 * half * half;  // 1 - cos x
  const double f = 1 - a / R * versed, g = a / std::sqrt(mu) * (sigma * versed + R / root * sin);
  const Vector3d r = f * r0 + g * v0;
  const double d = r.norm();
  return {r, -std::sqrt(mu * a) / (d * R) * sin * r0 + (1 - a / d * versed) * v0};
}

struct Orbit::Path : EnckePath {
  OrbitState start;
  double duration = 0;
};

Orbit::Orbit(const OrbitalElements& elements, const Planet& planet, double duration, double tolerance)
    : planet_(planet) {
  check(elements, planet, duration);
  auto path = std::make_shared<Path>();
  path->start = start_state(elements, planet.mu);
  path->duration = duration;
  if (planet.J2 != 0) static_cast<EnckePath&>(*path) = encke_path(planet, path->start, duration, tolerance);
  path_ = std::move(path);
}

Orbit Orbit::in_axes(const Matrix3d& axes) const {
  Orbit turned = *this;
  turned.axes_ = axes.transpose() * axes_;
  turned.planet_.pole = axes.transpose() * planet_.pole;
  return turned;
}

OrbitState Orbit::at(double t) const {
  OrbitState s;
  if (path_->steps.empty()) {
    s = kepler(planet_.mu, path_->start, t);
  } else {
    const double round_off = 1e-12 * path_->duration;  // of times that are sums of steps
    if (!(t >= -round_off && t <= path_->duration + round_off))
      throw InputError(
          fmt::format("orbit: it was integrated from 0 to {:g} s, and {:.17g} s was asked for", path_->duration, t));
    const double within = std::min(t, path_->steps.back().end);
    const EnckeStep& step = *std::ranges::lower_bound(path_->steps, within, {}, &EnckeStep::end);
    const EnckeArc& arc = path_->arcs[static_cast<size_t>(step.arc)];
    Eigen::Matrix<double, 6, 1> d = step.c.col(step.c.cols() - 1);
    for (Eigen::Index k = step.c.cols() - 2; k >= 0; --k) d = step.c.col(k) + (t - step.end) * d;
    s = kepler(planet_.mu, arc.start, t - arc.begin);
    s.position += d.head<3>();
    s.velocity += d.tail<3>();
  }
  return {axes_ * s.position, axes_ * s.velocity};
}

// With h = r x v, k = h/|h|, c = r/|r| and gravity a: omega = |h|/r^2 k + r (a . k)/|h| c; its rate from |h|' = r a .
// (k x c), a' = gradient v and k' = omega x k.
LvlhFrame lvlh_frame(const Planet& planet, const OrbitState& s) {
  const Vector3d &r = s.position, &v = s.velocity, a = gravity(planet, r), h = r.cross(v);
  const double R = r.norm(), H = h.norm();
  const Vector3d c = r / R, k = h / H, along = k.cross(c);
  const double R_dot = v.dot(c), H_dot = R * a.dot(along);
  const double turn = H / (R * R), lean = R * a.dot(k) / H;
  const Vector3d k_dot = -lean * along;  // (turn k + lean c) x k
  const double a_k_dot = (gravity_gradient(planet, r) * v).dot(k) + a.dot(k_dot);
  LvlhFrame f;
  f.axes << along, -k, -c;
  f.angular_velocity = {0, -turn, -lean};
  f.angular_acceleration = {0, -(H_dot - 2 * turn * R * R_dot) / (R * R),
                            -(R_dot * a.dot(k) + R * a_k_dot) / H + lean * H_dot / H};
  return f;
}

Vector3d roll_pitch_yaw(const Matrix3d& C) {
  return {std::atan2(C(2, 1), C(2, 2)), std::asin(std::clamp(-C(2, 0), -1.0, 1.0)), std::atan2(C(1, 0), C(0, 0))};
}

}  // namespace flexboom
