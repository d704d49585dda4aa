#include "fem/linear_algebra/inertia_methods.hpp"

#include <array>

namespace flexboom {

std::span<const InertiaMethod> inertia_methods() {
  static constexpr std::array<InertiaMethod, 1> rows = {{{"cholmod", 5e8, cholmod_inertia, cholmod_release}}};
  return rows;
}

}  // namespace flexboom
