#pragma once

#include "dynamics/hub_equations.hpp"

namespace flexboom {

/// Hands the bodies of a model over: two to four with equally many modes side by side, the rest one by one. `at`: first
/// entry of each in p.
void place_side_by_side(std::vector<equations::Body> bodies, const std::vector<int>& at, equations::Model&);

}  // namespace flexboom
