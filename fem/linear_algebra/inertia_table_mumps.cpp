#include "fem/linear_algebra/inertia_methods.hpp"

#include <array>

namespace flexboom {

// The table where MUMPS is there.
std::span<const InertiaMethod> inertia_methods() {
  static constexpr std::array<InertiaMethod, 2> rows = {{
      {"cholmod", 5e8, cholmod_inertia, cholmod_release},
      {"mumps", 3e9, mumps_inertia, mumps_release},
  }};
  return rows;
}

}  // namespace flexboom
