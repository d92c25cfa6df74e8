// SPDX-License-Identifier: MIT
// A bake over a ray tracer that is there gives the bytes of one that builds its own, and leaves the tracer; over one of
// another structure, but for rays that end on the border of what two surfels stand for.
#include "bake/bake_over_rays.h"

#include "relume/bake_file.h"
#include "tests/load_level.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <vector>

namespace relume {
namespace {

std::vector<std::byte> serialised(const Result<Bake>& bake) {
  EXPECT_TRUE(bake) << bake.error().message;
  const auto bytes = serializeBake(*bake);
  EXPECT_TRUE(bytes);
  return *bytes;
}

// Everything that does not hang on the last bits of a hit is the same, and nearly all links are.
void expectNearlyEqual(const Bake& bake, const Bake& other) {
  EXPECT_TRUE(std::ranges::equal(bake.surfels.positionWorld, other.surfels.positionWorld));
  EXPECT_TRUE(std::ranges::equal(bake.hierarchy.child, other.hierarchy.child));
  ASSERT_TRUE(std::ranges::equal(bake.caches.positionWorld, other.caches.positionWorld));
  std::size_t same = 0;
  for (std::uint32_t c = 0; c < bake.caches.count(); ++c) {
    const auto rowOf = [c](const Links& links) {
      return links.head.span().subspan(links.rowBegin[c], links.rowBegin[c + 1] - links.rowBegin[c]);
    };
    same += std::ranges::equal(rowOf(bake.links), rowOf(other.links));
  }
  EXPECT_GE(100 * same, 95 * std::size_t{bake.caches.count()});
}

TEST(BakeOverRays, givesTheBytesOfBakeAndLeavesTheRays) {
  const Scene scene = test::loadLevel(std::filesystem::path(RELUME_SOURCE_DIR) / "samples/level/two_rooms.glb");
  const BakeOptions options = test::tinyBakeOptions();
  Context context;
  const Result<Bake> expected = bake(scene, options, context);
  const std::vector<std::byte> own = serialised(expected);
  for (const RayStructure structure : {RayStructure::quick, RayStructure::bundles, RayStructure::quickBundles}) {
    auto made = RayTracer::create(scene, options.embreeIsa, context, structure);
    ASSERT_TRUE(made);
    const Ray down{scene.cameras.front().toWorld[3], 0.0f, {0, -1, 0}};
    const float height = made->trace(down).distance;
    std::optional<RayTracer> rays(std::move(*made));
    const Result<Bake> other = bakeOverRays(scene, options, rays, context);
    ASSERT_TRUE(other) << other.error().message;
    if (structure == RayStructure::quick) {
      EXPECT_TRUE(serialised(other) == own);  // what bake() builds for so few rays
    } else {
      expectNearlyEqual(*expected, *other);
    }
    ASSERT_TRUE(rays);
    EXPECT_EQ(rays->trace(down).distance, height);
  }
  std::optional<RayTracer> none;
  EXPECT_TRUE(serialised(bakeOverRays(scene, options, none, context)) == own);
  EXPECT_TRUE(none);
}

}  // namespace
}  // namespace relume
