#pragma once

#include <cstddef>

namespace flexboom {

/// An index of Eigen or METIS as the index of a container.
inline std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace flexboom
