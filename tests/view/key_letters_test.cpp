// SPDX-License-Identifier: MIT
// Keys of commands by the letters that keyboards of several countries have on them.
#include "tools/view/key_letters.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

TEST(KeyLetters, areThoseOnTheKeys) {
  EXPECT_EQ(lettered('Z', "z"), 'Z') << "American";
  EXPECT_EQ(lettered('Y', "z"), 'Z') << "German";
  EXPECT_EQ(lettered('Z', "y"), 'Y');
  EXPECT_EQ(lettered('W', "z"), 'Z') << "French";
  EXPECT_EQ(lettered('Z', "Y"), 'Y') << "a name in capitals";
  EXPECT_EQ(lettered('Z', ";"), ';') << "Dvorak's: its Z is elsewhere";
}

TEST(KeyLetters, areThePlacesWhereKeysHaveNoLetterOrAnotherAlphabets) {
  constexpr int kEscape = 256;
  EXPECT_EQ(lettered(kEscape, nullptr), kEscape);
  EXPECT_EQ(lettered('Z', ""), 'Z');
  EXPECT_EQ(lettered('Z', "\xD1\x8F"), 'Z') << "Cyrillic";
}

}  // namespace
}  // namespace relume
