#pragma once

#include <string>

namespace flexboom {

inline constexpr const char* version = "0.1.0";

/// Program version, and the versions and licences of the linked libraries, one per line.
std::string version_text();

}  // namespace flexboom
