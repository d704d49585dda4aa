// What formulation = "multipliers" cannot do, refused under the key that asks for it.

#include "apps/scene/scene.hpp"
#include "apps/scene/scene_keys.hpp"

#include <fmt/format.h>

namespace flexboom {

void check_multipliers(const Scene& scene, toml_reader::Faults& faults) {
  constexpr const char* relative = "; formulation = \"relative\" can";
  if (scene.rescale_at_events)
    faults.add("integrator.rescale_at_events", fmt::format("is true, which \"multipliers\" cannot follow{}", relative));
}

}  // namespace flexboom
