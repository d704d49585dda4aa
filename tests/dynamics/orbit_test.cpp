#include "dynamics/environment/orbit.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <random>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Long3 = Eigen::Matrix<long double, 3, 1>;

using std::numbers::pi;
const Planet earth;
const Planet oblate{.J2 = earth_J2};
const OrbitalElements iss = circular_orbit(405e3, 0.9076);

/// gravity in 19 digits.
Long3 long_gravity(const Planet& p, const Long3& r) {
  const Long3 pole = p.pole.cast<long double>();
  const long double d2 = r.squaredNorm(), d3 = d2 * std::sqrt(d2), z = r.dot(pole);
  const long double k = -1.5L * p.J2 * p.mu * p.radius * p.radius / (d3 * d2);
  return -p.mu / d3 * r + k * ((1 - 5 * z * z / d2) * r + 2 * z * pole);
}

TEST(GravityField, DifferenceLosesNoDigitsAtAnyDistance) {
  const Planet tilted{.J2 = earth_J2, .pole = Vector3d(0.3, -0.4, 0.8).normalized()};
  const Vector3d R(4.1e6, -3.2e6, 4.4e6), direction(0.6, 0.5, -0.7);
  for (const Planet& p : {earth, tilted})
    for (const double distance : {1e3, 1e5, 3e6, 2e7}) {
      const Vector3d rho = distance * direction;
      const Long3 exact =
          long_gravity(p, R.cast<long double>() + rho.cast<long double>()) - long_gravity(p, R.cast<long double>());
      const double error =
          (differential_gravity(p, R, rho) - exact.cast<double>()).norm() / static_cast<double>(exact.norm());
      EXPECT_LT(error, distance > 2e3 ? 2e-15 : 3e-15) << distance;  // the long double difference keeps 19 - 4 digits
    }
  // A metre away: the gradient, up to 1 m / 7e6 m; a plain difference has lost all but 7 digits.
  for (const Planet& p : {earth, tilted}) {
    const Vector3d linear = gravity_gradient(p, R) * direction, exact = differential_gravity(p, R, direction);
    const Vector3d centred = 0.5 * (exact - differential_gravity(p, R, -direction));
    EXPECT_LT((exact - linear).norm() / linear.norm(), 3e-7);
    EXPECT_GT((exact - linear).norm() / linear.norm(), 1e-8);
    EXPECT_LT((centred - linear).norm() / linear.norm(), 1e-13);  // second order is gone, third is 1e-14
    const Vector3d plain = gravity(p, R + direction) - gravity(p, R);
    EXPECT_GT((plain - exact).norm() / linear.norm(), 1e-11);
  }
}

TEST(GravityField, GradientIsTheDerivativeWithoutTrace) {
  const Planet p{.J2 = 0.1, .pole = Vector3d(0.3, -0.4, 0.8).normalized()};
  const Vector3d r(4.1e6, -3.2e6, 4.4e6);
  const Matrix3d G = gravity_gradient(p, r);
  EXPECT_LT(std::abs(G.trace()), 1e-14 * G.norm());
  EXPECT_LT((G - G.transpose()).norm(), 1e-15 * G.norm());
  for (int i = 0; i < 3; ++i) {
    const Vector3d h = 500 * Vector3d::Unit(i);  // truncation (h/r)^2 = 5e-9
    EXPECT_LT((G.col(i) - (differential_gravity(p, r, h) - differential_gravity(p, r, -h)) / 1000).norm(),
              1e-7 * G.norm());
  }
}

/// Energy, momentum, the equation of motion and the period, for circles to needles.
TEST(Orbit, TwoBodyMotionKeepsItsIntegralsForManyTurns) {
  for (const double e : {0.0, 1e-3, 0.3, 0.9, 0.999}) {
    const OrbitalElements o{8e6 / (1 - std::min(e, 0.5)), e, 0.9, 0.4, 1.1, 0.6};
    const Orbit orbit(o, earth);
    const double n = std::sqrt(earth.mu / o.semi_major_axis) / o.semi_major_axis;
    const OrbitState s0 = orbit.at(0);
    const Vector3d h = s0.position.cross(s0.velocity);
    EXPECT_NEAR(h.norm(), std::sqrt(earth.mu * o.semi_major_axis * (1 - e * e)), 1e-13 * h.norm() / (1 - e));
    EXPECT_NEAR(h.z() / h.norm(), std::cos(0.9), 1e-14);
    for (const double t : {-1e4, 10.0, 4e3, 14400.0, 1e6}) {
      const OrbitState s = orbit.at(t);
      const double energy = s.velocity.squaredNorm() / 2 - earth.mu / s.position.norm();
      const double round_off = 1e-14 / (1 - e);
      EXPECT_NEAR(energy, -earth.mu / (2 * o.semi_major_axis),
                  round_off * std::max(s.velocity.squaredNorm(), -2 * energy))
          << e;
      EXPECT_LT((s.position.cross(s.velocity) - h).norm(), round_off * h.norm() * 10);
      // Kepler's equation, by the true anomaly
      const Vector3d e_vector = s.velocity.cross(h) / earth.mu - s.position.normalized();
      if (e > 0.1) {
        const double E = std::atan2(s.position.dot(s.velocity) / std::sqrt(earth.mu * o.semi_major_axis),
                                    1 - s.position.norm() / o.semi_major_axis);
        const double M = E - e_vector.norm() * std::sin(E);
        EXPECT_LT(std::abs(std::remainder(M - 0.6 - n * t, 2 * pi)),
                  1e-14 * (3 + std::abs(n * t)) / std::pow(1 - e, 1.5))
            << e << " " << t;
      }
    }
  }
}

