#include "fem/base/base64.hpp"

#include "fem_testing.hpp"

namespace flexboom::testing {
namespace {

TEST(Base64, GivesTheVectorsOfTheStandard) {  // RFC 4648, 10
  const std::vector<std::pair<std::string, std::string>> vectors = {{"", ""},
                                                                    {"f", "Zg=="},
                                                                    {"fo", "Zm8="},
                                                                    {"foo", "Zm9v"},
                                                                    {"foob", "Zm9vYg=="},
                                                                    {"fooba", "Zm9vYmE="},
                                                                    {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) {
    EXPECT_EQ(base64(bytes), text);
    EXPECT_EQ(ByteStream(text, true).take(bytes.size()), bytes);
  }
}

TEST(Base64, PiecesBlanksAndLongTextsComeBack) {
  std::string bytes;
  for (int i = 0; i < 100'000; ++i) bytes += static_cast<char>((i % 251) * (i % 251) % 251);
  std::string text;
  for (size_t first = 0; first < bytes.size(); first += 1237) text += base64(bytes.substr(first, 1237)) + "\n  ";
  ByteStream stream(text, true);
  std::string back;
  for (const size_t count : {size_t{1}, size_t{7000}, size_t{2}, bytes.size() - 7003})
    back += stream.take(count).value_or("nothing");
  EXPECT_EQ(back, bytes);
  EXPECT_FALSE(stream.take(1));
}

TEST(Base64, WhatIsNoneIsRefused) {
  for (const std::string text : {"Zm9", "Zm9*", "====", "Z===", "Zg=v", "Zm9vYm--", "Zm9v----", "Zm\x019v",
                                 "Zm9v\xff"
                                 "mFy"})
    EXPECT_FALSE(ByteStream(text, true).take(std::max<size_t>(1, text.size() / 4 * 3))) << text;
}

}  // namespace
}  // namespace flexboom::testing
