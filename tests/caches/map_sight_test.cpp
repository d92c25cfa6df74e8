// SPDX-License-Identifier: MIT
// Pixels beside walls: which caches they read between texels on both sides (bake/caches/map_sight.h).
#include "bake/caches/map_sight.h"
#include "formats/map_sight.h"
#include "runtime/shared/stencil.h"
#include "tests/caches/reads.h"
#include "tests/caches/room.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

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
void forFloor(const Placed& p, const Visit& visit) {
  const Lightmap& map = p.caches.lightmap;
  for (std::uint32_t t = 0; t < 12; ++t) {
    const auto c = p.scene.corners(p.scene.instances[0], t);
    if (std::max({c[0].y, c[1].y, c[2].y}) > 0.0f) continue;
    const std::uint32_t* corner = map.cornerUv.data() + map.parts[0].firstCorner + 3 * t;
    for (float u = 0.0f; u <= 1.0f; u += 0.01f) {
      for (float v = 0.0f; u + v <= 1.0f; v += 0.01f) {
        const glm::vec3 position = c[0] * (1.0f - u - v) + c[1] * u + c[2] * v;
        if (std::abs(position.x - kWall) <= kHalfThickness) continue;
        visit((1.0f - u - v) * unpackUnorm16x2(corner[0]) + u * unpackUnorm16x2(corner[1]) +
                  v * unpackUnorm16x2(corner[2]),
              position);
      }
    }
  }
}

TEST(MapSight, PixelsReadNothingBeyondAWall) {
  Placed p{walledRoomScene(), {}, {}, {}};
  place(p, fewCaches(400));
  const PackedMap packed(p.caches, std::pmr::new_delete_resource());
  ASSERT_FALSE(packed.sight.empty());
  double before = 0.0, after = 0.0;
  int points = 0, moved = 0;
  forFloor(p, [&](const glm::vec2& uv, const glm::vec3& position) {
    const auto beyond = [&](const glm::vec2& at) {
      float sum = 0.0f;
      forEachRead(p.caches.lightmap, at, [&](std::uint32_t cache, float weight) {
        if (cache != kNoCache && (p.caches.positionWorld[cache].x < kWall) != (position.x < kWall)) sum += weight;
      });
      return sum;
    };
    const glm::vec2 at = pointInSight(packed, uv);
    before += beyond(uv);
    after += beyond(at);
    ++points;
    if (std::abs(position.x - kWall) > 1.5f) moved += at != uv ? 1 : 0;
  });
  EXPECT_GT(before, 0.01 * points) << "or nothing is tested";
  EXPECT_LT(after, 0.05 * before);
  EXPECT_EQ(moved, 0) << "texels away from the wall";
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
    EXPECT_EQ(findMapSight(*p.tracer, p.packed, context), p.caches.lightmap.sight.toVector());
  }
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
