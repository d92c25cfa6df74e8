// SPDX-License-Identifier: MIT
// A bake over a ray tracer that is there gives the bytes of one that builds its own, and leaves the tracer.
#include "bake/bake_over_rays.h"

#include "relume/bake_file.h"
#include "tests/load_level.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

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

TEST(BakeOverRays, givesTheBytesOfBakeAndLeavesTheRays) {
  const Scene scene = test::loadLevel(std::filesystem::path(RELUME_SOURCE_DIR) / "samples/level/two_rooms.glb");
  const BakeOptions options = test::tinyBakeOptions();
  Context context;
  const std::vector<std::byte> own = serialised(bake(scene, options, context));
  for (const RayStructure structure : {RayStructure::quick, RayStructure::bundles, RayStructure::quickBundles}) {
    auto made = RayTracer::create(scene, options.embreeIsa, context, structure);
    ASSERT_TRUE(made);
    const Ray down{scene.cameras.front().toWorld[3], 0.0f, {0, -1, 0}};
    const float height = made->trace(down).distance;
    std::optional<RayTracer> rays(std::move(*made));
    EXPECT_TRUE(serialised(bakeOverRays(scene, options, rays, context)) == own);
    ASSERT_TRUE(rays);
    EXPECT_EQ(rays->trace(down).distance, height);
  }
  std::optional<RayTracer> none;
  EXPECT_TRUE(serialised(bakeOverRays(scene, options, none, context)) == own);
  EXPECT_TRUE(none);
}

}  // namespace
}  // namespace relume
