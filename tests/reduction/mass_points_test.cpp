#include "reduction/body/mass_points.hpp"

#include "fem/base/check.hpp"
#include "reduction/invariants/eq14.hpp"
#include "tests/reduction/export_testing.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Largest error of the sum over the points, entry by entry relative to sqrt(gram_ii gram_jj).
double error_of(const MassPoints& points, const MatrixXd& gram) {
  const VectorXd size = gram.diagonal().cwiseMax(0).cwiseSqrt();
  const MatrixXd error = points.m * points.z * points.z.transpose() - gram;
  double worst = 0;
  for (Index i = 0; i < gram.rows(); ++i) {
    for (Index j = 0; j < gram.cols(); ++j) {
      if (size(i) * size(j) > 0) worst = std::max(worst, std::abs(error(i, j)) / (size(i) * size(j)));
    }
  }
  return worst;
}

TEST(MassPoints, HaveTheIntegralsOfTheBody) {
  const MatrixXd& gram = test::bent().gram;
  const MassPoints points = mass_points(gram);
  EXPECT_EQ(points.z.cols(), gram.rows());  // no integral is zero by symmetry: full rank
  EXPECT_EQ(points.z.row(0), VectorXd::Ones(gram.rows()).transpose());
  EXPECT_NEAR(points.m * static_cast<double>(points.z.cols()), test::bent().m, 1e-15);
  EXPECT_LT(error_of(points, gram), 1e-13);  // round-off of an eigen-decomposition of 22 rows
}

TEST(MassPoints, AreAsManyAsTheRank) {
  // A line mass with shapes along y only: 1, x and two shapes.
  const ReducedBody body = eq14::reduced_body({1.2, 0.3, 5.0}, 2, eq14::Planes::xy, "boom");
  const MassPoints points = mass_points(body.gram);
  EXPECT_EQ(points.z.cols(), 4);
  EXPECT_LT(error_of(points, body.gram), 1e-14);
}

TEST(MassPoints, OfOneParticleAreItself) {
  const VectorXd z = (VectorXd(7) << 1, 0.1, -0.2, 0.3, 2, 0, -1e-3).finished();
  const MassPoints points = mass_points(0.5 * z * z.transpose());
  ASSERT_EQ(points.z.cols(), 1);
  EXPECT_NEAR(points.m, 0.5, 1e-16);
  EXPECT_LT((points.z.col(0) - z).norm(), 1e-14);
}

TEST(MassPoints, NeedAMass) {
  EXPECT_THROW(mass_points(MatrixXd()), InputError);
  EXPECT_THROW(mass_points(MatrixXd::Zero(4, 4)), InputError);
}

}  // namespace
}  // namespace flexboom
