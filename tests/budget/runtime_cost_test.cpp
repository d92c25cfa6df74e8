// SPDX-License-Identifier: MIT
// What a bake is reckoned to cost, against what a relighter of it holds.
#include "bake/budget/runtime_cost.h"
#include "relume/bake/bake.h"
#include "tests/budget/sample_level.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace relume {
namespace {

TEST(RuntimeCost, bytesAreThoseThatARelighterHolds) {
  const Scene scene = test::sampleLevel();
  for (const LinkKind kind : kLinkKinds) {
    for (const std::uint32_t bands : {1u, 3u, 4u}) {
      BakeOptions options = test::smallBakeOptions();
      options.links.kind = kind;
      options.links.bands = options.lumaBands = bands;
      options.chromaBands = std::min(bands, 2u);
      Context context;
      const Result<Bake> baked = bake(scene, options, context);
      ASSERT_TRUE(baked) << baked.error().message;
      const double held = test::heldBytes(*baked), reckoned = runtimeCost(*baked).bytes;
      EXPECT_NEAR(reckoned / held, 1.0, 0.02) << linkKindName(kind) << ", " << bands << " bands: " << held;
    }
  }
}

TEST(RuntimeCost, growsWithEverySize) {
  CostSizes sizes;
  sizes.surfels = 131072;
  sizes.skyPatches = 64;
  sizes.gridCaches = 2000;
  sizes.mapCaches = 16000;
  sizes.texels = 40000;
  sizes.gridIndexBytes = 700000;
  sizes.lumaBands = 4;
  sizes.chromaBands = 2;
  const RuntimeCost before = costWithoutLinks(sizes);
  for (double CostSizes::*const size : {&CostSizes::surfels, &CostSizes::gridCaches, &CostSizes::mapCaches}) {
    CostSizes more = sizes;
    more.*size *= 2.0;
    EXPECT_GT(costWithoutLinks(more).bytes, before.bytes);
    EXPECT_GT(costWithoutLinks(more).frameMs, before.frameMs);
    EXPECT_GE(costOfLink(more).frameMs, costOfLink(sizes).frameMs);
  }
  for (std::uint32_t CostSizes::*const bands : {&CostSizes::lumaBands, &CostSizes::chromaBands}) {
    CostSizes more = sizes;
    more.*bands += 1;
    EXPECT_GT(costWithoutLinks(more).bytes, before.bytes);
    EXPECT_GT(costOfLink(more).frameMs, costOfLink(sizes).frameMs);
  }
}

}  // namespace
}  // namespace relume
