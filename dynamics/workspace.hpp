#pragma once

// Scratch of one thread for System. Internal to `dynamics`; users hold it through std::unique_ptr<Workspace>.

#include "dynamics/hub_equations.hpp"
#include "dynamics/system.hpp"

#include <Eigen/LU>

namespace flexboom {

class Workspace {
 public:
  using D = Dual<8>;         // columns of the Jacobian of one body
  using D4 = Dual<3, Quad>;  // of four

  Workspace(const equations::Model& model, const Layout& layout)
      : scratch(model),
        dual_scratch(model),
        dudot(layout.u, layout.p + layout.u),
        dahub(3, layout.p + layout.u),
        hub_columns(6, layout.p + layout.u),
        response(layout.p, 6),
        newton(layout.u, layout.u),
        lu(layout.u),
        rhs(layout.u),
        rhs_p(layout.p),
        delta(layout.p + layout.u),
        y(layout.size),
        a_hub(Eigen::Vector3d::Zero()) {}

  equations::Scratch<double, Quad> scratch;
  equations::Scratch<D, D4> dual_scratch;

  // Jacobian blocks and the state they belong to.
  Eigen::MatrixXd dudot;        // d(u_dot)/d(p, u)
  Eigen::MatrixXd dahub;        // d(a_hub)/d(p, u), hub axes
  Eigen::MatrixXd hub_columns;  // of the hub's six equations, then of its accelerations
  Eigen::MatrixXd response;     // of Delta_ddot and q_ddot to the hub's accelerations
  Eigen::MatrixXd newton;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
  Eigen::VectorXd rhs, rhs_p, delta;
  Eigen::VectorXd y;
  Eigen::Vector3d a_hub;
  double gamma = 0;
};

}  // namespace flexboom
