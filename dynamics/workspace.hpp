#pragma once

// Scratch of one thread for System. Internal to `dynamics`; users hold it through std::unique_ptr<Workspace>.

#include "dynamics/equations.hpp"

#include <Eigen/LU>

namespace flexboom {

class Workspace {
 public:
  static constexpr int lanes = 8;
  using D = Dual<lanes>;

  Workspace(const equations::Model& model, const Layout& layout)
      : scratch(model),
        dual_scratch(model),
        parts(model.bodies.size()),
        dual_in(static_cast<size_t>(layout.p + layout.u)),
        dual_out(static_cast<size_t>(layout.u)),
        dudot(layout.u, layout.p + layout.u),
        dahub(3, layout.p + layout.u),
        newton(layout.u, layout.u),
        lu(layout.u),
        rhs(layout.u),
        rhs_p(layout.p),
        delta(layout.p + layout.u),
        y(layout.size),
        a_hub(Eigen::Vector3d::Zero()) {}

  equations::Scratch<double> scratch;
  equations::Scratch<D> dual_scratch;
  std::vector<equations::HubSystem<double>> parts;  // what each body adds to the hub
  std::vector<D> dual_in, dual_out;

  // Jacobian blocks and the state they belong to.
  Eigen::MatrixXd dudot;  // d(u_dot)/d(p, u)
  Eigen::MatrixXd dahub;  // d(a_hub)/d(p, u), hub axes
  Eigen::MatrixXd newton;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
  Eigen::VectorXd rhs, rhs_p, delta;
  Eigen::VectorXd y;
  Eigen::Vector3d a_hub;
  double gamma = 0;
};

}  // namespace flexboom
