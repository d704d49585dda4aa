#pragma once

#include "apps/accuracy/output_errors.hpp"
#include "apps/scene/scene.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Finite elements of one order against the closed forms of eq. 14, largest relative error over the modes.
struct OrderComparison {
  int order = 0;
  int dofs = 0;
  double seconds = 0;    // mesh, assembly, eigen-solve and invariants
  double frequency = 0;  // |f - f_ref| / f_ref
  double subspace = 0;   // 1 - cos(largest principal angle), M inner product
  double Ct = 0;         // against m 2 sigma / alpha
  double Cr = 0;         // against m L 2 / alpha^2
  double largest() const { return std::max({frequency, subspace, Ct, Cr}); }
};

/// Why a real beam differs from eq. 14, mode by mode: frequencies with each effect switched on in turn [Hz].
struct TheoryComparison {
  double eq14 = 0;    // Euler-Bernoulli, line mass
  double rotary = 0;  // with rotary inertia (Rayleigh)
  double shear = 0;   // with rotary inertia and shear (Timoshenko)
};

struct BodyComparison {
  std::string name;
  std::vector<OrderComparison> orders;  // 1 to 8
  std::vector<TheoryComparison> modes;
};

/// The uniform boom of a body by Euler-Bernoulli elements without rotary inertia, orders 1 to 8, against eq. 14; and
/// the effect of rotary inertia and shear. @throws InputError when the body is not one uniform segment.
BodyComparison compare_with_eq14(const BodyScene&, int count, int elements);

/// Why eq. 14 says nothing of a body; empty: it does.
std::string not_comparable(const BodyScene&);

/// One transient of a scene with each model of the bodies that are comparable, in turn, against eq. 14. Geometric
/// stiffness, which eq. 14 does not have, is left out.
struct TransientComparison {
  std::string model;
  std::vector<OutputDifference> differences;
};
std::vector<TransientComparison> compare_transients(const Scene&);

}  // namespace flexboom
