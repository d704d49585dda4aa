// Flights in the field of a planet: attitude against independent solutions, and no digits lost to its distance.

#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/simulation/formulations.hpp"
#include "dynamics/simulation/tree_integrator.hpp"
#include "fem/base/check.hpp"
#include "hub_testing.hpp"
#include "sport_testing.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using testing::Hub;
using testing::HubState;

using std::numbers::pi;
constexpr double four_hours = 14400;

Vector4d quaternion(const Matrix3d& A) {
  const Eigen::Quaterniond q(A);
  return {q.w(), q.x(), q.y(), q.z()};
}

double rate_of(const Orbit& orbit) { return -lvlh_frame(orbit.planet(), orbit.at(0)).angular_velocity.y(); }

Vector3d mass_centre(const Hub& system, const std::vector<double>& angles) {
  double m = system.hub().m;
  Vector3d mc = system.hub().mc0;
  for (size_t i = 0; i < angles.size(); ++i) {
    const Appendage& a = system.appendages()[i];
    m += a.body.m;
    mc += a.body.m * a.hinge.point + system.boom_to_hub(i, angles[i]) * a.body.mc0;
  }
  return mc / m;
}

/// The state of a system that turns with the LVLH frame, its attitude off by a rotation vector (LVLH axes), its mass
/// centre on the reference point: a millimetre beside it drifts by metres in hours, and a metre along the track is
/// 1.5e-7 rad of the vertical.
HubState turning_with_orbit(const Hub& system, const std::vector<double>& angles, const Vector3d& off) {
  const Orbit& orbit = system.field()->orbit;
  const LvlhFrame frame = lvlh_frame(orbit.planet(), orbit.at(0));
  const Matrix3d C =
      off.norm() > 0 ? Eigen::AngleAxisd(off.norm(), off.normalized()).toRotationMatrix() : Matrix3d::Identity();
  HubState s = system.at_rest(angles);
  s.attitude = quaternion(frame.axes * C);
  s.omega = C.transpose() * frame.angular_velocity;
  const Vector3d c = mass_centre(system, angles);
  s.position = -(frame.axes * C * c);
  s.velocity = -(frame.axes * C * s.omega.cross(c));
  return s;
}

/// Hub -> LVLH at an output.
Matrix3d in_lvlh(const Hub& system, const TreeTrajectory& r, size_t i) {
  const Orbit& orbit = system.field()->orbit;
  return lvlh_frame(orbit.planet(), orbit.at(r.time[i])).axes.transpose() *
         rotation_matrix(system.unpack(r.y[i]).attitude);
}

IntegratorOptions options(const std::string& method, double tolerance, double duration, double output_step) {
  IntegratorOptions o;
  o.method = method;
  o.tolerance = tolerance;
  o.duration = duration;
  o.output_step = output_step;
  return o;
}

class EveryMethodInOrbit : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Table, EveryMethodInOrbit, ::testing::Values("exponential", "bdf", "adams", "dirk", "erk"),
                         [](const auto& p) { return p.param; });

/// A rigid body on a circle swings in pitch: theta'' = -3 n^2 (Ixx - Izz)/Iyy sin theta cos theta, a pendulum whose
/// period is known: 4 K(sin theta_0) / w, w = n sqrt(3 (Ixx - Izz) / Iyy).
TEST_P(EveryMethodInOrbit, RigidBodyLibratesInPitch) {
  const Vector3d J(3, 2.5, 1);
  const Orbit orbit(circular_orbit(405e3, 0.9), {});
  const double n = rate_of(orbit), w = n * std::sqrt(3 * (J.x() - J.z()) / J.y()), start = 0.1;
  const Hub system(rigid_body("body", 10, Vector3d::Zero(), J.asDiagonal()), {}, OrbitalField{orbit});
  const double period = 4 * std::comp_ellint_1(std::sin(start)) / w;
  const TreeTrajectory r = integrate(system, system.pack(turning_with_orbit(system, {}, {0, start, 0})),
                                     options(GetParam(), 1e-9, period, period / 4));
  const double expected[] = {start, 0, -start, 0, start};
  ASSERT_EQ(r.time.size(), 5u);
  for (size_t i = 0; i < 5; ++i) {
    const Vector3d rpy = roll_pitch_yaw(in_lvlh(system, r, i));
    EXPECT_NEAR(rpy.y(), expected[i], 1e-8) << i;
    EXPECT_NEAR(rpy.x(), 0, 1e-8);
  }
  EXPECT_LT(r.summary.energy_balance, 1e-7);  // the work of gravity is counted
}

