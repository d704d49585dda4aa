#pragma once

#include "apps/scene/scene.hpp"
#include "reduction/body/reduced_body.hpp"

#include <array>
#include <string>
#include <vector>

namespace flexboom {

/// Corrections of a basis that stretch and twist a boom at its free end, where `body` has no mode that does. In a
/// slender boom such modes come after many that bend. `clamped`: the node set that is held.
std::vector<std::string> static_shapes_beside(const ReducedBody& body, const std::string& clamped);

/// Coordinates of a body, from 1: the `first`, and beyond them the next that stretch and that twist it. It has two more
/// of each kind then than the body `kept`, or as many as there are. Empty where it has none more of one kind.
std::vector<int> first_and_stretching(const ReducedBody&, int first, const ReducedBody& kept);

/// How many modes beside those of a body are searched for that stretch and that twist it: so many, and on, while there
/// are none.
inline constexpr std::array modes_searched = {0, 8, 16, 32, 64};

/// Corrections of all six loads at a node set, or at each of several.
std::vector<std::string> static_shapes_at(const std::string& node_set);
std::vector<std::string> static_shapes_at(const std::vector<std::string>& node_sets);

/// Those of every node set of a boom where joints, springs and loads of the scene act, but the one that is held. The
/// slope that a torque gives a boom there converges as 1 / n with the number of its clamped modes; with its static
/// shape as 1 / n^5.
std::vector<std::string> static_shapes_of_loads(const Scene&, const BodyScene&);

/// Has a marker coordinates of its own, which hold the static shapes of its loads?
bool is_interface(const BodyScene&, const std::string& marker);

/// Has a load at a marker of a reduced body a static shape of its own? Not where the marker stands still in the frame
/// of the body, or is an interface, whose coordinates hold it.
bool can_load(const ReducedBody&, const std::string& marker);

/// Markers of a body from a file where loads of the scene act and its body with more modes has no static shapes.
std::vector<std::string> loads_without_shapes(const Scene&, const BodyScene&);

/// Names the markers of a body where loads of the scene act, or whose displacement is an output, and for which the body
/// has no geometric stiffness: a load there does not stiffen it, and the marker comes no nearer where the body bends.
/// Empty where there is none, and of a body without any geometric stiffness.
std::string loads_without_stiffness(const Scene&, const ReducedBody&);

/// Adds those that are not there; names of node sets compare without case.
void add_static_shapes(std::vector<std::string>& corrections, const std::vector<std::string>& shapes);

/// A body with these corrections, too, where it is of elements.
BodyScene with_static_shapes(const BodyScene&, const std::vector<std::string>&);

}  // namespace flexboom
