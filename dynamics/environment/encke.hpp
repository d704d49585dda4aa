#pragma once

#include "dynamics/environment/orbit.hpp"

#include <vector>

namespace flexboom {

/// Difference from a two-body orbit over one step of an integrator: position and velocity as a polynomial of the time
/// since `end`.
struct EnckeStep {
  double end = 0;  // [s]
  int arc = 0;
  Eigen::Matrix<double, 6, Eigen::Dynamic> c;  // of the powers 0, 1, ... [m, m/s]
};

/// A two-body orbit that is followed from `begin` on, until the next arc.
struct EnckeArc {
  double begin = 0;
  OrbitState start;
};

struct EnckePath {
  std::vector<EnckeArc> arcs;
  std::vector<EnckeStep> steps;
};

/// The orbit that starts like this, by Encke's method with CVODE (Adams); a new arc wherever the difference has grown
/// to a hundredth of the radius. `tolerance`: error per step relative to the radius.
/// @throws NumericalError when CVODE fails.
EnckePath encke_path(const Planet&, const OrbitState& start, double duration, double tolerance);

}  // namespace flexboom