/// Beside the reference point: the difference of two orbits, each in closed form.
TEST_P(EveryMethodInOrbit, MassCentreIsOnAnOrbitOfItsOwn) {
  const Planet planet;
  const Orbit orbit(circular_orbit(405e3, 0.9), planet);
  const Hub system(rigid_body("body", 10, Vector3d::Zero(), Vector3d(3, 2.5, 1).asDiagonal()), {},
                   OrbitalField{orbit, true});
  HubState s = turning_with_orbit(system, {}, {0.1, 0.2, -0.1});
  s.position = Vector3d(120, -80, 50);
  s.velocity = Vector3d(0.1, 0.05, -0.2);
  const OrbitState reference = orbit.at(0);
  const OrbitState start{reference.position + s.position, reference.velocity + s.velocity};
  const TreeTrajectory r = integrate(system, system.pack(s), options(GetParam(), 1e-9, 2000, 250));
  ASSERT_EQ(r.time.size(), 9u);
  for (size_t i = 0; i < r.time.size(); ++i) {
    const OrbitState there = kepler(planet.mu, start, r.time[i]), beside = orbit.at(r.time[i]);
    const HubState found = system.unpack(r.y[i]);
    EXPECT_LT((found.position - (there.position - beside.position)).norm(), 1e-6) << i;  // of 400 m
    EXPECT_LT((found.velocity - (there.velocity - beside.velocity)).norm(), 1e-9) << i;
  }
}

/// SPORT at rest on its stops.
Hub sport(const std::optional<OrbitalField>& field) {
  return Hub(testing::sport_hub(), testing::sport_booms(2), field);
}

/// Inertia of everything about the mass centre with the booms as they start, hub axes.
Matrix3d whole_inertia(const Hub& system, const std::vector<double>& angles) {
  double m = system.hub().m;
  Vector3d mc = system.hub().mc0;
  Matrix3d J = system.hub().J0;
  for (size_t i = 0; i < angles.size(); ++i) {
    const Appendage& a = system.appendages()[i];
    const Matrix3d C = system.boom_to_hub(i, angles[i]);
    const Vector3d d = a.hinge.point, c = C * a.body.mc0;
    m += a.body.m;
    mc += a.body.m * d + c;
    J += C * a.body.J0 * C.transpose() - tilde(d) * tilde(c) - tilde(c) * tilde(d) - a.body.m * tilde(d) * tilde(d);
  }
  return J + tilde(mc) * tilde(mc) / m;
}

/// Attitude (body -> LVLH) of a rigid body on a circular orbit after some time: classical Runge-Kutta on Euler's
/// equations with 3 n^2 c x J c, 1 s steps: (n h)^4 of 16 rad is 2e-12.
Matrix3d rigid_attitude(const Matrix3d& J, double n, const Vector3d& off, double duration) {
  using State7 = Eigen::Matrix<double, 7, 1>;
  const Matrix3d J_inverse = J.inverse();
  const auto frame = [n](double t) { return Eigen::AngleAxisd(-n * t, Vector3d::UnitY()).toRotationMatrix(); };
  const auto derivative = [&](double t, const State7& y) {
    const Vector3d w = y.tail<3>(), c = rotation_matrix(y.head<4>()).transpose() * frame(t).col(2);
    State7 d;
    d << 0.5 * quaternion_product(y.head<4>(), {0, w.x(), w.y(), w.z()}),
        J_inverse * (3 * n * n * c.cross(J * c) - w.cross(J * w));
    return d;
  };
  const Matrix3d C = Eigen::AngleAxisd(off.norm(), off.normalized()).toRotationMatrix();
  State7 y;
  y << quaternion(C), C.transpose() * Vector3d(0, -n, 0);
  const int steps = static_cast<int>(duration);
  const double h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    const State7 k1 = derivative(t, y), k2 = derivative(t + h / 2, y + h / 2 * k1),
                 k3 = derivative(t + h / 2, y + h / 2 * k2), k4 = derivative(t + h, y + h * k3);
    y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    y.head<4>().normalize();
  }
  return frame(duration).transpose() * rotation_matrix(y.head<4>());
}

