#pragma once

#include "apps/simulate/simulate.hpp"

#include <optional>

/// Scenes that are flown beside a scene, and differ from it in one thing.
namespace flexboom {

/// Steps that a flight in comparison with another may take; beyond, it costs too much.
long bearable_steps(const SimulatedMotion&);

/// Of the integrator of a flight in comparison: below is round-off.
inline constexpr double least_tolerance = 1e-13;

/// A digit more from its integrator: a number that people can read in the scene that is written.
Scene with_a_digit_more(Scene);

/// The scene with the geometric stiffness that its run had: a repeat changes one thing alone.
Scene as_flown(Scene, const Run&);

/// All geometric stiffness.
Scene with_stiffening(Scene);

/// The same model in relative coordinates, by the method that the program picks, a digit tighter than what is asked
/// for. What bodies leave out shows there as well, at a part of the cost. By multipliers, or by a method that stiff
/// modes hold up, a flight with more modes takes minutes. Nothing: the scene is flown like that, or has loops.
std::optional<Scene> by_cheapest_means(Scene);

}  // namespace flexboom
