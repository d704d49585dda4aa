#include "fem/base64.hpp"

#include <array>
#include <cstdint>
#include <utility>

namespace flexboom {
namespace {

constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t none = 255;

constexpr std::array<std::uint8_t, 256> make_digits() {
  std::array<std::uint8_t, 256> digits{};
  digits.fill(none);
  for (std::uint8_t i = 0; i < 64; ++i) digits[static_cast<unsigned char>(alphabet[i])] = i;
  return digits;
}

constexpr std::array<std::uint8_t, 256> digits = make_digits();

std::uint32_t byte_at(std::string_view bytes, size_t i) {
  return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0U;
}

bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

}  // namespace

std::string base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const std::uint32_t group = byte_at(bytes, i) << 16 | byte_at(bytes, i + 1) << 8 | byte_at(bytes, i + 2);
    for (int shift = 18; shift >= 0; shift -= 6) text += alphabet[group >> shift & 63];
  }
  const size_t padding = (3 - bytes.size() % 3) % 3;
  text.replace(text.size() - padding, padding, padding, '=');
  return text;
}

// Decodes four characters; padding ends a piece.
bool ByteStream::take_group() {
  std::uint32_t group = 0;
  int characters = 0, padding = 0;
  size_t i = 0;
  for (; i < data_.size() && characters < 4; ++i) {
    const char c = data_[i];
    if (is_blank(c)) continue;
    const std::uint8_t digit = c == '=' ? 0 : digits[static_cast<unsigned char>(c)];
    if (digit == none || (padding > 0 && c != '=')) return false;
    padding += c == '=';
    group = group << 6 | digit;
    ++characters;
  }
  data_.remove_prefix(i);
  if (characters < 4 || padding > 2) return false;
  for (int k = 0; k < 3 - padding; ++k) decoded_ += static_cast<char>(group >> (16 - 8 * k) & 255);
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
    if (!take_group()) return {};
  }
  std::string rest = decoded_.substr(count);
  decoded_.resize(count);
  return std::exchange(decoded_, std::move(rest));
}

}  // namespace flexboom
