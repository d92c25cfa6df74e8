// SPDX-License-Identifier: MIT
#include "bake/surfels/block_palette.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {
namespace {

// Blocks of one value, of a few, and of as many as elements; the last is not full.
std::vector<std::uint32_t> mixedValues() {
  std::vector<std::uint32_t> values(256, 7);
  for (std::uint32_t i = 0; i < 512; ++i) values.push_back(i / 9 % 5);
  for (std::uint32_t i = 0; i < 256; ++i) values.push_back(1000 + i);
  for (std::uint32_t i = 0; i < 100; ++i) values.push_back(i % 2);
  return values;
}

TEST(BlockPalette, holdsWhatItWasGiven) {
  const std::vector<std::uint32_t> values = mixedValues();
  const BlockPalette<std::uint32_t> whole(values);
  BlockPalette<std::uint32_t> inParts;
  inParts.append(std::span(values).first(512));
  inParts.append(std::span(values).subspan(512));
  EXPECT_EQ(whole.size(), values.size());
  EXPECT_EQ(whole.toVector(), values);
  EXPECT_TRUE(whole == inParts);
  EXPECT_FALSE(whole == BlockPalette<std::uint32_t>(std::span(values).first(512)));
}

TEST(BlockPalette, aMillionEqualElementsTakeNoByteEach) {
  const std::vector<std::uint64_t> same(1u << 20, 42);
  const BlockPalette<std::uint64_t> palette(same);
  EXPECT_LT(palette.sizeBytes(), same.size() / 8);
  EXPECT_EQ(palette[same.size() - 1], 42u);
}

TEST(BlockPalette, givesBackAllValuesHoweverFewAreSearched) {
  std::vector<std::uint32_t> values;
  for (std::uint32_t i = 0; i < 1000; ++i) values.push_back(i < 300 ? 7 : i % 3 == 0 ? i : i % 40);
  const BlockPalette<std::uint32_t, 16> few{std::span<const std::uint32_t>(values)};
  const BlockPalette<std::uint32_t> all{std::span<const std::uint32_t>(values)};
  EXPECT_EQ(few.toVector(), values);
  EXPECT_EQ(all.toVector(), values);
  EXPECT_LE(all.sizeBytes(), few.sizeBytes());
}

}  // namespace
}  // namespace relume
