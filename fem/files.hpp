#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string_view>

namespace flexboom {

/// Writes a file whole or not at all: to a temporary name first, renamed when every byte is on its way to the disk. A
/// device or pipe is written as it is.
/// @throws InputError naming the file and the reason (no space, no permission, ...).
void write_file(const std::filesystem::path&, std::string_view text);
void write_file(const std::filesystem::path&, const std::function<void(std::ostream&)>& write);

}  // namespace flexboom
