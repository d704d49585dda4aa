#pragma once

#include "dynamics/collocation.hpp"

#include <Eigen/Core>

#include <array>
#include <map>
#include <vector>

namespace flexboom {

/// c^k phi_k(c h lambda), k = 0 .. degree + 3, of every eigenvalue at one fraction c of a step h, a column for each k:
/// real parts in the upper half, imaginary parts in the lower.
using GridPoint = Eigen::MatrixXd;

/// At every collocation point, and between them where somebody looked: `between[j][l]` parts the interval that ends at
/// point j in 2^l.
struct Grid {
  std::array<GridPoint, collocation::points> at;
  std::array<std::vector<std::vector<GridPoint>>, collocation::points> between;
};

/// L of x' = L x + N(x), x = (p, u), in its eigenvectors: x = from_modes z, z = to_modes x. Of a complex pair one is
/// kept; z holds real parts, then imaginary parts.
struct LinearPart {
  /// Splits L; `a_hub`: acceleration of the hub's origin by x, 3 x nx; `first_omega`: place of the hub's angular
  /// velocity in x, or -1; `base`: p where L was taken.
  /// @throws NumericalError when L has no full set of eigenvectors.
  LinearPart(Eigen::MatrixXd L, Eigen::MatrixXd a_hub, int first_omega, Eigen::VectorXd base);

  Eigen::Index size() const { return to_modes.rows(); }

  /// N = to_modes F - lambda z, columns at a time.
  void remainder(const Eigen::Ref<const Eigen::MatrixXd>& F, const Eigen::Ref<const Eigen::MatrixXd>& Z,
                 Eigen::Ref<Eigen::MatrixXd> N) const;

  void point(double c, double h, GridPoint&) const;
  void grid(double h, Grid&) const;
  Grid& kept_grid(double h);  // kept for the next step of the same size

  /// The points that part the interval before point j in 2^level.
  const std::vector<GridPoint>& between(Grid&, double h, int j, int level) const;

  /// z at a point (shift 0), or its first or second integral from the start over h or h^2. M: the remainder's
  /// coefficients of c^m, times h m!.
  void combine(const GridPoint&, int shift, const Eigen::Ref<const Eigen::VectorXd>& z0, const Eigen::MatrixXd& M,
               Eigen::Ref<Eigen::VectorXd> z) const;

  Eigen::VectorXcd lambda;
  Eigen::MatrixXd from_modes, to_modes;
  Eigen::MatrixXd a_hub;                     // 3 x nx
  Eigen::MatrixXd omega_modes, a_hub_modes;  // omega and a_hub by z
  Eigen::MatrixXd drift_modes;               // omega by the part of z that stays: eigenvalues that are zero
  Eigen::VectorXd base;
  double step = 0;  // that served after the last event

 private:
  Eigen::VectorXd lambda_re_, lambda_im_;
  std::map<double, Grid> grids_;
};

}  // namespace flexboom
