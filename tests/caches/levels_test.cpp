// SPDX-License-Identifier: MIT
// Whole levels: every point that is seen reads filled texels of caches around it, and the count is what was asked for.
#include "bake/caches/caches.h"
#include "tests/caches/reads.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>

namespace relume {
namespace {

struct LevelReads {
  double lit = 0.0, seen = 0.0;         // [m²]
  double unfilled = 0.0;                // sum of weights on texels without a cache
  std::vector<float> distance;          // [m] point to the position its caches interpolate
  Caches caches;
  double seconds = 0.0;
};

// Place caches on a level and read the light map at a point of every seen side of every triangle.
void readLevel(const std::string& path, const CacheOptions& options, LevelReads& result) {
  Context context;
  auto scene = importGltf(path, context);
  ASSERT_TRUE(scene) << scene.error().message;
  auto tracer = RayTracer::create(*scene, "avx2", context);
  ASSERT_TRUE(tracer) << tracer.error().message;
  PlaySpaceOptions space;
  space.walks = 1u << 18;
  auto playSpace = findPlaySpace(*tracer, space, 1, context);
  ASSERT_TRUE(playSpace) << playSpace.error().message;
  auto caches = placeCaches(*tracer, *playSpace, options, 1, context);
  ASSERT_TRUE(caches) << caches.error().message;

  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  for (std::uint32_t i = 0; i < scene->instances.size(); ++i) {
    const Instance& instance = scene->instances[i];
    for (std::uint32_t t = 0; t < scene->meshes[instance.mesh].triangle.size(); ++t) {
      for (const bool back : {false, true}) {
        const float area = playSpace->seenArea[2 * (instance.firstTriangle + t) + back];
        if (!(area > 0.0f)) continue;
        const auto c = scene->corners(instance, t);
        const int points = std::clamp(static_cast<int>(area * 4.0f), 1, 50);
        for (int k = 0; k < points; ++k) {
          glm::vec2 w(uniform(random), uniform(random));
          if (w.x + w.y > 1.0f) w = 1.0f - w;
          const glm::vec2 world = instance.flipped ? glm::vec2(w.y, w.x) : w;
          const auto read = test::readLightmap(*caches, i, t, w, back);
          result.seen += area / points;
          if (read.gridLit) continue;
          result.lit += area / points;
          result.unfilled += read.unfilled;
          result.distance.push_back(glm::distance(read.position, c[0] + (c[1] - c[0]) * world.x + (c[2] - c[0]) * world.y));
        }
      }
    }
  }
  result.caches = std::move(*caches);
}

std::string level(const std::string& name) { return std::string(RELUME_SHARED_DIR) + "/scenes/" + name + "/" + name + ".glb"; }

float quantile(std::vector<float>& values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

TEST(Levels, CornellReadsNoUnfilledTexel) {
  if (!std::filesystem::exists(level("cornell"))) GTEST_SKIP() << "no " << level("cornell");
  LevelReads reads;
  CacheOptions options;
  options.lightmapCaches = 4000;
  readLevel(level("cornell"), options, reads);
  ASSERT_FALSE(reads.distance.empty());
  EXPECT_EQ(reads.unfilled, 0.0);
  EXPECT_GT(reads.lit, 0.98 * reads.seen);
  EXPECT_LT(quantile(reads.distance, 0.5), 0.02f);
}

TEST(Levels, SponzaReadsNoUnfilledTexelAndHasTheCachesAskedFor) {
  if (!std::filesystem::exists(level("sponza"))) GTEST_SKIP() << "no " << level("sponza");
  LevelReads reads;
  CacheOptions options;
  readLevel(level("sponza"), options, reads);
  ASSERT_FALSE(reads.distance.empty());
  EXPECT_EQ(reads.unfilled, 0.0);
  const auto grid = std::count(reads.caches.normal.begin(), reads.caches.normal.end(), glm::vec3(0.0f));
  const double count = static_cast<double>(reads.caches.count()) - static_cast<double>(grid);
  EXPECT_NEAR(count, options.lightmapCaches, 0.05 * options.lightmapCaches);
  // The rest is the inside of curtains, pipes and columns, where walks stray.
  EXPECT_GT(reads.lit, 0.75 * reads.seen);
  EXPECT_LT(quantile(reads.distance, 0.5), 0.4f);
  // Texels are about a metre; a point far from its caches lies where hardly anybody looks.
  EXPECT_LT(quantile(reads.distance, 0.9), 2.0f);
}

}  // namespace
}  // namespace relume