double angle_between(const Matrix3d& A, const Matrix3d& B) {
  const Matrix3d D = A.transpose() * B;
  return 0.5 * Vector3d(D(2, 1) - D(1, 2), D(0, 2) - D(2, 0), D(1, 0) - D(0, 1)).norm();
}

/// Four hours with the booms at rest, rolled by 90 deg so that the axes of largest and least inertia are about the
/// orbit's normal and the vertical, and the motion is stable; it swings by the 6 deg between these axes and z, y. The
/// booms give way by less than 1e-8 rad.
TEST(OrbitalFlight, FourHoursWithBoomsAtRestFollowTheRigidBody) {
  const Orbit orbit(circular_orbit(405e3, 0.9076), {});
  const Hub system = sport(OrbitalField{orbit, false});  // linear, as for the rigid body: the rest makes 4e-9 rad
  const std::vector<double> angles(4, pi / 2);
  const Vector3d off(pi / 2, 3e-5, -4e-5);
  const Matrix3d rigid = rigid_attitude(whole_inertia(system, angles), rate_of(orbit), off, four_hours);
  const VectorXd y0 = system.pack(turning_with_orbit(system, angles, off));
  const TreeTrajectory r = integrate(system, y0, options("exponential", 1e-8, four_hours, 600));
  const double error = angle_between(in_lvlh(system, r, r.time.size() - 1), rigid);
  EXPECT_LT(error, 1e-9);
  EXPECT_GT(angle_between(in_lvlh(system, r, 0), rigid), 1e-3);
  EXPECT_LT(r.summary.energy_balance, 1e-9);
}

/// The same flight 7e6 m and 1e3 m from the planet's centre, at the same rate: what is linear in the distance between
/// the bodies is the same to round-off, and the rest is there (size / distance) at 1e3 m alone.
TEST(OrbitalFlight, DistanceOfThePlanetCostsNoDigits) {
  const std::vector<double> angles(4, pi / 2 - 0.05);
  const double far = 7e6, near = 1e3, mu = Planet().mu;
  const auto fly = [&](double radius, bool exact) {
    const Orbit orbit({.semi_major_axis = radius, .inclination = 0.9},
                      {.mu = mu * std::pow(radius / far, 3), .radius = radius});
    const Hub system = sport(OrbitalField{orbit, exact});
    return integrate(system, system.pack(turning_with_orbit(system, angles, {0.1, -0.2, 0.3})),
                     options("exponential", 1e-10, 20, 0.1));
  };
  const Index motion = sport({}).tree().layout().dissipated;
  const auto worst = [motion](const TreeTrajectory& a, const TreeTrajectory& b) {
    double error = 0;
    for (Eigen::Index k = 0; k < a.y[0].size(); ++k) {
      double size = 1e-12, difference = 0;
      for (size_t i = 0; i < a.y.size(); ++i) {
        size = std::max(size,
                        k < motion ? std::abs(a.y[i][k]) : a.y[i].tail(a.y[i].size() - motion).maxCoeff());  // energies
        difference = std::max(difference, std::abs(a.y[i][k] - b.y[i][k]));
      }
      error = std::max(error, difference / size);
    }
    return error;
  };
  const TreeTrajectory at_far = fly(far, false), at_near = fly(near, false), exact_far = fly(far, true),
                       exact_near = fly(near, true);
  EXPECT_LT(worst(at_far, at_near), 1e-9);
  EXPECT_LT(worst(at_far, exact_far), 1e-8);  // booms are 4e-8 of the distance long
  EXPECT_GT(worst(at_near, exact_near), 1e-9);
  // Absolute positions in double can not do it: a distance of a centimetre loses all but seven digits, its gravity all.
  const Vector3d R(4.1e6, -3.2e6, 4.4e6), rho(0.011, -0.007, 0.013), exact = differential_gravity({}, R, rho);
  EXPECT_GT(((R + rho) - R - rho).norm(), 1e-9 * rho.norm());
  EXPECT_GT((gravity({}, R + rho) - gravity({}, R) - exact).norm(), 1e-9 * exact.norm());
}

