// SPDX-License-Identifier: MIT
// Levels far larger than what can be seen of them: what a bake makes must follow what is seen.
#include "bake/caches/caches.h"
#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {
namespace {

using namespace test;

// A box of 1 m on a ground of `size`, a camera beside it; and a sky box of that size, if wanted.
Scene openLevel(float size, float skyBox = 0.0f) {
  Scene scene;
  const std::uint32_t grey = addMaterial(scene, glm::vec3(0.5f)), red = addMaterial(scene, {0.7f, 0.2f, 0.1f}),
                      blue = addMaterial(scene, {0.3f, 0.5f, 0.9f});
  const float h = 0.5f * size, s = 0.5f * skyBox;
  addInstance(scene, quad({-h, 0, -h}, {0, 0, size}, {size, 0, 0}, grey));
  addInstance(scene, box({-0.5f, 0, -0.5f}, {0.5f, 1, 0.5f}, false, red));
  if (skyBox > 0.0f) addInstance(scene, box(glm::vec3(-s), glm::vec3(s), true, blue));
  scene.cameras.push_back(lookAt({-2.2f, 1.6f, 2.4f}, {0, 0.4f, 0}));
  finish(scene);
  return scene;
}

struct Baked {
  RayTracer tracer;
  PlaySpace space;
  PlacedSurfels surfels;
  Caches caches;
};

Baked place(const Scene& scene) {
  Context context;
  RayTracer tracer = std::move(*RayTracer::create(scene, "avx2", context));
  const BakeOptions options = presetOptions(Preset::draft);
  PlaySpace space = std::move(*findPlaySpace(tracer, options.playSpace, 1, context));
  PlacedSurfels surfels = std::move(*placeSurfels(tracer, space, options.surfels, 1, context));
  auto caches = placeCaches(tracer, space, options.caches, 1, context);
  EXPECT_TRUE(caches) << caches.error().message;
  return {std::move(tracer), std::move(space), std::move(surfels), unpack(std::move(*caches))};
}

class OpenLevel : public testing::TestWithParam<float> {};

TEST_P(OpenLevel, isSeenAsFarAsASmallOneIs) {
  const Scene small = openLevel(200.0f), scene = openLevel(GetParam());
  const Baked few = place(small), baked = place(scene);
  // Rays start 1 m off the surfaces of a level of 1,000 km, and see farther from there.
  const double more = GetParam() < 1e5f ? 0.35 : 3.0;
  EXPECT_NEAR(baked.space.seenTotal, few.space.seenTotal, more * few.space.seenTotal);
  EXPECT_GT(baked.space.seenTotal, 100.0);

  // Surfels stand where something is seen, and hits near the box find one that is near.
  EXPECT_EQ(baked.surfels.surfels.count(), few.surfels.surfels.count());
  const float spacing = baked.surfels.statistics.spacingDensest;
  std::size_t asked = 0, found = 0;
  for (int x = -20; x <= 20; ++x) {
    for (int z = -20; z <= 20; ++z) {
      const glm::vec3 from(0.15f * static_cast<float>(x), 3.0f, 0.15f * static_cast<float>(z));
      const Hit hit = baked.tracer.trace({from, 0.0f, {0, -1, 0}});
      ASSERT_TRUE(hit);
      ++asked;
      const std::uint32_t side = 2 * (scene.instances[hit.instance].firstTriangle + hit.triangle);
      const std::uint32_t surfel = baked.surfels.map.at(side, hit.barycentric);
      if (surfel == kNone) continue;
      const glm::vec3 at = from - glm::vec3(0, hit.distance, 0);
      found += glm::distance(at, baked.surfels.seeds[surfel].positionWorld) < 4.0f * spacing ? 1 : 0;
    }
  }
  EXPECT_GT(found, asked * 97 / 100);

  // What is laid out follows what is seen.
  EXPECT_LT(baked.surfels.map.tile.size(), 4u << 20);
  EXPECT_LT(baked.caches.lightmap.cache.size(), 1u << 20);
  const CacheGrid& grid = baked.caches.grid;
  EXPECT_LT(glm::length(grid.spacing * glm::vec3(grid.resolution)), 1000.0f);
  std::size_t near = 0;
  for (const glm::vec3& p : baked.caches.positionWorld) near += glm::length(p) < 30.0f ? 1 : 0;
  EXPECT_GT(near, baked.caches.count() / 4u);
}
INSTANTIATE_TEST_SUITE_P(Sizes, OpenLevel, testing::Values(2e3f, 2e4f, 1e6f));

TEST(OpenLevel, aSkyBoxTakesFewSurfelsAndNoTexels) {
  const Scene scene = openLevel(200.0f, 10000.0f);
  const Baked baked = place(scene);
  std::size_t sky = 0;
  for (const std::uint32_t instance : baked.surfels.surfels.instance) sky += instance == 2 ? 1 : 0;
  EXPECT_GT(sky, 12u);
  EXPECT_LT(sky, baked.surfels.surfels.count() / 6u);
  const LightmapPart& part = baked.caches.lightmap.parts[2];
  for (std::uint32_t i = 0; i < 3 * part.triangleCount; ++i)
    EXPECT_EQ(baked.caches.lightmap.cornerUv[part.firstCorner + i], kGridLit);
  // All of it sends its light.
  std::size_t asked = 0, found = 0;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const float y = (static_cast<float>(i) + 0.5f) / 500.0f, phi = 2.39996f * static_cast<float>(i),
                r = std::sqrt(1.0f - y * y);
    const Hit hit = baked.tracer.trace({{1, 1.5f, 0}, 0.0f, {r * std::cos(phi), y, r * std::sin(phi)}});
    if (!hit || hit.instance != 2) continue;
    ++asked;
    const std::uint32_t side = 2 * (scene.instances[2].firstTriangle + hit.triangle);
    const std::uint32_t surfel = baked.surfels.map.at(side, hit.barycentric);
    found += surfel != kNone && baked.surfels.surfels.instance[surfel] == 2 ? 1 : 0;
  }
  EXPECT_GT(asked, 400u);
  EXPECT_GT(found, asked * 95 / 100);
}

}  // namespace
}  // namespace relume
