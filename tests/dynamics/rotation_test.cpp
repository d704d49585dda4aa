#include "dynamics/numerics/rotation.hpp"

#include "dynamics/numerics/dual.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

Vector4d quaternion_of(const Vector3d& rotation) {
  const double angle = rotation.norm();
  Vector4d q;
  q << std::cos(angle / 2), (angle > 0 ? std::sin(angle / 2) / angle : 0.5) * rotation;
  return q;
}

TEST(Rotation, VectorOfAQuaternionIsItsLogarithm) {
  for (const double angle : {0.0, 1e-200, 1e-12, 1e-3, 1.0, 3.0}) {
    const Vector3d r = angle * Vector3d(2, -1, 2) / 3;
    EXPECT_LT((rotation_vector(quaternion_of(r)) - r).norm(), 4e-16 * angle + 1e-300) << angle;  // two roundings
    EXPECT_LT((rotation_vector(-quaternion_of(r)) - r).norm(), 4e-16 * angle + 1e-300) << "both signs are one rotation";
  }
}

TEST(Rotation, QuaternionProductComposesMatrices) {
  const Vector4d a = quaternion_of({0.3, -0.2, 0.9}), b = quaternion_of({-1, 0.5, 0.1});
  EXPECT_LT((rotation_matrix(quaternion_product(a, b)) - rotation_matrix(a) * rotation_matrix(b)).norm(), 1e-15);
}

TEST(Rotation, TildeIsTheCrossProduct) {
  const Vector3d a(1, 2, 3), b(-4, 5, 0.5);
  EXPECT_EQ((tilde(a) * b - a.cross(b)).norm(), 0.0);
}

TEST(Dual, CarriesTheDerivativeOfEveryOperation) {
  using D = Dual<1>;
  const auto f = [](const auto& x) {
    using std::cos;
    using std::sin;
    return (3.0 * x * x - x / (x + 2.0)) * sin(x) - cos(2.0 * x) * x;
  };
  const double x = 0.7, h = 1e-6;
  D dual(x);
  dual.d[0] = 1;
  EXPECT_EQ(f(dual).v, f(x));
  EXPECT_NEAR(f(dual).d[0], (f(x + h) - f(x - h)) / (2 * h), 1e-9);  // truncation h^2, round-off eps / h
}

}  // namespace
}  // namespace flexboom