TEST(Orbit, AccelerationIsGravity) {
  const Orbit kepler(iss, earth), disturbed(iss, oblate, 14400);
  for (const Orbit* orbit : {&kepler, &disturbed})
    for (const double t : {100.0, 5000.0, 14000.0}) {
      const double h = 5;  // truncation (n h)^4 / 30 = 4e-11
      const auto v = [&](double s) { return orbit->at(t + s).velocity; };
      const auto r = [&](double s) { return orbit->at(t + s).position; };
      const Vector3d a = (8 * (v(h) - v(-h)) - (v(2 * h) - v(-2 * h))) / (12 * h);
      const Vector3d r_dot = (8 * (r(h) - r(-h)) - (r(2 * h) - r(-2 * h))) / (12 * h);
      EXPECT_LT((a - gravity(orbit->planet(), r(0))).norm(), 2e-10 * a.norm());
      EXPECT_LT((r_dot - v(0)).norm(), 2e-10 * v(0).norm());
    }
}

TEST(Orbit, OblatenessIsIntegratedToTheTolerance) {
  const double duration = 14400;
  const Orbit fine(iss, oblate, duration), coarse(iss, oblate, duration, 1e-11), coarser(iss, oblate, duration, 1e-9);
  const auto worst = [&](const Orbit& orbit) {
    double error = 0;
    for (double t = 0; t <= duration; t += 37)
      error = std::max(error, (orbit.at(t).position - fine.at(t).position).norm());
    return error;
  };
  EXPECT_LT(worst(Orbit(iss, oblate, duration, 1e-14)), 1e-4);  // 1e-11 of the radius, along the track
  EXPECT_LT(worst(coarse), 0.02 * worst(coarser));
  EXPECT_GT(worst(coarse), 1e-6);
  // Energy and the momentum about the pole are integrals.
  const auto integrals = [](const OrbitState& s) {
    const double z = s.position.z() / s.position.norm(), r = s.position.norm();
    return std::pair(s.velocity.squaredNorm() / 2 -
                         oblate.mu / r * (1 - earth_J2 * std::pow(oblate.radius / r, 2) * (1.5 * z * z - 0.5)),
                     s.position.cross(s.velocity).z());
  };
  const auto [energy, momentum] = integrals(fine.at(0));
  for (double t = 0; t <= duration; t += 37) {
    const auto [e, m] = integrals(fine.at(t));
    EXPECT_NEAR(e, energy, 1e-13 * std::abs(energy));  // 16 rad of round-off
    EXPECT_NEAR(m, momentum, 1e-13 * momentum);
  }
}

/// Secular rates of first order (Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., eqs. 9-37 and 9-39),
/// by a J2 so small that its square, 1e-6 of it, does not count; after whole turns the short periods have gone.
TEST(Orbit, NodeAndPeriapsisDriftAtTheKnownRates) {
  const double a = 7.2e6, i = 1.1, e = 0.01, J2 = 1e-6;
  const double n = std::sqrt(earth.mu / a) / a, duration = 50 * 2 * pi / n;
  const Orbit orbit({a, e, i, 0.5, 0.3, 0}, {.J2 = J2}, duration * 1.01);
  const auto angles = [&](double t) {  // node, argument of periapsis
    const OrbitState s = orbit.at(t);
    const Vector3d h = s.position.cross(s.velocity), ascending(-h.y(), h.x(), 0);
    const Vector3d periapsis = s.velocity.cross(h) / earth.mu - s.position.normalized();
    return Eigen::Vector2d(std::atan2(h.x(), -h.y()),
                           std::atan2(h.normalized().dot(ascending.cross(periapsis)), ascending.dot(periapsis)));
  };
  const double p = a * (1 - e * e), unit = n * J2 * std::pow(earth.radius / p, 2);
  const Eigen::Vector2d rate = (angles(duration) - angles(0)) / duration;
  EXPECT_NEAR(rate[0], -1.5 * unit * std::cos(i), 1e-4 * unit);
  EXPECT_NEAR(rate[1], 0.75 * unit * (4 - 5 * std::pow(std::sin(i), 2)), 1e-3 * unit);  // divided by e
}

