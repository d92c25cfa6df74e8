// SPDX-License-Identifier: MIT
// Text on its way to a terminal: nothing in it is a command, and what is no command stays.
#include "tools/base/printable.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace relume {
namespace {

TEST(Printable, textStaysAsItIs) {
  for (const char* text :
       {"", "plain", "C:\\level.glb", "Tür \"1\"", "床", "emoji 👩‍👧", "W/m²", "\u00a0\u061b\u202f"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, controlCharactersAreNamed) {
  EXPECT_EQ(printable("a\x1b[2Jb"), "a\\x1b[2Jb");
  EXPECT_EQ(printable("a\nb\rc\td"), "a\\nb\\rc\\td");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\x7f\u0080\u009b\u009f"), "\\x7f\\u0080\\u009b\\u009f");
  EXPECT_EQ(printable("\u061c\u200e\u200f\u2028\u2029"), "\\u061c\\u200e\\u200f\\u2028\\u2029");
  EXPECT_EQ(printable("\u202a\u202e\u2066\u2069"), "\\u202a\\u202e\\u2066\\u2069");
}

// Every byte of what is not UTF-8 by itself, so that no decoder further on puts a control character together.
TEST(Printable, bytesThatAreNoUtf8AreNamed) {
  EXPECT_EQ(printable("a\x9b"
                      "2J"),
            "a\\x9b2J");
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b") << "overlong";
  EXPECT_EQ(printable("\xe0\x80\x9b"), "\\xe0\\x80\\x9b") << "overlong";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "a surrogate";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond Unicode";
  EXPECT_EQ(printable("\xe5\xba"), "\\xe5\\xba") << "cut short";
  EXPECT_EQ(printable("\xff\xfe"), "\\xff\\xfe");
}

TEST(Printable, everyByteComesOutAsPrintableText) {
  for (int a = 0; a < 256; ++a) {
    for (int b = 0; b < 256; ++b) {
      const std::string out = printable(std::string{static_cast<char>(a), static_cast<char>(b)});
      for (const char c : out) {
        const auto byte = static_cast<unsigned char>(c);
        EXPECT_TRUE(byte >= 0x20 && byte != 0x7F) << a << " " << b;
      }
      EXPECT_EQ(printable(out), out) << a << " " << b;
    }
  }
}

TEST(Printable, furtherLinesAreIndented) {
  EXPECT_EQ(printableLines("one\nrelume: error: two\n\tthree\x1b\n"), "one\n  relume: error: two\n  \tthree\\x1b");
}

TEST(Printable, jsonKeepsItsValueInAscii) {
  const nlohmann::json value = {{"a\x1b", {"\u202e\x7f", 1.5, nullptr}}};
  const std::string text = jsonText(value, -1);
  EXPECT_EQ(nlohmann::json::parse(text), value);
  for (const char c : text) EXPECT_TRUE(c >= 0x20 && c < 0x7F) << text;
  EXPECT_EQ(printableStrings(value).dump(), R"({"a\\x1b":["\\u202e\\x7f",1.5,null]})");
}

}  // namespace
}  // namespace relume
