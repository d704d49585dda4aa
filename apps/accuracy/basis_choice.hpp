#pragma once

#include "apps/simulate/simulate.hpp"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace flexboom {

/// Modes of two flights whose difference shows how fast a basis converges.
inline constexpr int few_modes = 4, more_modes = 8;

/// Bodies of beams that their motion stiffens more than their material take the modes of that motion (basis
/// "prestressed"). They do unless the outputs converge clearly slower with them, or the scene names a basis, a plane or
/// corrections. `open`: bodies of the scene that may change. `flown`: a flight with so many modes of each body. `plan`
/// gets a line.
/// @throws as `flown`.
void take_modes_of_the_motion(Scene&, const std::vector<size_t>& open,
                              const std::function<Run(const Scene&, int modes)>& flown, std::vector<std::string>& plan);

}  // namespace flexboom
