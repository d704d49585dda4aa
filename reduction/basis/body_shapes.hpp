#pragma once

#include "fem/assembly/assembly.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/body/reduced_body.hpp"

#include <vector>

namespace flexboom {

/// Mean motion of nodes, as a distributing connection (RBE3) has it at their centre. It has the rows ux uy uz rx ry rz
/// over the freedoms of the mesh. Weights, of sum 1, are equal where none are given. Rotations are the mean of the
/// nodes' own where they have any. Nodes of solids on a line or alone take those of all nodes of the elements around
/// them. `turns`: whether there are rotations at all.
struct MeanMotion {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // centre of the nodes, mesh axes [m]
  std::vector<Eigen::Triplet<double>> rows;            // (component, freedom, coefficient)
  bool turns = true;

  /// The motion in each column of Phi (freedoms x n), 6 x n [m, rad].
  Eigen::MatrixXd of(const Eigen::MatrixXd& Phi) const;

  /// Nodal forces of a unit force or torque along each component at the centre, freedoms x 6.
  Eigen::MatrixXd loads(int freedoms) const;
};
MeanMotion mean_motion(const Mesh&, const DofMap&, const std::vector<int>& nodes,
                       const std::vector<double>& weights = {});

/// A marker at every interface and every other node set.
std::vector<Marker> body_markers(const Mesh&, const DofMap&, const ModalBasis&);

/// Lines along beams and the surface of solids.
DisplayShape display_shape(const Mesh&, const DofMap&, const Eigen::MatrixXd& Phi);

}  // namespace flexboom