/// An orbit of two minutes, eccentric and about an oblate planet, so that gravity shows beside impacts of the booms.
/// The three agree to the given error when each is integrated to the given tolerance. Returns the number of impacts.
size_t expect_trees_and_multipliers_to_fly_as_the_hub(double duration, double tolerance, double agreement) {
  const double far = 7e6;
  const OrbitalElements elements = {.semi_major_axis = far, .eccentricity = 0.1, .inclination = 0.9, .periapsis = 0.4};
  const Planet planet = {.mu = 0.05 * 0.05 * far * far * far, .radius = 6e6, .J2 = earth_J2};
  const double output_step = duration / 30;
  const std::vector<double> angles(4, pi / 2 - 0.05);
  const Hub system = sport(OrbitalField{Orbit(elements, planet, duration)});
  const VectorXd y0 = system.pack(turning_with_orbit(system, angles, {0.1, -0.2, 0.3}));
  const TreeTrajectory hub = integrate(system, y0, options("exponential", tolerance, duration, output_step));
  const TreeTrajectory without = [&] {
    const Hub alone = sport({});
    return integrate(alone, y0, options("exponential", tolerance, duration, output_step));
  }();

  const Tree& tree = system.tree();
  const Index motion = tree.layout().dissipated;
  const auto apart = [&](size_t i, const VectorXd& y) {
    return (y.head(motion) - hub.y[i].head(motion)).cwiseAbs().maxCoeff();
  };
  double of_field = 0;
  for (size_t i = 0; i < hub.y.size(); ++i) of_field = std::max(of_field, apart(i, without.y[i]));
  EXPECT_GT(of_field, 10 * agreement);

  const TreeTrajectory of_tree = integrate(tree, y0, options("adams", tolerance, duration, output_step));
  double error = 0;
  for (size_t i = 0; i < hub.y.size(); ++i) error = std::max(error, apart(i, of_tree.y[i]));
  EXPECT_LT(error, agreement);
  EXPECT_LT(of_tree.summary.energy_balance, agreement / 10);

  const Multipliers multipliers(tree.scene());
  MultipliersOptions o{options("ida", tolerance, duration, output_step)};
  o.angles.assign(5, angles[0]);
  const MultibodyTrajectory by_multipliers = integrate_multipliers(multipliers, body_states(tree, 0, y0), o);
  double error_by_multipliers = 0;
  for (size_t i = 0; i < hub.y.size(); ++i)
    error_by_multipliers =
        std::max(error_by_multipliers, apart(i, tree.pack(tree_state(multipliers, by_multipliers.states[i]))));
  EXPECT_LT(error_by_multipliers, agreement);
  EXPECT_LT(by_multipliers.summary.energy_balance, agreement / 10);
  std::printf("in orbit: %.1e of the hub's motion by gravity; tree %.1e, energy %.1e; multipliers %.1e, energy %.1e\n",
              of_field, error, of_tree.summary.energy_balance, error_by_multipliers,
              by_multipliers.summary.energy_balance);
  return hub.events.size();
}

TEST(OrbitalFlight, TreesAndMultipliersFlyAsTheHub) {
  EXPECT_GT(expect_trees_and_multipliers_to_fly_as_the_hub(1, 1e-10, 1e-8), 5u);
}

TEST(OrbitalFlight, TreesAndMultipliersFlyAsTheHubForAMoment) {
  expect_trees_and_multipliers_to_fly_as_the_hub(0.3, 1e-8, 1e-6);
}

}  // namespace
}  // namespace flexboom
