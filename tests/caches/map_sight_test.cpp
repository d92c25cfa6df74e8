// SPDX-License-Identifier: MIT
// Pixels beside walls: which caches they read between texels on both sides (bake/caches/map_sight.h).
#include "bake/caches/map_sight.h"

#include "bake/base/memory_budget.h"
#include "formats/map_sight.h"
#include "runtime/shared/stencil.h"
#include "tests/caches/reads.h"
#include "tests/caches/room.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

TEST(MapSight, ALinePartsTheSquare) {
  // x > 0.75 is beyond: there the upper texels of x, before it the corner of both lower ones.
  const std::uint32_t word = packMapSight(100, 0, 25, kSightLower | kSightLower << 2, kSightUpper);
  EXPECT_EQ(placeInSight(word, {0.7f, 0.9f}), glm::vec2(0, 0));
  EXPECT_EQ(placeInSight(word, {0.8f, 0.9f}), glm::vec2(1, 0.9f));
  // The other way round, with what is negative.
  const std::uint32_t back = packMapSight(-100, 0, -25, kSightUpper, kSightStays);
  EXPECT_EQ(placeInSight(back, {0.8f, 0.3f}), glm::vec2(1, 0.3f));
  EXPECT_EQ(placeInSight(back, {0.7f, 0.3f}), glm::vec2(0.7f, 0.3f));
  // A quarter about (0.25, 0.75): less of x and more of y is beyond.
  const std::uint32_t quarter = packMapSight(2 * -32 + 1, 2 * 32, kSightQuarter, kSightUpper, kSightLower);
  EXPECT_EQ(placeInSight(quarter, {0.2f, 0.8f}), glm::vec2(0, 0.8f));
  for (const glm::vec2 near : {glm::vec2(0.3f, 0.8f), glm::vec2(0.2f, 0.7f), glm::vec2(0.9f, 0.1f)})
    EXPECT_EQ(placeInSight(quarter, near), glm::vec2(1, near.y));
  EXPECT_TRUE(isMapSight(word) && isMapSight(back) && isMapSight(0));
  EXPECT_FALSE(isMapSight(packMapSight(0, 0, 0, 3, 0)) || isMapSight(packMapSight(0, 0, 0, 0, 3u << 2)));
}

// visit(uv, position) over the floor of the walled room, but for what is under the wall.
template <class Visit>
void forFloor(const Placed& p, float wall, float halfThickness, const Visit& visit) {
  const Lightmap& map = p.caches.lightmap;
  for (std::uint32_t t = 0; t < 12; ++t) {
    const auto c = p.scene.corners(p.scene.instances[0], t);
    if (std::max({c[0].y, c[1].y, c[2].y}) > 0.0f) continue;
    const std::uint32_t* corner = map.cornerUv.data() + map.parts[0].firstCorner + 3 * t;
    for (float u = 0.0f; u <= 1.0f; u += 0.01f) {
      for (float v = 0.0f; u + v <= 1.0f; v += 0.01f) {
        const glm::vec3 position = c[0] * (1.0f - u - v) + c[1] * u + c[2] * v;
        if (std::abs(position.x - wall) <= halfThickness) continue;
        visit((1.0f - u - v) * unpackUnorm16x2(corner[0]) + u * unpackUnorm16x2(corner[1]) +
                  v * unpackUnorm16x2(corner[2]),
              position);
      }
    }
  }
}

// Of a point of the floor, the weight of caches on the other side of the wall.
float weightBeyond(const Placed& p, float wall, const glm::vec2& uv, const glm::vec3& position) {
  float sum = 0.0f;
  forEachRead(p.caches.lightmap, uv, [&](std::uint32_t cache, float weight) {
    if (cache != kNoCache && (p.caches.positionWorld[cache].x < wall) != (position.x < wall)) sum += weight;
  });
  return sum;
}

TEST(MapSight, PixelsReadNothingBeyondAWall) {
  Placed p{walledRoomScene(), {}, {}, {}};
  place(p, fewCaches(400));
  const PackedMap packed(p.caches, std::pmr::new_delete_resource());
  ASSERT_FALSE(packed.sight.empty());
  double before = 0.0, after = 0.0;
  int points = 0, moved = 0;
  forFloor(p, kWall, kHalfThickness, [&](const glm::vec2& uv, const glm::vec3& position) {
    const glm::vec2 at = pointInSight(packed, uv);
    before += weightBeyond(p, kWall, uv, position);
    after += weightBeyond(p, kWall, at, position);
    ++points;
    if (std::abs(position.x - kWall) > 1.5f) moved += at != uv ? 1 : 0;
  });
  EXPECT_GT(before, 0.01 * points) << "or nothing is tested";
  EXPECT_LT(after, 0.05 * before);
  EXPECT_EQ(moved, 0) << "texels away from the wall";
}

struct Wall {
  float from, to;  // where its faces are in a square of the map
};

