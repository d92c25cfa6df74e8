// SPDX-License-Identifier: MIT
// Rays aimed at emitters: the right energy from small and distant ones, and no change to what is not noise.
#include "bake/links/emitter_sampler.h"
#include "bake/links/gather.h"
#include "tests/links/links_fixture.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relume {
namespace {

using test::kPi;
using test::TileScene;

// Irradiance over pi times radiance a cache receives from emitters, and how many arrivals it came from.
struct FromEmitters {
  double received = 0;
  std::size_t arrivals = 0;
};

FromEmitters gatherEmitters(const TileScene& tiles, const glm::vec3& position, const glm::vec3& normal,
                            std::uint32_t rays, float emitterRays, std::uint64_t seed = 1) {
  Context context;
  auto tracer = RayTracer::create(tiles.scene(), "avx2", context);
  const Surfels surfels = tiles.surfels();
  const SurfelMap map = tiles.map();
  auto hierarchy = clusterSurfels(surfels, 0, {}, context);
  EXPECT_TRUE(tracer && hierarchy);
  const Gatherer gatherer(*tracer, surfels, map, *hierarchy, rays, emitterRays, seed);
  Gatherer::Scratch scratch;
  std::vector<Arrival> arrivals;
  RayCount count;
  gatherer.gather(position, normal, scratch, arrivals, count);
  const double scale = glm::dot(normal, normal) > 0.0f ? 1.0 : 0.25;
  FromEmitters sum;
  for (const Arrival& a : arrivals) {
    EXPECT_TRUE(std::isfinite(a.weight) && a.weight >= 0.0f);
    if (surfels.emission[hierarchy->sender(a.leaf)].x == 0.0f) continue;
    sum.received += scale * a.weight * a.cosine;
    ++sum.arrivals;
  }
  return sum;
}

TEST(EmitterSampler, aSmallDistantEmitterHasItsFormFactor) {
  TileScene tiles;
  tiles.addRectangle({-0.05f, 10, -0.05f}, {0.1f, 0, 0}, {0, 0, 0.1f}, 1, false, true, glm::vec3(5.0f));
  tiles.addRectangle({-20, 0, -20}, {0, 0, 40}, {40, 0, 0}, 4);
  const double factor = 0.01 / (kPi * 100.0);  // A / (pi r²): seen straight on
  for (const glm::vec3 normal : {glm::vec3(0, 1, 0), glm::vec3(0.0f)}) {
    const double expected = normal.y > 0 ? factor : factor / 4.0 * 1.0;
    const auto aimed = gatherEmitters(tiles, {0, 0, 0}, normal, 1024, 0.125f);
    EXPECT_GE(aimed.arrivals, 100u);
    EXPECT_NEAR(aimed.received, expected, 0.01 * expected);
    // Without aiming, one ray in 60000 would find it.
    EXPECT_LE(gatherEmitters(tiles, {0, 0, 0}, normal, 1024, 0.0f).arrivals, 1u);
  }
}

TEST(EmitterSampler, largeNearEmittersKeepTheirFormFactor) {
  TileScene tiles;
  tiles.addRectangle({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, 8, false, true, glm::vec3(1.0f));
  tiles.addRectangle({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, 4);
  // A point under the middle of a square, Howell C-4 four times.
  const double x = 1.0, r = std::sqrt(1 + x * x), expected = 4.0 / (2 * kPi) * 2 * (x / r) * std::atan(x / r);
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    const auto aimed = gatherEmitters(tiles, {0, 0, 0}, {0, 1, 0}, 1024, 0.25f, seed);
    EXPECT_NEAR(aimed.received, expected, 0.02 * expected);
    sum += aimed.received / 16;
  }
  EXPECT_NEAR(sum, expected, 0.003 * expected);
}

TEST(EmitterSampler, anOccluderAndTheHorizonLeaveNothing) {
  TileScene tiles;
  tiles.addRectangle({-0.5f, 2, -0.5f}, {1, 0, 0}, {0, 0, 1}, 2, false, true, glm::vec3(5.0f));
  tiles.addRectangle({-2, 1, -2}, {4, 0, 0}, {0, 0, 4}, 1, true);
  EXPECT_EQ(gatherEmitters(tiles, {0, 0, 0}, {0, 1, 0}, 1024, 1.0f).arrivals, 0u);
  EXPECT_EQ(gatherEmitters(tiles, {0, 0, 0}, {0, 0, 0}, 1024, 1.0f).arrivals, 0u);
  EXPECT_EQ(gatherEmitters(tiles, {0, 1.5f, 0}, {0, -1, 0}, 1024, 1.0f).arrivals, 0u);  // looks away
  EXPECT_EQ(gatherEmitters(tiles, {0, 3, 0}, {0, -1, 0}, 1024, 1.0f).arrivals, 0u);     // at its back
  EXPECT_GT(gatherEmitters(tiles, {0, 1.5f, 0}, {0, 1, 0}, 1024, 1.0f).arrivals, 0u);
}

// Many emitters share batches: the density is one over all of them together.
TEST(EmitterSampler, densitiesAddUpToOneOverTheArea) {
  for (const std::uint32_t tilesAlong : {1u, 40u}) {
    TileScene tiles;
    tiles.addRectangle({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, tilesAlong, false, true, glm::vec3(1.0f));
    tiles.addRectangle({5, 3, -1}, {2, 0, 0}, {0, 0, 2}, tilesAlong, true, true, glm::vec3(4.0f));
    tiles.addRectangle({-9, 0, -9}, {0, 0, 18}, {18, 0, 0}, 2);
    const SurfelMap map = tiles.map();
    const EmitterSampler sampler(tiles.scene(), tiles.surfels(), map);
    ASSERT_FALSE(sampler.empty());
    EmitterSampler::Distribution emitters;
    sampler.prepare({0, 0, 0}, {0, 1, 0}, emitters);
    const float area = 4.0f / static_cast<float>(tilesAlong * tilesAlong) / 2.0f;  // of a triangle
    double sum = 0;
    for (std::uint32_t side = 0; side < map.sides.size(); ++side) sum += double{sampler.pdf(emitters, side)} * area;
    EXPECT_NEAR(sum, 1.0, 1e-4);

    // And point() follows it: the share of points on the nearer panel.
    double near = 0, expected = 0;
    RandomStream random(1, 1, 1);
    for (int i = 0; i < 4000; ++i)
      near += sampler.point(emitters, (static_cast<float>(i) + 0.5f) / 4000, random).x < 2 ? 1.0 / 4000 : 0;
    const std::uint32_t nearSides = 4 * tilesAlong * tilesAlong;
    for (std::uint32_t side = 0; side < nearSides; ++side) expected += double{sampler.pdf(emitters, side)} * area;
    EXPECT_NEAR(near, expected, 0.02);
    EXPECT_GT(expected, 0.1);
    EXPECT_LT(expected, 0.95);
  }
}

TEST(EmitterSampler, levelsWithoutEmittersSampleNothing) {
  TileScene tiles;
  tiles.addBox(1.0f, 4);
  EXPECT_TRUE(EmitterSampler(tiles.scene(), tiles.surfels(), tiles.map()).empty());
}

}  // namespace
}  // namespace relume
