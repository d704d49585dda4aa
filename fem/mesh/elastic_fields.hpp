#pragma once

#include "fem/mesh/elasticity.hpp"

#include <Eigen/Core>

#include <array>

// Many displacement fields at the points of a solid at once. The fields are kept side by side, so that every step is
// one over neighbours in memory.
namespace flexboom::elasticity {

/// Nodal components of vectors q (freedoms x k) less those of the first node, which strain nothing: n x 3 k, column
/// k i + c for component i of vector c.
Eigen::MatrixXd fields_of(const Eigen::Ref<const Eigen::MatrixXd>& q);

/// Slopes of k vector fields at the points of a volume.
struct FieldSlopes {
  FieldSlopes(Eigen::Index k, Eigen::Index points) : volumes(points), slopes(k, 9 * points) {}

  /// Sets point p from the slopes by reference coordinates xi_r (3 k each, in the order of fields_of) and G(r, i) =
  /// d xi_r / d x_i.
  void set(Eigen::Index p, double volume, const Eigen::Matrix3d& G, const std::array<const double*, 3>& by_reference);

  Eigen::VectorXd volumes;  // [m^3]
  Eigen::MatrixXd slopes;   // k x 9 Q, column 9 p + 3 i + m: of component m along x_i
};

/// ElementType::energy_strains of these points: k x 6 Q.
Eigen::MatrixXd energy_strains(const FieldSlopes&, const Lame&);

/// ElementType::add_prestress_work of these points: Cauchy's stress of the prestress times Green's second-order strain,
/// volume sigma_ij (du_k/dx_i . du_l/dx_j).
void add_prestress_work(const FieldSlopes& prestress, const FieldSlopes& shapes, const Lame&,
                        Eigen::Ref<Eigen::MatrixXd> work);

}  // namespace flexboom::elasticity
