#pragma once

#include "fem/assembly/assembly.hpp"

#include <Eigen/Core>

#include <string>
#include <utility>
#include <vector>

namespace flexboom {

/// "ux of node 17", by the label of the node; of an internal freedom "an internal freedom of element 3".
std::string freedom_name(const Mesh&, const DofMap&, int freedom);

/// Which freedoms elements resist. What else the mesh has (reference nodes, masses) moves without strain.
std::vector<char> strained_freedoms(const Mesh&, const DofMap&);

/// Which freedoms neither elements nor masses know: those of reference nodes, which constraints alone move.
std::vector<char> idle_freedoms(const Mesh&, const DofMap&);

/// Rows of equations that share idle freedoms, as a dense matrix.
struct IdleGroup {
  std::vector<int> rows;      // of those handed over
  std::vector<int> freedoms;  // one per column
  Eigen::MatrixXd A;
};

/// Groups of rows of (freedom, coefficient); no row without a term, no freedom beyond `count`.
std::vector<IdleGroup> idle_groups(const std::vector<std::vector<std::pair<int, double>>>& rows, int count);

/// A rank below this of the largest column is none.
constexpr double idle_rank = 1e-10;

}  // namespace flexboom
