#pragma once

#include "apps/model/prepared_body.hpp"
#include "dynamics/relative/tree.hpp"
#include "fem/formats/vtk/vtk.hpp"

#include <Eigen/Core>

/// What bodies look like.
namespace flexboom {

/// A box about the mass centre of a body, with edges. `size`: its sides along the axes of the body [m]. Where `size` is
/// zero, the box has the mass and inertia of the body.
DisplayShape box_of(const ReducedBody&, const Eigen::Vector3d& size = Eigen::Vector3d::Zero());

/// Adds the lines and triangles of a shape as cells of a grid in which its points begin at `first`.
void add_cells(const DisplayShape&, int first, VtkGrid&);

/// Bodies where a state of the tree has them, deformed, inertial axes. Point data "displacement" [m], cell data "body"
/// numbers them from 0.
VtkGrid picture(const Tree&, double t, const Eigen::VectorXd& y);

}  // namespace flexboom
