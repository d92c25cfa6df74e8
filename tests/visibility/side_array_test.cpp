// SPDX-License-Identifier: MIT
#include "bake/visibility/side_array.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace relume {
namespace {

// Values of a level of which stretches, backs and single sides have none.
std::vector<float> sparseValues(std::size_t sides) {
  std::mt19937 random(5);
  std::vector<float> values(sides, 0.0f);
  for (std::size_t side = 0; side < sides; ++side) {
    const bool hasSome = side / 700 % 3 != 1 && (side % 2 == 0 || side > sides / 2);
    if (hasSome && random() % 4 != 0) values[side] = static_cast<float>(side + 1);
  }
  return values;
}

TEST(SideArray, holdsWhatItWasGivenInPartsOfAnyLength) {
  const std::vector<float> values = sparseValues(10000);
  SideArray<float> whole, inParts;
  whole = values;
  for (std::size_t first = 0, count = 2; first < values.size(); first += count, count += 62) {
    count = std::min(count, values.size() - first);
    inParts.append(std::span(values).subspan(first, count));
  }
  EXPECT_EQ(whole.size(), values.size());
  EXPECT_EQ(whole.toVector(), values);
  EXPECT_EQ(inParts.toVector(), values);
  EXPECT_TRUE(whole == inParts);
}

TEST(SideArray, aValueIsSetOnItsSideAlone) {
  SideArray<std::uint8_t> flags(1000);
  std::vector<std::uint8_t> expected(1000, 0);
  for (const std::size_t side : {0u, 1u, 127u, 128u, 500u, 999u}) {
    flags.set(side, 3);
    expected[side] = 3;
  }
  EXPECT_EQ(flags.toVector(), expected);
  flags.set(500, 0);
  expected[500] = 0;
  EXPECT_EQ(flags.toVector(), expected);
  EXPECT_FALSE(flags == SideArray<std::uint8_t>(1000));
  EXPECT_FALSE(flags == SideArray<std::uint8_t>(998));
}

}  // namespace
}  // namespace relume
