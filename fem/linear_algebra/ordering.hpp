#pragma once

#include "fem/linear_algebra/sparse.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// A fill-reducing order of the unknowns and what a Cholesky factor costs in it.
struct Ordering {
  std::string name;              // "amd", "rcm", "metis", "slices"
  std::vector<int> permutation;  // unknown at each place
  double nonzeros = 0;           // entries of L
  double flops = 0;              // multiplications and additions of a factorisation
};

/// The cheapest of approximate minimum degree, reverse Cuthill-McKee and METIS; of slender bodies with slices (METIS
/// between cuts across the body) in its place. Unknowns whose columns are alike (the freedoms of a
/// node) are ordered as one (Ashcraft, SIAM J. Sci. Comput. 16 (1995) 1404); fill and work of each order are counted
/// exactly along the elimination tree (Liu, SIAM J. Matrix Anal. 11 (1990) 134), and the order returned is a postorder
/// of it. Small matrices try minimum degree alone.
Ordering fill_reducing_ordering(const SparseMatrix& lower_pattern);

}  // namespace flexboom
