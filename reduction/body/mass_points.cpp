#include "reduction/body/mass_points.hpp"

#include "fem/base/check.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MassPoints mass_points(const MatrixXd& gram) {
  require(gram.size() > 0 && gram(0, 0) > 0, "mass points need the gram matrix of a body with a positive mass");
  // Rows of unit size, since metres and shapes differ by powers of ten; a row of zeros stays one.
  const VectorXd scale = gram.diagonal().cwiseMax(0).cwiseSqrt();
  const VectorXd inverse = scale.unaryExpr([](double s) { return s > 0 ? 1 / s : 0; });
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(inverse.asDiagonal() * gram * inverse.asDiagonal()));
  const VectorXd& lambda = eigen.eigenvalues();
  // What is below the round-off of the decomposition is no direction of the body.
  const double least = static_cast<double>(gram.rows()) * 2.2e-16 * lambda(lambda.size() - 1);
  const Index r = (lambda.array() > least).count();
  // gram = L L^T = (L H) (L H)^T
  MatrixXd L = scale.asDiagonal() * eigen.eigenvectors().rightCols(r) * lambda.tail(r).cwiseSqrt().asDiagonal();
  // H: the reflection that makes all entries of the first row sqrt(m / r).
  VectorXd v = L.row(0).transpose().normalized();
  v.array() -= 1 / std::sqrt(static_cast<double>(r));
  if (v.squaredNorm() > 0) L -= (L * v) * (2 / v.squaredNorm() * v.transpose());
  MassPoints points{.m = gram(0, 0) / static_cast<double>(r), .z = L / std::sqrt(gram(0, 0) / static_cast<double>(r))};
  points.z.row(0).setOnes();
  return points;
}

}  // namespace flexboom
