// SPDX-License-Identifier: MIT
// What was probably meant: words that are begun or a few edits away, and nothing for words that are far from all.
#include "tools/base/usage_message.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

TEST(ClosestWord, findsWhatWasMeant) {
  const std::vector<std::string> commands = {"bake",    "bench",  "info",   "validate",
                                             "compare", "status", "render", "reference"};
  EXPECT_EQ(closestWord("bale", commands), "bake");
  EXPECT_EQ(closestWord("bkae", commands), "bake") << "letters that changed places";
  EXPECT_EQ(closestWord("comapre", commands), "compare");
  EXPECT_EQ(closestWord("val", commands), "validate") << "begun";
  EXPECT_EQ(closestWord("stat", commands), "status");
  EXPECT_EQ(closestWord("foo", commands), "");
  EXPECT_EQ(closestWord("x", commands), "");
  EXPECT_EQ(closestWord("", commands), "");
  EXPECT_EQ(closestWord("bake", {}), "");
}

TEST(ClosestWord, dashesAreNoLetters) {
  const std::vector<std::string> options = {"--rays", "--seed", "-o", "--json"};
  EXPECT_EQ(closestWord("--ray", options), "--rays");
  EXPECT_EQ(closestWord("-rays", options), "--rays");
  EXPECT_EQ(closestWord("--x", options), "");
  EXPECT_EQ(closestWord("--", options), "");
}

}  // namespace
}  // namespace relume
