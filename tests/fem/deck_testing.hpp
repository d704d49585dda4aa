#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/assembly/constraints.hpp"
#include "mesh_file_testing.hpp"

#include <algorithm>
#include <string>

namespace flexboom::testing {

inline std::filesystem::path test_deck(const std::string& name) {
  return std::filesystem::path(FLEXBOOM_TEST_DATA) / "fem" / "decks" / name;
}

/// Mass of everything: the rigid translation along x in M.
inline double total_mass(const Mesh& mesh) {
  const Assembly a = assemble(mesh);
  const Eigen::VectorXd t = rigid_motions(mesh, a.dofs).col(0);
  return t.dot(symmetric_product(a.M, t).col(0));
}

inline bool has_note(const MeshFile& file, std::string_view part) {
  return std::ranges::any_of(file.notes, [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

/// Largest residual of the connections and equations of a mesh for freedoms u.
inline double residual(const Mesh& mesh, const DofMap& dofs, const Eigen::VectorXd& u) {
  double largest = 0;
  for (const ConstraintRow& row : constraint_rows(mesh, dofs)) {
    double sum = 0;
    for (const auto& [dof, coefficient] : row.terms) sum += coefficient * u(dof);
    largest = std::max(largest, std::abs(sum));
  }
  return largest;
}

/// The same for the six rigid motions of a mesh, whatever holds it.
inline double rigid_residual(const Mesh& mesh) {
  const Assembly a = assemble(mesh);
  const Eigen::MatrixXd T = rigid_motions(mesh, a.dofs);
  double largest = 0;
  for (int k = 0; k < 6; ++k) largest = std::max(largest, residual(mesh, a.dofs, T.col(k)));
  return largest;
}

/// Index of the node of a label.
inline int node_labelled(const Mesh& mesh, long label) {
  const auto found = std::ranges::find(mesh.node_labels, label);
  EXPECT_NE(found, mesh.node_labels.end()) << label;
  return static_cast<int>(found - mesh.node_labels.begin());
}

/// Components that the supports of a mesh hold at a node, "123".
inline std::string held(const Mesh& mesh, long label) {
  std::string result;
  for (const Support& support : mesh.supports) {
    if (mesh.node_labels[static_cast<size_t>(support.node)] != label) continue;
    for (size_t k = 0; k < 6; ++k) {
      if (support.components[k]) result += static_cast<char>('1' + k);
    }
  }
  return result;
}

}  // namespace flexboom::testing
