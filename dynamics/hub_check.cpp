#include "dynamics/hub_check.hpp"

#include "fem/check.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace flexboom {

void check_hub_inertia(const equations::Model& model, int p) {
  equations::Scratch<double, Quad> scratch(model);
  const std::vector<double> rest(static_cast<size_t>(3 + p), 0.0);
  const std::vector<char> open(rest.size(), 0);
  const equations::HubSystem<double> hub =
      equations::condensed_hub(model, rest.data(), rest.data(), open, scratch, nullptr);
  const Eigen::Matrix3d mass = spatial::eigen(hub.tt), J = spatial::eigen(hub.ww);
  Eigen::Matrix3d coupling;
  for (size_t r = 0; r < 3; ++r) coupling.row(static_cast<Eigen::Index>(r)) = spatial::eigen(hub.tw.row[r]).transpose();
  const Eigen::Matrix3d left = J - coupling.transpose() * mass.ldlt().solve(coupling);
  const Eigen::Vector3d inertia =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>((left + left.transpose()) / 2).eigenvalues();
  require(
      inertia(0) > 1e-12 * J.trace(),
      fmt::format("the hub: with everything on it, it has an inertia of {:.3g} kg m^2 about one axis and {:.3g} about "
                  "another: too little to compute with",
                  std::max(0.0, inertia(0)), inertia(2)));
}

}  // namespace flexboom
