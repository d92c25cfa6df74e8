// SPDX-License-Identifier: MIT
// JSON that nobody vouches for: nesting of any depth and any damage gives a value or an error.
#include "bake/base/read_json.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>

namespace relume {
namespace {

std::string nested(std::size_t depth, const std::string& open, const std::string& inside, const std::string& close) {
  std::string text;
  for (std::size_t i = 0; i < depth; ++i) text += open;
  text += inside;
  for (std::size_t i = 0; i < depth; ++i) text += close;
  return text;
}

TEST(ReadJson, takesNestingUpToItsBoundAndNoneBeyond) {
  EXPECT_TRUE(readJson(nested(kMaxJsonDepth, "[", "1", "]")));
  EXPECT_TRUE(readJson(nested(kMaxJsonDepth, "{\"a\":", "1", "}")));
  for (const std::size_t depth : {kMaxJsonDepth + 1, std::size_t{100'000}, std::size_t{200'000}}) {
    for (const std::string& text :
         {nested(depth, "[", "1", "]"), nested(depth, "{\"a\":", "1", "}"), nested(depth, "[{\"a\":", "1", "}]"),
          nested(depth, "[", "", ""), nested(depth, "{\"a\":", "", ""), "[1," + nested(depth, "[", "]", "")}) {
      const Result<nlohmann::json> json = readJson(text);
      ASSERT_FALSE(json) << depth;
      EXPECT_EQ(json.error().code, ErrorCode::invalidFile);
      EXPECT_EQ(json.error().message, "JSON nested more than 128 deep");
    }
  }
}

TEST(ReadJson, countsNoBracketsOfStringsAndComments) {
  const std::string many(1000, '[');
  EXPECT_TRUE(readJson("{\"a\": \"" + many + "\"}"));
  EXPECT_TRUE(readJson("{ /* " + many + " */ \"a\": 1} // " + many, JsonComments::skip));
  EXPECT_FALSE(readJson("{} // no", JsonComments::refuse));
}

TEST(ReadJson, namesThatStandTwiceAreRefusedWherePeopleWrite) {
  for (const char* twice : {"{\"a\": 1, /* and */ \"a\": 1}", "[{\"b\": {\"c\": 1, \"a\": {}, \"a\": 2}}]"}) {
    const Result<nlohmann::json> json = readJson(twice, JsonComments::skip);
    ASSERT_FALSE(json) << twice;
    EXPECT_EQ(json.error().message, "\"a\" stands twice in one object; keep one of them");
  }
  EXPECT_TRUE(readJson("{\"a\": {\"a\": [{\"a\": 1}, {\"a\": 2}]}, \"b\": {\"a\": 3}}", JsonComments::skip));
  EXPECT_TRUE(readJson("{\"a\": 1, \"a\": 2}"));
  EXPECT_FALSE(readJson("{\"a\": 1, ", JsonComments::skip));
}

TEST(ReadJson, saysWhereAndBriefly) {
  const Result<nlohmann::json> json = readJson("{\n  \"a\": " + std::string(100'000, 'x') + "}");
  ASSERT_FALSE(json);
  EXPECT_NE(json.error().message.find("line 2"), std::string::npos) << json.error().message;
  EXPECT_LT(json.error().message.size(), 400u);
  EXPECT_FALSE(readJson(""));
  EXPECT_FALSE(readJson("1e999"));
  EXPECT_FALSE(readJson("\"\xff\""));
}

}  // namespace
}  // namespace relume