TEST(Orbit, OtherAxesTurnEverything) {
  const Matrix3d A = Eigen::AngleAxisd(0.7, Vector3d(1, 2, -3).normalized()).toRotationMatrix();
  const Orbit orbit(iss, oblate, 3000), turned = orbit.in_axes(A).in_axes(A.transpose() * A);
  for (const double t : {0.0, 1234.5, 3000.0}) {
    EXPECT_LT((turned.at(t).position - A.transpose() * orbit.at(t).position).norm(), 1e-8);
    EXPECT_LT((gravity(turned.planet(), turned.at(t).position) - A.transpose() * gravity(oblate, orbit.at(t).position))
                  .norm(),
              1e-14);
  }
}

/// Rates of the frame against differences of its axes; on a circle they are 0, -n, 0 and constant.
TEST(Lvlh, RatesAreDerivativesOfTheAxes) {
  const OrbitalElements o{8e6, 0.1, 0.9, 0.4, 1.1, 0.6};
  const Orbit kepler(o, earth), disturbed(o, {.J2 = 0.01}, 5000);
  for (const Orbit* orbit : {&kepler, &disturbed}) {
    const double t = 2345, h = 20;
    const auto frame = [&](double s) { return lvlh_frame(orbit->planet(), orbit->at(t + s)); };
    const LvlhFrame f = frame(0);
    EXPECT_LT((f.axes.transpose() * f.axes - Matrix3d::Identity()).norm(), 1e-15 * 10);
    EXPECT_GT(f.axes.col(0).dot(orbit->at(t).velocity), 0);
    const auto slope = [h](const auto& value) {
      return ((8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h)).eval();
    };
    const Matrix3d A_dot = slope([&](double s) { return frame(s).axes; });
    const Vector3d alpha = slope([&](double s) { return frame(s).angular_velocity; });
    const Matrix3d w = f.axes.transpose() * A_dot;
    const double n = f.angular_velocity.norm();  // truncation (n h)^4 / 30 = 5e-9
    EXPECT_LT((Vector3d(w(2, 1), w(0, 2), w(1, 0)) - f.angular_velocity).norm(), 1e-8 * n);
    EXPECT_LT((alpha - f.angular_acceleration).norm(), 1e-7 * n * n);
  }
  EXPECT_GT(lvlh_frame(disturbed.planet(), disturbed.at(2345)).angular_velocity.z(), -1);
  const Orbit circle(iss, earth);
  const double n = std::sqrt(earth.mu / iss.semi_major_axis) / iss.semi_major_axis;
  for (const double t : {0.0, 4000.0, 14400.0}) {
    const LvlhFrame f = lvlh_frame(earth, circle.at(t));
    EXPECT_LT((f.angular_velocity - Vector3d(0, -n, 0)).norm(), 1e-14 * n);
    EXPECT_LT(f.angular_acceleration.norm(), 1e-14 * n * n);
    const Matrix3d turned =
        lvlh_frame(earth, circle.at(0)).axes * Eigen::AngleAxisd(-n * t, Vector3d::UnitY()).toRotationMatrix();
    EXPECT_LT((f.axes - turned).norm(), 1e-13);  // n t = 16 rad: 16 eps and round-off of a
  }
}

TEST(Lvlh, RollPitchYawAreTheAnglesOfTheirTurns) {
  const Vector3d rpy(0.3, -0.4, 2.5);
  const Matrix3d C = (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                      Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
                         .toRotationMatrix();
  EXPECT_LT((roll_pitch_yaw(C) - rpy).norm(), 1e-15 * 10);
}

TEST(Orbit, RefusesWhatIsNoOrbit) {
  EXPECT_THROW(Orbit({7e6, 1.0, 0, 0, 0, 0}, earth), InputError);
  EXPECT_THROW(Orbit({-7e6, 0, 0, 0, 0, 0}, earth), InputError);
  EXPECT_THROW(Orbit(iss, oblate), InputError);
  EXPECT_THROW(Orbit({7e6, 0.9, 0, 0, 0, 0}, oblate, 100), InputError);
  EXPECT_THROW(Orbit(iss, oblate, 100).at(101), InputError);
  EXPECT_THROW(Orbit(iss, oblate, 100).at(-1), InputError);
  const Orbit orbit(iss, oblate, 3.317);  // a time that is a sum of steps may end a digit later
  EXPECT_LT((orbit.at(std::nextafter(3.317, 4)).position - orbit.at(3.317).position).norm(), 1e-8);
}

}  // namespace
}  // namespace flexboom
