// SPDX-License-Identifier: MIT
// Which caches have their turn, and how far lamps reach.
#include "runtime/shared/look_turns.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>

#include <memory_resource>
#include <vector>

namespace relume {
namespace {

const glm::vec3 kPlace(6.0f, 2.0f, 3.0f);  // of the synthetic room, 12 x 4 x 6 m

// A frame looks at about a 32nd of all caches, where those that it can pass over allow; each near cache has its turn
// within the lag, and none that the bound of its block excludes.
TEST(LookTurns, keepToTheirBudget) {
  const Bake bake = test::makeSyntheticBake({.surfels = 512, .grid = {24, 10, 16}, .linksPerCache = 4});
  const Caches& caches = bake.caches;
  constexpr std::uint32_t kLag = 32;
  for (const float radius : {0.1f, 0.25f, 0.5f}) {
    SCOPED_TRACE(radius);
    LookTurns turns(caches, kLag, std::pmr::new_delete_resource());
    std::vector<std::uint32_t> had(caches.count(), 0);
    std::uint32_t looks = 0, near = 0;
    const PartSphere ball{kPlace, radius, radius};
    for (std::uint32_t frame = 0; frame <= kLag; ++frame) {
      turns.begin({&ball, 1});
      for (std::uint32_t cache = 0; cache < caches.count(); ++cache) {
        const float covered = coveredBy(ball, caches.positionWorld[cache], caches.normal[cache]);
        if (covered == 0.0f) continue;
        ASSERT_NE(turns.leastPeriods()[cache / LookTurns::kBlock], 0u);
        near += frame == 0;
        if (!turns.hasTurn(cache, covered)) continue;
        ASSERT_TRUE(turns.mayHaveTurn(cache));
        if (frame == 0) continue;  // all of them
        ++had[cache];
        ++looks;
      }
    }
    EXPECT_LE(looks / kLag, caches.count() / 16 + near / kLag);
    EXPECT_GE(looks, near);
    for (std::uint32_t cache = 0; cache < caches.count(); ++cache)
      ASSERT_EQ(had[cache] > 0, coveredBy(ball, caches.positionWorld[cache], caches.normal[cache]) > 0.0f);
  }
}

// However many lamps there are, they reach no more caches than two would that reach them all.
TEST(LookTurns, manyLampsReachLess) {
  const Bake bake = test::makeSyntheticBake({.surfels = 512, .grid = {48, 20, 32}, .linksPerCache = 2});
  const Caches& caches = bake.caches;
  LookTurns turns(caches, 32, std::pmr::new_delete_resource());
  float last = 0.0f;
  for (const int lamps : {1, 8, 64}) {
    std::vector<PartSphere> parts;
    for (int i = 0; i < lamps; ++i)
      parts.push_back({kPlace + 0.05f * glm::vec3(i % 8, i / 8 % 4, i / 32), 0.1f, 0.1f, true});
    turns.begin(parts);
    std::size_t reached = 0;
    for (std::uint32_t cache = 0; cache < caches.count(); ++cache) {
      for (const PartSphere& part : parts)
        reached += lampWeight(part, turns.leastOfLamps(), caches.positionWorld[cache], caches.normal[cache]) > 0.0f;
    }
    EXPECT_GT(reached, caches.count() / 2u) << lamps;
    EXPECT_LT(reached, 2.4f * static_cast<float>(caches.count())) << lamps;
    EXPECT_GT(turns.leastOfLamps(), last);
    EXPECT_LE(turns.leastOfLamps(), kMinCovered);
    last = turns.leastOfLamps();
  }
  const PartSphere dark{kPlace, 0.1f, 0.1f};
  turns.begin({&dark, 1});
  EXPECT_EQ(turns.leastOfLamps(), kMinCovered);
}

}  // namespace
}  // namespace relume
