#pragma once

#include <cstddef>
#include <string>
#include <string_view>

// The head of a body file: what is in front of the part that HDF5 reads (its "user block").
namespace flexboom {

constexpr int version_without_richer_bodies = 1;
constexpr int body_file_version = 2;  // the newest that is read and written
constexpr size_t seal_size = 512;

/// Puts "flexboom-body VERSION sha256 DIGEST" in the first `seal_size` bytes, which must be there; zeros fill them up.
/// The digest is that of all bytes behind.
void seal(std::string& bytes, int version);

/// The version of the format. @throws InputError unless every byte is as `seal` left it: HDF5 may crash on damaged
/// files, so it never sees one.
int check_seal(std::string_view bytes);

}  // namespace flexboom