// What is read across a wall of the room, as a share of what would be without sight.
double leakOf(const Wall& wall) {
  constexpr float kSquare = 0.8f, kFirst = 0.8f;  // [m] a square, and where the wall's begins along x
  const float middle = kFirst + 0.5f * kSquare * (wall.from + wall.to), half = 0.5f * kSquare * (wall.to - wall.from);
  Placed p{walledRoomScene(middle, half), {}, {}, {}};
  place(p, fewCaches(400));
  EXPECT_EQ(p.caches.lightmap.width, 24u) << "or the faces are elsewhere";
  const PackedMap packed(p.caches, std::pmr::new_delete_resource());
  double before = 0.0, after = 0.0;
  forFloor(p, middle, half, [&](const glm::vec2& uv, const glm::vec3& position) {
    before += weightBeyond(p, middle, uv, position);
    after += weightBeyond(p, middle, pointInSight(packed, uv), position);
  });
  EXPECT_GT(before, 50.0) << "or nothing is tested";
  return after / before;
}

// Points in the body of a wall, where nobody looks, hold none of those beside it in place.
TEST(MapSight, BothSidesOfThickWallsAreMoved) {
  for (const Wall& wall : {Wall{0.156f, 0.32f}, Wall{0.66f, 0.8f}, Wall{0.4f, 0.6f}})
    EXPECT_LT(leakOf(wall), 0.001) << wall.from << " to " << wall.to;
}

// A face between two rows of points, of which one is in the wall: a line half way between them would leave a strip.
TEST(MapSight, LinesLieWithinWalls) {
  for (const Wall& wall : {Wall{0.35f, 0.475f}, Wall{0.1625f, 0.2875f}})
    EXPECT_LT(leakOf(wall), 0.001) << wall.from << " to " << wall.to;
}

TEST(MapSight, OpenFloorsHaveNone) {
  Placed p{roomScene(), {}, {}, {}};
  place(p, fewCaches(400));
  EXPECT_TRUE(p.caches.lightmap.sight.empty());
}

TEST(MapSight, ThreadsDoNotChangeIt) {
  Placed p{walledRoomScene(), {}, {}, {}};
  place(p, fewCaches(400));
  for (const int threads : {1, 3}) {
    Context context;
    context.threads = threads;
    const auto sight = findMapSight(*p.tracer, p.packed, context);
    ASSERT_TRUE(sight) << sight.error().message;
    EXPECT_EQ(*sight, p.caches.lightmap.sight.toVector());
  }
}

// Each sliver is listed where it runs, which takes 6 MiB, and not all over its bounding box, which would take 160 MiB.
TEST(MapSight, SliversTakeLittleMemory) {
  constexpr int kSlivers = 4000;
  constexpr std::uint32_t kTexels = 256;
  Mesh fan;
  const auto rim = [](int i) {
    const float angle = 2.0f * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(kSlivers);
    return glm::vec3(std::cos(angle), 0.0f, -std::sin(angle));
  };
  for (int i = 0; i < kSlivers; ++i) addTriangle(fan, glm::vec3(0.0f), rim(i), rim(i + 1));
  std::vector<std::uint32_t> corners;
  for (const glm::uvec3& triangle : fan.triangle) {
    for (int c = 0; c < 3; ++c) {
      const glm::vec3& at = fan.position[triangle[c]];
      corners.push_back(packUnorm16x2(0.5f + 0.5f * glm::vec2(at.x, at.z)));
    }
  }
  Scene scene;
  addInstance(scene, std::move(fan), "fan");
  PlacedCaches caches;
  caches.positionWorld = std::vector<glm::vec3>{glm::vec3(0.0f)};
  caches.normal = std::vector<glm::vec3>{glm::vec3(0, 1, 0)};
  caches.lightmap.width = caches.lightmap.height = kTexels;
  caches.lightmap.cache = std::vector<std::uint32_t>(kTexels * kTexels, 0);
  caches.corners.front = packCorners(corners);
  Context context;
  const auto tracer = RayTracer::create(scene, "avx2", context);
  ASSERT_TRUE(tracer) << tracer.error().message;
  context.maxMemory = heldMemory() + (std::uint64_t{32} << 20);
  const auto sight = findMapSight(*tracer, caches, context);
  ASSERT_TRUE(sight) << sight.error().message;
  EXPECT_TRUE(sight->empty()) << "all of it sees the only cache";
  context.maxMemory = heldMemory() + (std::uint64_t{1} << 20);
  const auto refused = findMapSight(*tracer, caches, context);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("light map needs about"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("lower --lightmap-caches"), std::string::npos) << refused.error().message;
}

// What is not finite is left to the look-up, which finds nothing there; what lies outside reads the map's border.
TEST(MapSight, AnyPointWillDo) {
  Placed p{walledRoomScene(), {}, {}, {}};
  place(p, fewCaches(400));
  const PackedMap packed(p.caches, std::pmr::new_delete_resource());
  const float values[] = {0.3f, -1e10f, 3e38f, std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN()};
  for (const float x : values) {
    for (const float y : values) {
      const glm::vec2 at = pointInSight(packed, {x, y});
      EXPECT_EQ(std::isfinite(at.x) && std::isfinite(at.y), std::isfinite(x) && std::isfinite(y)) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace relume
