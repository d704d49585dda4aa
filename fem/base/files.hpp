#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>

namespace flexboom {

constexpr size_t largest_file = size_t{4} << 30;  // [bytes]

/// The bytes of a regular file: a folder, a device or a pipe need not end.
/// @throws InputError naming the file and the reason (missing, no file, no permission, more than `most` bytes, ...).
std::string file_bytes(const std::filesystem::path&, size_t most = largest_file);

/// What file_bytes checks before it reads, for files that others read.
void require_regular_file(const std::filesystem::path&, size_t most = largest_file);

/// Writes a file whole or not at all: to a temporary name first, renamed when every byte is on its way to the disk. A
/// device or pipe is written as it is.
/// @throws InputError naming the file and the reason (no space, no permission, ...).
void write_file(const std::filesystem::path&, std::string_view text);
void write_file(const std::filesystem::path&, const std::function<void(std::ostream&)>& write);

}  // namespace flexboom
