// SPDX-License-Identifier: MIT
// Of many surfaces in one place, rays hit the one that they hit among few: the first whose front they meet.
#include "bake/base/random.h"
#include "bake/rays/ray_piles.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <numeric>
#include <vector>

namespace relume {
namespace {

using namespace test;

// Copies of a quad in one place, every third with its front on the other side, behind a quad of its own.
Scene pileOf(std::size_t copies) {
  Scene scene;
  addInstance(scene, quad({-1, -1, -2}, {2, 0, 0}, {0, 2, 0}));
  for (std::size_t i = 0; i < copies; ++i) {
    const bool turned = i % 3 == 1;
    addInstance(scene, turned ? quad({-1, -1, 0}, {0, 2, 0}, {2, 0, 0}) : quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}));
  }
  finish(scene);
  return scene;
}

std::vector<Ray> raysThrough() {
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < 2000; ++i) {
    RandomStream random(1, 2, i);
    const glm::vec2 u = random.uniform2(), v = random.uniform2();
    const float side = i % 2 == 0 ? 1.0f : -1.0f;
    const glm::vec3 from(2.0f * u.x - 1.0f, 2.0f * u.y - 1.0f, side), to(2.0f * v.x - 1.0f, 2.0f * v.y - 1.0f, -side);
    rays.push_back({from, 0.0f, glm::normalize(to - from)});
  }
  return rays;
}

std::vector<Hit> hitsOn(const Scene& scene) {
  Context context;
  const auto tracer = RayTracer::create(scene, "avx2", context);
  EXPECT_TRUE(tracer) << (tracer ? "" : tracer.error().message);
  const std::vector<Ray> rays = raysThrough();
  std::vector<Hit> hits(rays.size());
  if (tracer) tracer->trace(rays, hits);
  return hits;
}

TEST(Piles, hitLikeFewCopies) {
  const std::vector<Hit> few = hitsOn(pileOf(kPile / 2 - 1)), many = hitsOn(pileOf(5 * kPile));
  ASSERT_EQ(few.size(), many.size());
  std::size_t met = 0;
  for (std::size_t i = 0; i < few.size(); ++i) {
    ASSERT_EQ(few[i].instance, many[i].instance) << i;
    EXPECT_EQ(few[i].triangle, many[i].triangle) << i;
    EXPECT_EQ(few[i].back, many[i].back) << i;
    EXPECT_EQ(few[i].barycentric, many[i].barycentric) << i;
    EXPECT_EQ(few[i].distance, many[i].distance) << i;
    met += few[i] ? 1 : 0;
  }
  EXPECT_GT(met, few.size() / 2);
}

TEST(Piles, buryAllButTheFirstOfEachWinding) {
  const Scene scene = pileOf(2 * kPile);
  std::vector<std::uint32_t> all(scene.instances.size());
  std::iota(all.begin(), all.end(), 0u);
  Context context;
  context.threads = 1;
  const std::vector<std::vector<std::uint8_t>> buried = findBuried(scene, all, context);
  context.threads = 7;
  EXPECT_TRUE(findBuried(scene, all, context) == buried);
  EXPECT_TRUE(findBuried(scene, {}, context).empty());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool isShown = i <= 2;  // the quad behind, and the first of the two windings
    EXPECT_EQ(buried[i].empty(), isShown) << i;
    for (const std::uint8_t each : buried[i]) EXPECT_EQ(each, 1) << i;
  }
}

TEST(Piles, leaveFewCopiesAndCutoutsAlone) {
  const auto count = [](const Scene& scene) {
    std::vector<std::uint32_t> all(scene.instances.size());
    std::iota(all.begin(), all.end(), 0u);
    std::size_t buried = 0;
    Context context;
    for (const auto& instance : findBuried(scene, all, context)) buried += instance.size();
    return buried;
  };
  EXPECT_EQ(count(pileOf(kPile - 1)), 0u);
  Scene masked;
  const std::uint32_t material = addHalfMask(masked);
  for (std::size_t i = 0; i < 3 * kPile; ++i) addInstance(masked, quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, material));
  finish(masked);
  EXPECT_EQ(count(masked), 0u);
}

}  // namespace
}  // namespace relume
