#pragma once

#include "fem/constraints.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <vector>

namespace flexboom {

/// Stiffness and mass of a full model over its unknowns, and what each unknown is.
struct MatrixModel {
  struct Freedom {
    int node = -1;      // -1: inside element `element`
    int element = -1;   // of an inner freedom
    int component = 0;  // of a node 0..5: ux uy uz rx ry rz; of an element: 0, 1, ...
    long label = 0;     // number of the node or element in the file of the mesh
  };
  SparseMatrix K;  // lower triangle
  SparseMatrix M;
  std::vector<Freedom> freedoms;  // one per row
  Eigen::MatrixXd T;              // rows x 6: rigid motions (3 translations, 3 rotations about the body origin)
};

/// K and M over the unknowns that clamps and connections leave. `T` holds the rigid motions of the whole
/// body: K T = 0 where nothing is clamped, and T^T M T is its rigid inertia.
MatrixModel matrix_model(const Mesh&, const Assembly&, const Unknowns&);

/// Writes K.mtx, M.mtx, T.mtx (Matrix Market) and freedoms.csv (`row,node,element,component,label`, from 0) into a
/// folder, which is made. Numbers read back to the last bit. @throws InputError when a file cannot be written.
void write_matrix_market(const std::filesystem::path& folder, const MatrixModel&);

/// @throws InputError with file:line:column of what is wrong.
MatrixModel read_matrix_market(const std::filesystem::path& folder);

}  // namespace flexboom
