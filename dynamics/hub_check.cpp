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
  const Eigen::Matrix<double, 6, 6> M = equations::mass_matrix(hub);
  const Eigen::Matrix3d mass = M.topLeftCorner<3, 3>(), coupling = M.topRightCorner<3, 3>(),
                        J = M.bottomRightCorner<3, 3>();
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
