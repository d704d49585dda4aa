#pragma once

#include "fem/assembly/constraints.hpp"
#include "reduction/body/mode_kind.hpp"
#include "reduction/body/reduced_body.hpp"
#include "reduction/eigen/solver.hpp"

#include <Eigen/Core>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace flexboom {

/// Shapes of a reduced body over all freedoms of its mesh (zero where clamped), and what they are.
struct ModalBasis {
  Eigen::MatrixXd Phi;    // freedoms x n
  Eigen::VectorXd omega;  // [rad/s], of modes ascending, within a group of equal frequencies to round-off; interface: 0
  std::vector<ModeKind> kind;   // one per shape
  Eigen::VectorXd round_off{};  // what the round-off of K changes of each frequency, relative; empty: not looked for
  EigenSummary summary;
  double mass = 0;                      // of the whole mesh [kg]
  int unknowns = 0;                     // freedoms left in the eigenproblem
  int rigid_freedoms = 0;               // rigid motions that the shapes hold: 6 of a free body
  std::string frame = "clamped";        // as ReducedBody::frame
  std::vector<Coordinate> coordinates;  // one per shape
  std::vector<Interface> interfaces;
  std::shared_ptr<const SparseFactor> factor{};  // of K over the unknowns, with EigenOptions::keep_factor; may be null
  std::shared_ptr<const SparseMatrix> K{};       // that K, where there is the factor
  std::vector<int> interface_nodes;              // the node that carries each; -1: the mean of the node set of its name
};

/// Coordinate table of a basis of modes, from `kind` and `omega`.
std::vector<Coordinate> mode_table(const ModalBasis&);

/// Takes an interface to a choice of coordinates: -1 when not all of its own are kept, one after the other.
void renumber(Interface&, const std::vector<int>& modes);

/// The listed shapes of a basis, in that order. An interface that loses a coordinate has none any more.
/// @throws InputError for an index that does not exist.
ModalBasis selected(const ModalBasis&, const std::vector<int>& modes);

/// Modes of the mesh with the nodes of `clamp` fixed. Groups of equal frequencies are aligned to the body's axes
/// (deflection of the tip along y first, then z, x, rotations). Signs are fixed: positive tip deflection along the
/// local axis (positive tip rotation for torsion). Shapes are scaled so that the tip deflection is 2, as in eq. 14;
/// torsion to Me_kk = m (see README). What nothing holds is free and its rigid modes come first.
/// @throws InputError, NumericalError as solve_modes.
ModalBasis clamped_modes(const Mesh&, const Assembly&, const Clamp&, const EigenOptions&, int threads = 1);

/// The same for large meshes: K and M are released once their parts over the unknowns are made (both are empty
/// afterwards).
ModalBasis clamped_modes_releasing(const Mesh&, Assembly&, const Clamp&, const EigenOptions&, int threads = 1);

/// The first `count` modes of the given kinds (all kinds when empty) among `all` that there are. `solve` is asked for
/// more and more modes until there are enough. @throws InputError when there are not.
ModalBasis modes_of_kind(const std::function<ModalBasis(const EigenOptions&)>& solve, int all, int count,
                         const std::vector<ModeKind>& kinds, EigenOptions);

/// Those of clamped_modes.
ModalBasis clamped_modes_of_kind(const Mesh&, const Assembly&, const Clamp&, int count,
                                 const std::vector<ModeKind>& kinds, EigenOptions);

/// The modes of the body in the span of `shapes` (freedoms x n, zero where clamped): Me and Ke are diagonal, alignment,
/// signs and sizes are those of clamped_modes. `rigid`: how many rigid motions the span holds.
/// @throws NumericalError when the shapes depend on each other.
ModalBasis ritz_modes(const Mesh&, const Assembly&, const Clamp&, const Eigen::MatrixXd& shapes, int rigid = 0,
                      int threads = 1);

}  // namespace flexboom
