#pragma once

#include "dynamics/numerics/collocation.hpp"
#include "dynamics/numerics/small_product.hpp"
#include "dynamics/numerics/spectrum.hpp"

#include <Eigen/Core>

#include <array>
#include <map>
#include <utility>
#include <vector>

namespace flexboom {

/// c^k phi_k(c h lambda), k = 0 .. degree + 2, of every eigenvalue at one fraction c of a step h, a column for each k:
/// real parts in the upper half, imaginary parts in the lower.
using GridPoint = Eigen::MatrixXd;

/// At every collocation point.
using Grid = std::array<GridPoint, collocation::points>;

/// L of x' = L x + N, in its eigenvectors.
struct LinearPart : Spectrum {
  /// Splits L; `omegas`: where angular velocities that attitudes follow are in x; `base`: the state where L was taken.
  /// @throws NumericalError when L has no full set of eigenvectors.
  LinearPart(const Eigen::MatrixXd& L, std::vector<int> omegas, Eigen::VectorXd base);

  /// Of another L that differs in one column, as by a stop. What the difference hardly couples stays as it is (the
  /// remainder takes that), so most eigenvectors of many modes are those of `other`.
  /// @throws NumericalError when the block that is coupled has no full set of eigenvectors, or they are not found.
  LinearPart(const LinearPart& other, Eigen::MatrixXd L, int column);

  Eigen::Index size() const { return to_modes.rows(); }
  const Eigen::VectorXd& lambda_re() const { return lambda_re_; }
  const Eigen::VectorXd& lambda_im() const { return lambda_im_; }

  /// Columns of x by those of z and back.
  void to_x(const Eigen::Ref<const Eigen::MatrixXd>& Z, Eigen::Ref<Eigen::MatrixXd> X) const {
    small_product(from_modes.leftCols(used_), Z.topRows(used_), X);
  }
  void to_z(const Eigen::Ref<const Eigen::MatrixXd>& X, Eigen::Ref<Eigen::MatrixXd> Z) const {
    small_product(to_modes.topRows(used_), X, Z.topRows(used_));
    Z.bottomRows(size() - used_).setZero();
  }

  /// N = to_modes F - lambda z, columns at a time.
  void remainder(const Eigen::Ref<const Eigen::MatrixXd>& F, const Eigen::Ref<const Eigen::MatrixXd>& Z,
                 Eigen::Ref<Eigen::MatrixXd> N) const;

  void point(double c, double h, GridPoint&) const;
  void grid(double h, Grid&) const;
  const Grid& kept_grid(double h);  // kept for the next step of the same size
  const GridPoint& kept_point(double c, double h);

  /// z at a point (shift 0), or its integral from the start over h (shift 1). M: the remainder's
  /// coefficients of c^m, times h m!.
  void combine(const GridPoint&, int shift, const Eigen::Ref<const Eigen::VectorXd>& z0, const Eigen::MatrixXd& M,
               Eigen::Ref<Eigen::VectorXd> z) const;

  Eigen::MatrixXd L;              // nx x nx, in full
  Eigen::MatrixXd of_modes;       // from_modes, transposed: a coordinate of x by z
  Eigen::MatrixXd omega_modes;    // angular velocities by z, three rows each
  Eigen::MatrixXd drift_modes;    // the same by the part of z that stays: eigenvalues that are zero
  Eigen::MatrixXd watched_modes;  // some entries of x by z, for who wants them alone
  Eigen::VectorXd base;
  std::vector<int> omegas;
  double fastest = 0;  // largest |eigenvalue| [1/s]
  double step = 0;     // to try first after an event: that of the last time, or a longer one where its error was small

 private:
  LinearPart(Spectrum, Eigen::MatrixXd L, std::vector<int> omegas, Eigen::VectorXd base);

  Eigen::VectorXd lambda_re_, lambda_im_;
  Eigen::Index used_;  // of z: the rest is always zero
  std::map<double, Grid> grids_;
  std::map<std::pair<double, double>, GridPoint> points_;
};

}  // namespace flexboom
