#pragma once

#include <cstddef>
#include <string>
#include <string_view>

// The head of a body file: what is in front of the part that HDF5 reads (its "user block").
namespace flexboom {

constexpr int body_file_version = 1;
constexpr size_t seal_size = 512;

/// Puts "flexboom-body 1 sha256 DIGEST" in the first `seal_size` bytes, which must be there; zeros fill them up. The
/// digest is that of all bytes behind.
void seal(std::string& bytes);

/// @throws InputError unless every byte is as `seal` left it: HDF5 may crash on damaged files, so it never sees one.
void check_seal(std::string_view bytes);

}  // namespace flexboom
