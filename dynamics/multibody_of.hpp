#pragma once

#include "dynamics/multibody.hpp"
#include "dynamics/system.hpp"

namespace flexboom {

/// The hub with hinged booms of a System as a scene: body 0 is the hub on joint 0, "flight" (absent when it is fixed),
/// then the booms with their hinges. A Tree of it has the Layout of the System.
Multibody multibody_of(const System&);

}  // namespace flexboom
