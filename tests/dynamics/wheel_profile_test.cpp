#include "dynamics/model/wheel_profile.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <numbers>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

using std::numbers::pi;
const Matrix3d J = (Matrix3d() << 0.135, 0.001, 0.002, 0.001, 0.105, -0.003, 0.002, -0.003, 0.0586).finished();

Vector4d inverse(const Vector4d& q) { return {q[0], -q[1], -q[2], -q[3]}; }

/// A rigid body with three wheels by Runge-Kutta, Euler's equations with gyroscopic torques: it turns as asked, about
/// axes that are no principal ones, and is at rest in between.
TEST(WheelProfile, TurnsTwiceAboutEachAxisInTurn) {
  for (const char* profile : {"trapezoid", "smooth"}) {
    std::vector<WheelTurn> turns;
    for (int axis = 0; axis < 3; ++axis) {
      const double start = axis == 0 ? 1 : rest_to_rest(turns.back().manoeuvre).corners.back();
      turns.push_back({Vector3d::Unit(axis), {profile, 4 * pi, 0.5, 0.1, start + 2}});
    }
    const WheelTorques wheels = wheel_torques(J, turns);
    ASSERT_EQ(turns.size(), 3u);
    using State = Eigen::Matrix<double, 13, 1>;  // attitude, omega, wheel momenta, turned angle by axis
    const auto torque = [&](double t) {
      return Vector3d(wheels.torque[0].function.value(t), wheels.torque[1].function.value(t),
                      wheels.torque[2].function.value(t));
    };
    const auto derivative = [&](double t, const State& y) {
      const Vector4d attitude = y.head<4>();
      const Vector3d w = y.segment<3>(4), h = y.segment<3>(7);
      State d;
      d << 0.5 * quaternion_product(attitude, {0, w.x(), w.y(), w.z()}),
          J.inverse() * (-torque(t) - w.cross(J * w + h)), torque(t), w;
      return d;
    };
    State y = State::Zero();
    y[0] = 1;
    double t = 0;
    std::vector<double> stops = wheels.torque[0].corners;
    for (const double next : stops) {  // corners are step ends
      const int steps = 400;
      const double step = (next - t) / steps;
      for (int i = 0; i < steps; ++i) {
        const double a = t + i * step + 1e-12, b = a + step - 2e-12, m = a + step / 2;
        const State k1 = derivative(a, y), k2 = derivative(m, y + step / 2 * k1), k3 = derivative(m, y + step / 2 * k2),
                    k4 = derivative(b, y + step * k3);
        y += step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      }
      t = next;
      EXPECT_LT(rotation_vector(quaternion_product(inverse(commanded_attitude(turns, t)), y.head<4>())).norm(), 1e-5);
    }
    EXPECT_EQ(t, wheels.end);
    EXPECT_LT((y.tail<3>() - Vector3d::Constant(4 * pi)).norm(), 1e-6);  // truncation of 400 steps
    EXPECT_LT(rotation_vector(y.head<4>()).norm(), 1e-5);
    EXPECT_LT(y.segment<3>(4).norm(), 1e-8);
    EXPECT_LT(y.segment<3>(7).norm(), 1e-8);
  }
}

TEST(WheelProfile, RefusesWhatCanNotBe) {
  const Manoeuvre m{"smooth", 1, 1, 1, 0};
  EXPECT_THROW(wheel_torques(J, {{Vector3d::UnitX(), m}, {Vector3d::UnitY(), m}}), InputError);
  EXPECT_THROW(wheel_torques(J, {{Vector3d(1, 1, 0), m}}), InputError);
  EXPECT_THROW(wheel_torques(-J, {{Vector3d::UnitX(), m}}), InputError);
}

}  // namespace
}  // namespace flexboom
