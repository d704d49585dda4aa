#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace flexboom {

/// Base64 of RFC 4648, padded; by OpenSSL.
std::string base64(std::string_view bytes);

/// Takes bytes one after the other out of base64 text that may consist of several padded pieces, or out of raw bytes.
class ByteStream {
 public:
  ByteStream(std::string_view data, bool is_base64) : data_(data), is_base64_(is_base64) {}

  /// Next `count` bytes, nothing when there are fewer or a character is not of base64. Memory is not taken before it is
  /// known that they can be there.
  std::optional<std::string> take(size_t count);

 private:
  bool take_groups(size_t wanted);

  std::string_view data_;
  bool is_base64_;
  std::string decoded_;  // not yet taken
};

}  // namespace flexboom
