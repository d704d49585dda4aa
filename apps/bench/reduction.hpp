#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace flexboom {

/// One body of boom 4, clamped: what reducing it costs beside its modes, and what the modes left out would have added.
struct ReductionBench {
  std::string family;  // "hex" (graded), "hex20" (uniform), "beam p3", "beam p8"
  std::string model;   // what distinguishes it in its family
  int unknowns = 0;
  int modes = 0;
  int threads = 1;
  // Wall times, the least of up to five runs within half a second:
  double modes_seconds = 0;       // the whole eigen-solve
  double reduce_seconds = 0;      // invariants, Ke, markers, surface
  double stiffening_seconds = 0;  // geometric stiffness of 18 loads, the factor of K given
  double memory_mb = 0;           // largest resident memory while the row was made
  // Of the full model of the same mesh:
  double compliance_error = 0;  // tip deflection under a static lateral force, what the modes lack of it
  double mass_missing = 0;      // lateral effective mass, what the modes lack of m
  double hinge_error = 0;       // first bending frequency on a free hinge at the root: rigid rotation and clamped modes
};

/// Names of the invariants compared, in the order of the errors.
constexpr std::array<const char*, 8> invariant_names = {"m", "mc0", "J0", "Ct", "Cr0", "Cr1", "J1", "J2"};
using InvariantErrors = std::array<double, invariant_names.size()>;

/// Largest errors of the invariants of the first ten modes, against a finer mesh. An error is relative to the largest
/// entry. Modes of unit modal mass are compared one by one, pairs as subspaces. An error is NaN where the mesh orders
/// the modes otherwise.
struct InvariantsBench {
  std::string family, model;
  int unknowns = 0;
  InvariantErrors consistent;  // `reduce`
  InvariantErrors lumped;      // sums over nodal masses, the same mesh and shapes
};

struct ReductionBenches {
  std::vector<ReductionBench> rows;
  std::vector<InvariantsBench> invariants;
};

/// Measures every family on a ladder of meshes, smallest first, with 2, 5, 10, 20 and 50 modes, on one thread and on
/// `threads`. A ladder ends where rows of its next mesh would take longer than `longest` seconds. The reference of the
/// invariants is made first, whatever it takes. Calls `seen` after each row.
ReductionBenches bench_reduction(double longest, int threads, const std::function<void(const ReductionBench&)>& seen);

}  // namespace flexboom
