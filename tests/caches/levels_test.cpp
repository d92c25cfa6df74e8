// SPDX-License-Identifier: MIT
// Whole levels: every point of a side that is seen reads filled texels of caches around it, and the count is what was
// asked for.
#include "bake/caches/caches.h"
#include "tests/caches/placed.h"
#include "tests/caches/reads.h"
#include "tests/long_tests.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>

namespace relume {
namespace {

// Steps along the edges of a triangle that is scanned.
constexpr int kLattice = 6;

struct LevelReads {
  double lit = 0.0, seen = 0.0;  // [m²]
  double unfilled = 0.0;         // sum of weights on texels without a cache, over all points
  std::uint64_t scanned = 0;     // points
  std::vector<float> distance;   // [m] point to the position its caches interpolate
  Caches caches;
  double seconds = 0.0;
};

// Place caches on a level and read the light map at a point of every seen side of every triangle.
void readLevel(const std::string& path, const CacheOptions& options, LevelReads& result) {
  Context context;
  auto imported = importGltf(path, context);
  ASSERT_TRUE(imported) << imported.error().message;
  test::Placed placed{std::move(*imported), {}, {}, {}};
  ASSERT_NO_FATAL_FAILURE(test::place(placed, options, test::walks(1u << 18), context));
  const Scene& scene = placed.scene;

  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    for (std::uint32_t t = 0; t < scene.meshes[instance.mesh].triangle.size(); ++t) {
      for (const bool back : {false, true}) {
        const float area = placed.playSpace.seenArea[2 * (instance.firstTriangle + t) + back];
        if (!(area > 0.0f)) continue;
        const auto c = scene.corners(instance, t);
        // Corners, edges and a lattice between them: filters reach farthest there.
        for (int y = 0; y <= kLattice; ++y) {
          for (int x = 0; x + y <= kLattice; ++x) {
            const auto read =
                test::readLightmap(placed.caches, i, t, glm::vec2(x, y) / static_cast<float>(kLattice), back);
            result.unfilled += static_cast<double>(read.unfilled);
            ++result.scanned;
          }
        }
        const int points = std::clamp(static_cast<int>(area * 4.0f), 1, 50);
        for (int k = 0; k < points; ++k) {
          glm::vec2 w(uniform(random), uniform(random));
          if (w.x + w.y > 1.0f) w = 1.0f - w;
          const glm::vec2 world = instance.flipped ? glm::vec2(w.y, w.x) : w;
          const auto read = test::readLightmap(placed.caches, i, t, w, back);
          ++result.scanned;
          result.seen += area / points;
          if (read.gridLit) continue;
          result.lit += area / points;
          result.unfilled += read.unfilled;
          result.distance.push_back(
              glm::distance(read.position, c[0] + (c[1] - c[0]) * world.x + (c[2] - c[0]) * world.y));
        }
      }
    }
  }
  result.caches = std::move(placed.caches);
}

std::string level(const std::string& name) {
  return std::string(RELUME_SHARED_DIR) + "/scenes/" + name + "/" + name + ".glb";
}

float quantile(std::vector<float>& values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Every level there is: two_rooms ships, the others are read where they lie.
struct ScanLevel {
  const char* name;
  bool large;  // scanned in the long run only
};

class Scan : public testing::TestWithParam<ScanLevel> {};

TEST_P(Scan, NoVisiblePointReadsAnUnfilledTexel) {
  const auto& [name, large] = GetParam();
  const std::string path =
      std::string(name) == "two_rooms" ? std::string(RELUME_SOURCE_DIR) + "/samples/level/two_rooms.glb" : level(name);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  if (large && !test::longTests()) GTEST_SKIP() << "a long test: RELUME_LONG_TESTS=1";
  // Few texels and many: charts of one texel, and charts with borders of their own.
  for (const std::uint32_t caches : {500u, 8281u}) {
    LevelReads reads;
    CacheOptions options;
    options.lightmapCaches = caches;
    options.gridCaches = 100;
    readLevel(path, options, reads);
    EXPECT_GT(reads.scanned, 1000u);
    EXPECT_EQ(reads.unfilled, 0.0) << caches << " caches";
  }
}

INSTANTIATE_TEST_SUITE_P(, Scan,
                         testing::Values(ScanLevel{"two_rooms", false}, ScanLevel{"cornell", false},
                                         ScanLevel{"house", true}, ScanLevel{"breakfast_room", true},
                                         ScanLevel{"gas_station", true}, ScanLevel{"pandora", true},
                                         ScanLevel{"fortitude", true}, ScanLevel{"sponza", true}),
                         [](const auto& each) { return std::string(each.param.name); });

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
