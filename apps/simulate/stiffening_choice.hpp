#pragma once

// Which bodies have geometric stiffness in the equations: as the scene says, or as its flights show.

#include "apps/scene/scene.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace flexboom {

/// Geometric stiffness of each body: as the scene says, "auto" by what its start and prescribed motions make of it, and
/// on where springs or joints that close loops hold it at both ends. `whole`: with these joints; `plain`: the tree
/// without any geometric stiffness; `times`: when loads are largest [s].
std::vector<Stiffening> first_stiffening(const Scene&, const Multibody& whole, const Tree& plain,
                                         std::span<const double> times);

/// How far the hinge or slider moves that moves least, as a length [m]; infinite where there is none. `range`: lowest
/// and highest coordinate of a joint.
double least_motion(const Multibody&, const std::function<std::pair<double, double>(size_t joint)>& range);

/// Turns on what a flight showed to count: `effect` per body. A body that gets shorter as it bends may be all that
/// moves a joint: `least_motion`, once it is known. Was there any?
bool revise_stiffening(const Scene&, const Multibody&, const std::vector<LargestStiffening>& effect,
                       std::vector<Stiffening>&, double least_motion = std::numeric_limits<double>::infinity());

/// Would that turn on any? Then the flight that showed it is not worth keeping.
bool will_be_revised(const Scene&, const Multibody&, const std::vector<LargestStiffening>& effect,
                     std::vector<Stiffening>);

/// A flight without geometric stiffness does not tell what that would change of bodies that are held at both ends.
/// Their effect is NaN then, and a warning names each. `whole`, as above.
void note_unseen_stiffening(const Multibody& whole, const std::vector<Stiffening>&,
                            std::vector<LargestStiffening>& effect, std::vector<std::string>& warnings);

/// How a flight ended, and how far the joint that moved least moved in it.
struct Flown {
  bool interrupted = false;
  double least_motion = 0;  // [m]
};

/// Flies until no flight shows more that counts; one that fails without it is flown again with it. `fly` sets `effect`.
/// @throws NumericalError as `fly`.
void fly_until_settled(const Scene&, const Multibody&, std::vector<LargestStiffening>& effect, std::vector<Stiffening>&,
                       const std::function<Flown()>& fly);

}  // namespace flexboom
