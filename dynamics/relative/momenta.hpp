#pragma once

// Momenta and energies of bodies of a tree, from what the sweeps left. Internal to `dynamics`.

#include "dynamics/relative/inertia.hpp"
#include "dynamics/relative/workspace.hpp"

#include <span>

namespace flexboom::tree {

/// A point that moves without turning: what is large and shared by all bodies is left out of their sums.
struct Reference {
  Vec3<double> position, velocity;  // inertial axes [m], [m/s]
};

/// Sums over bodies, inertial axes: about the reference point as though that were at rest.
struct MassMotion {
  double m = 0;
  Vec3<double> first_moment, momentum;

  Vec3<double> mass_centre() const { return (1 / m) * first_moment; }
};

struct Totals : MassMotion {
  Vec3<double> angular_momentum;
  Sym3<double> inertia;
  double kinetic = 0, strain = 0;  // of the bodies; strain: of the shapes
  double spinning = 0;             // kinetic, of wheels
  // Sums over the bodies of |momentum| in inertial space, and of |angular momentum| about each one's own origin.
  double momentum_scale = 0, angular_momentum_scale = 0;

  Vec3<double> angular_momentum_about_mass_centre() const { return angular_momentum - cross(mass_centre(), momentum); }
};

/// The bodies whose entry of `root_of`, one per link, is `root`; all where it is empty.
struct HungOn {
  std::span<const int> root_of{};
  int root = 0;

  bool counts(size_t link) const { return root_of.empty() || root_of[link] == root; }
};

/// Both move all links, poses included. `reference`: by its position and velocity in y, or what else is near the
/// bodies. The inertia is zero where it is not asked for.
Totals totals(const Model&, const double* y, const Instant&, const Reference&, Scratch<double>&, HungOn = {},
              bool with_inertia = true);
MassMotion mass_motion(const Model&, const double* y, const Instant&, const Reference&, Scratch<double>&, HungOn = {});

}  // namespace flexboom::tree
