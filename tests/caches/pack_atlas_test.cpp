// SPDX-License-Identifier: MIT
#include "bake/caches/lightmap/pack_atlas.h"

#include <gtest/gtest.h>

#include <random>

namespace relume {
namespace {

TEST(PackAtlas, NothingOverlapsAndTheGutterStaysFree) {
  std::mt19937 random(3);
  std::vector<glm::uvec2> sizes;
  for (int i = 0; i < 500; ++i) sizes.emplace_back(1 + random() % 17, 2 + random() % 9);
  constexpr std::uint32_t kGutter = 2, kSingles = 777;
  const auto plan = packAtlas(sizes, kSingles, kGutter, 0);
  ASSERT_TRUE(plan);
  ASSERT_EQ(plan->single.size(), kSingles);
  EXPECT_GT(plan->used, 0.5);
  EXPECT_EQ(plan->size.x, plan->size.y);
  std::vector<int> taken(std::size_t{plan->size.x} * plan->size.y, 0);
  const auto take = [&](std::uint32_t x, std::uint32_t y) {
    if (x < plan->size.x && y < plan->size.y) ++taken[std::size_t{y} * plan->size.x + x];
  };
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const glm::uvec2 at = plan->rectangle[i];
    ASSERT_LE(at.x + sizes[i].x, plan->size.x);
    ASSERT_LE(at.y + sizes[i].y, plan->size.y);
    for (std::uint32_t y = 0; y < sizes[i].y + kGutter; ++y) {
      for (std::uint32_t x = 0; x < sizes[i].x + kGutter; ++x) take(at.x + x, at.y + y);
    }
  }
  for (const glm::uvec2& at : plan->single) take(at.x, at.y);
  for (const int count : taken) EXPECT_LE(count, 1);
}

TEST(PackAtlas, OneLongRectangleDoesNotMakeAWholeSquare) {
  const std::vector<glm::uvec2> sizes{{8000, 2}, {5000, 1}, {3, 7}};
  constexpr std::uint32_t kSingles = 20000;
  const auto plan = packAtlas(sizes, kSingles, 1, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->size.x, 8000u);
  EXPECT_LE(plan->size.y, 24u);
  ASSERT_EQ(plan->single.size(), kSingles);
  for (const glm::uvec2& at : plan->single) EXPECT_LT(at.y, plan->size.y);
  for (std::size_t i = 0; i < sizes.size(); ++i) EXPECT_LE(plan->rectangle[i].y + sizes[i].y, plan->size.y);
}

TEST(PackAtlas, SaysWhenItDoesNotFit) {
  const std::vector<glm::uvec2> sizes(10, glm::uvec2(10, 10));
  EXPECT_FALSE(packAtlas(sizes, 0, 1, 24));
  EXPECT_FALSE(packAtlas(std::vector<glm::uvec2>{{40, 2}}, 0, 1, 32));
  EXPECT_FALSE(packAtlas({}, 65, 1, 8));
  EXPECT_TRUE(packAtlas({}, 64, 1, 8));
  EXPECT_TRUE(packAtlas(std::vector<glm::uvec2>{{32, 32}}, 0, 1, 32)) << "the last gutter may hang over the border";
  EXPECT_FALSE(packAtlas(std::vector<glm::uvec2>{{kMaxAtlasSide, kMaxAtlasSide}, {9, 9}}, 0, 0, 0));
}

}  // namespace
}  // namespace relume
