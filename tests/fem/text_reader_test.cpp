#include "fem/base/text_reader.hpp"
#include "fem/base/files.hpp"

#include "fem/base/label_index.hpp"
#include "fem_testing.hpp"

#include <fmt/format.h>

namespace flexboom::testing {
namespace {

TEST(TextReader, ReadsLinesWithAnyEnd) {
  TextReader reader("one\r\ntwo\n\nlast", "f");
  EXPECT_EQ(reader.next_line(), "one");
  EXPECT_EQ(reader.next_line(), "two");
  EXPECT_EQ(reader.next_line(), "");
  EXPECT_EQ(reader.next_line(), "last");
  EXPECT_FALSE(reader.next_line());
  EXPECT_TRUE(reader.at_end());
}

TEST(TextReader, ReadsTokensAcrossLines) {
  TextReader reader(" 1\t-2.5e3\r\n\n+7 end ", "f");
  EXPECT_EQ(reader.integer("n"), 1);
  EXPECT_EQ(reader.real("x"), -2500);
  EXPECT_EQ(reader.integer("n", 0, 7), 7);
  EXPECT_EQ(reader.next_token(), "end");
  EXPECT_EQ(reader.next_token(), "");
  EXPECT_EQ(reader.bytes_left(), 0U);
}

TEST(TextReader, LocatesEveryView) {
  const std::string_view text = "ab\ncd ef\n";
  const TextReader reader(text, "file");
  EXPECT_EQ(reader.location(text), "file:1:1");
  EXPECT_EQ(reader.location(text.substr(3)), "file:2:1");
  EXPECT_EQ(reader.location(text.substr(6, 2)), "file:2:4");
  EXPECT_EQ(reader.location(text.substr(text.size())), "file:3:1");
  EXPECT_EQ(reader.location("elsewhere"), "file:3:1");
  EXPECT_EQ(reader.location({}), "file:3:1");
  EXPECT_EQ(TextReader("", "file").location({}), "file:1:1");
}

TEST(TextReader, FaultsSayWhereAndWhat) {
  const auto fault = [](std::string_view text, const auto& read) {
    TextReader reader(text, "f");
    return input_error([&] { read(reader); });
  };
  const auto integer = [](TextReader& reader) { reader.integer("a count", 0, 9); };
  const auto real = [](TextReader& reader) { reader.real("x"); };
  EXPECT_EQ(fault("\n 1.5", integer), "f:2:2: a count is not a whole number: \"1.5\"");
  EXPECT_EQ(fault("12", integer), "f:1:1: a count is 12; it must be 0 to 9");
  EXPECT_EQ(fault(" \n", integer), "f:2:1: the file ends where a count should be");
  EXPECT_EQ(fault("99999999999999999999", integer), "f:1:1: a count is not a whole number: \"99999999999999999999\"");
  EXPECT_EQ(fault("1e400", real), "f:1:1: x is not a finite number: \"1e400\"");
  EXPECT_EQ(fault("\x01\xff", real), "f:1:1: x is not a finite number: \"??\"");
  EXPECT_EQ(fault(std::string(60, 'x'), real), fmt::format("f:1:1: x is not a finite number: \"{:x>40}...\"", ""));
}

TEST(TextReader, NumbersAreWholeTokens) {
  EXPECT_EQ(to_real("-1.5e-3"), -1.5e-3);
  EXPECT_EQ(to_real("+.5"), 0.5);
  EXPECT_EQ(to_real("1.5D+2", true), 150);
  EXPECT_EQ(to_real("1.5d2", true), 150);
  for (const char* wrong : {"", "+", "1.5D2", "1x", "nan", "inf", "-inf", "0x10", "+-1", "++1", " 1", "1 ", "1e999"})
    EXPECT_FALSE(to_real(wrong)) << wrong;
  EXPECT_FALSE(to_real(fmt::format("{:1>200}d0", ""), true));
  EXPECT_EQ(to_integer("-12"), -12);
  for (const char* wrong : {"", "1.", "1e3", "0x1", "9223372036854775808", "+-1"})
    EXPECT_FALSE(to_integer(wrong)) << wrong;
  EXPECT_EQ(trimmed(" \t a b\r\n"), "a b");
  EXPECT_EQ(trimmed(" \n"), "");
}

TEST(TextReader, UnreadableFileIsAnInputError) {
  EXPECT_EQ(input_error([] { file_bytes("/nowhere/x"); }), "cannot read /nowhere/x: No such file or directory");
  EXPECT_EQ(input_error([] { file_bytes("/tmp"); }), "cannot read /tmp: Is a directory");
}

TEST(LabelIndex, FindsDenseAndSparseLabels) {
  const long far = 1L << 40;
  for (const std::vector<long>& labels :
       {std::vector<long>{5, 3, 4}, {-far, far, 7}, {far}, {9223372036854775807, -far}}) {
    const LabelIndex index(labels);
    for (size_t i = 0; i < labels.size(); ++i) EXPECT_EQ(index.find(labels[i]), static_cast<int>(i));
    for (const long other : {0L, 6L, far - 1, -far + 1}) EXPECT_EQ(index.find(other), -1);
    EXPECT_FALSE(index.duplicate());
  }
  EXPECT_EQ(LabelIndex({}).find(0), -1);
  EXPECT_EQ(LabelIndex({4, 5, 4}).duplicate(), 4);
  EXPECT_EQ(LabelIndex({far, 0, far}).duplicate(), far);
}

}  // namespace
}  // namespace flexboom::testing
