#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/booms/boom.hpp"
#include "fem/mesh/element.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

// Small bodies and slow, plain routes to their answers, for the tests of this folder.
namespace flexboom::testing {

inline constexpr double eps = std::numeric_limits<double>::epsilon();
inline constexpr double pi = std::numbers::pi;

inline const Material aluminium{67e9, 0.33, 2840};

/// The text of the InputError that `call` throws, or what went wrong instead.
template <class Call>
std::string input_error(const Call& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

/// One element of a row of the table along `axis`, with unequal bending planes.
inline Mesh one_element(const ElementType& type, int order, const Eigen::Vector3d& axis, const Eigen::Vector3d& y_axis,
                        const SectionShape& start, const SectionShape& end) {
  Mesh mesh;
  mesh.nodes.resize(3, 2);
  mesh.nodes << Eigen::Vector3d(0.1, -0.2, 0.3), Eigen::Vector3d(0.1, -0.2, 0.3) + axis;
  const BeamTheory theory = type.name == "beam-timoshenko" ? BeamTheory::timoshenko : BeamTheory::euler_bernoulli;
  mesh.beam_properties.push_back({start, end, aluminium, theory, {}, true, y_axis});
  mesh.elements.push_back({element_type(type.name), {0, 1}, order, 0});
  return mesh;
}

/// A uniform boom along x.
inline BeamGeometry uniform_boom(const SectionShape& section, double length, BeamTheory theory, int elements,
                                 int order) {
  BeamGeometry boom;
  boom.segments.push_back({section, section, length, aluminium, elements});
  boom.theory = theory;
  boom.order = order;
  return boom;
}

/// A symmetric matrix of which the lower triangle is stored.
inline Eigen::MatrixXd full(const SparseMatrix& A) { return Eigen::MatrixXd(A).selfadjointView<Eigen::Lower>(); }

inline Eigen::MatrixXd full(const SparseMatrix& A, const std::vector<int>& dofs) { return full(A)(dofs, dofs); }

/// Freedoms left when all of the listed nodes are clamped and absent ones are dropped, ascending.
inline std::vector<int> free_dofs(const DofMap& dofs, const std::vector<int>& clamped_nodes) {
  std::vector<char> leaves = dofs.absent;
  for (const int node : clamped_nodes) {
    for (int k = 0; k < dofs.freedoms_of(node); ++k) leaves[static_cast<size_t>(dofs.of_node(node, k))] = 1;
  }
  std::vector<int> free;
  for (int dof = 0; dof < dofs.count; ++dof) {
    if (!leaves[static_cast<size_t>(dof)]) free.push_back(dof);
  }
  return free;
}

/// The free freedoms that K and M connect with the freedom `seed`: one bending plane, torsion or extension.
inline std::vector<int> coupled_with(const Assembly& a, const std::vector<int>& free, int seed) {
  std::vector<char> allowed(static_cast<size_t>(a.dofs.count), 0), reached = allowed;
  for (int dof : free) allowed[static_cast<size_t>(dof)] = 1;
  std::vector<int> front = {seed};
  reached[static_cast<size_t>(seed)] = 1;
  const SparseMatrix K = a.K.selfadjointView<Eigen::Lower>();
  const SparseMatrix M = a.M.selfadjointView<Eigen::Lower>();
  while (!front.empty()) {
    const int j = front.back();
    front.pop_back();
    for (const SparseMatrix* A : {&K, &M}) {
      for (SparseMatrix::InnerIterator it(*A, j); it; ++it) {
        const auto i = static_cast<size_t>(it.row());
        if (!allowed[i] || reached[i]) continue;
        reached[i] = 1;
        front.push_back(static_cast<int>(i));
      }
    }
  }
  std::vector<int> result;
  for (int dof : free) {
    if (reached[static_cast<size_t>(dof)]) result.push_back(dof);
  }
  return result;
}

/// Modes of K phi = omega^2 M phi on the listed freedoms, lowest first, by a dense solve of M phi = mu K phi (which
/// keeps the digits of the low end) and a Rayleigh quotient from element points.
inline std::vector<double> dense_frequencies_hz(const Mesh& mesh, const Assembly& a, const std::vector<int>& dofs,
                                                int count) {
  const Eigen::MatrixXd K = full(a.K, dofs), M = full(a.M, dofs);
  const Eigen::VectorXd scale = K.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * M * scale.asDiagonal(),
                                                                         scale.asDiagonal() * K * scale.asDiagonal());
  std::vector<double> frequencies;
  for (int k = 0; k < count; ++k) {
    const Eigen::VectorXd phi = scale.asDiagonal() * solver.eigenvectors().col(K.cols() - 1 - k);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(a.dofs.count);
    for (size_t i = 0; i < dofs.size(); ++i) u(dofs[i]) = phi(static_cast<Eigen::Index>(i));
    const PointEnergies energy = point_energies(mesh, a, u);
    frequencies.push_back(std::sqrt(energy.strain(0) / energy.kinetic(0)) / (2 * pi));
  }
  return frequencies;
}

/// Clamped frequencies of the motions that couple with component `component` (0 axial, 1 bending y, 2 bending z, 3
/// torsion).
inline std::vector<double> clamped_frequencies_hz(const BeamGeometry& boom, int component, int count) {
  const Mesh mesh = make_mesh(boom);
  const Assembly a = assemble(mesh);
  const std::vector<int> free = free_dofs(a.dofs, node_set(mesh, "root"));
  const int tip = a.dofs.of_node(node_set(mesh, "tip")[0], component);
  return dense_frequencies_hz(mesh, a, coupled_with(a, free, tip), count);
}

/// Rows of a CSV file of tests/reference with the given first cell, as text.
inline std::vector<std::vector<std::string>> reference_rows(const std::string& file, const std::string& first_cell) {
  std::ifstream in(std::string(FLEXBOOM_TEST_DATA) + "/reference/" + file);
  EXPECT_TRUE(in.good()) << file;
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(in, line);) {
    std::vector<std::string> cells;
    std::istringstream cells_in(line);
    for (std::string cell; std::getline(cells_in, cell, ',');) cells.push_back(cell);
    if (!cells.empty() && cells[0] == first_cell) rows.push_back(cells);
  }
  EXPECT_FALSE(rows.empty()) << file << " has no row " << first_cell;
  return rows;
}

}  // namespace flexboom::testing
