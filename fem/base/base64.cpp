#include "fem/base/base64.hpp"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <utility>

namespace flexboom {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

const unsigned char* bytes_of(const char* text) { return reinterpret_cast<const unsigned char*>(text); }
unsigned char* bytes_of(char* text) { return reinterpret_cast<unsigned char*>(text); }

}  // namespace

std::string base64(std::string_view bytes) {
  // EVP_EncodeBlock counts in int, and ends its text with a zero.
  constexpr size_t piece = size_t{3} << 24;
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  size_t written = 0;
  for (; !bytes.empty(); bytes.remove_prefix(std::min(piece, bytes.size())))
    written += static_cast<size_t>(EVP_EncodeBlock(bytes_of(text.data() + written), bytes_of(bytes.data()),
                                                   static_cast<int>(std::min(piece, bytes.size()))));
  text.resize(written);
  return text;
}

// Decodes up to as many groups of four characters as `wanted` bytes need; padding ends a piece.
bool ByteStream::take_groups(size_t wanted) {
  constexpr size_t most = 4096;  // characters
  std::array<char, most> text{};
  const size_t enough = std::min(most, (wanted + 2) / 3 * 4);
  size_t count = 0, padding = 0, i = 0;
  for (; i < data_.size() && count < enough && (padding == 0 || count % 4 != 0); ++i) {
    const char c = data_[i];
    if (is_blank(c)) continue;
    if (padding > 0 && c != '=') return false;
    padding += c == '=';
    text[count++] = c;
  }
  if (count == 0 || count % 4 != 0 || padding > 2) return false;
  data_.remove_prefix(i);
  std::array<char, most / 4 * 3> bytes{};
  const int decoded = EVP_DecodeBlock(bytes_of(bytes.data()), bytes_of(text.data()), static_cast<int>(count));
  if (decoded < 0 || static_cast<size_t>(decoded) != count / 4 * 3) return false;  // it passes over "-" at the end
  decoded_.append(bytes.data(), static_cast<size_t>(decoded) - padding);
  return true;
}

std::optional<std::string> ByteStream::take(size_t count) {
  const size_t available = is_base64_ ? decoded_.size() + data_.size() / 4 * 3 : data_.size();
  if (count > available) return {};
  if (!is_base64_) {
    std::string result(data_.substr(0, count));
    data_.remove_prefix(count);
    return result;
  }
  decoded_.reserve(count + 3);
  while (decoded_.size() < count) {
    if (!take_groups(count - decoded_.size())) return {};
  }
  std::string rest = decoded_.substr(count);
  decoded_.resize(count);
  return std::exchange(decoded_, std::move(rest));
}

}  // namespace flexboom
