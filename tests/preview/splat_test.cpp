// SPDX-License-Identifier: MIT
// The image side of records: boxes of spheres, RCS Eq. (1) by tiles, and records that contradict each other.
#include "bake/preview/adapt_reach.h"
#include "bake/preview/record_tiles.h"
#include "bake/preview/screen_box.h"

#include "bake/base/random.h"
#include "relume/bake/context.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr std::uint32_t kColumns = 64, kRows = 36;

glm::vec3 cube(RandomStream& random, float halfWidth) {
  const glm::vec2 xy = random.uniform2();
  return halfWidth * (2.0f * glm::vec3(xy, random.uniform()) - 1.0f);
}

// The pixel in which a point is seen; false where it is not.
bool pixelOf(const Camera& camera, const glm::vec3& p, std::uint32_t& x, std::uint32_t& y) {
  const glm::dvec4 c = glm::inverse(glm::dmat4(camera.toWorld)) * glm::dvec4(p, 1.0);
  const double half = camera.orthographic ? camera.yMag : std::tan(0.5 * camera.yfovRad);
  const double ahead = camera.orthographic ? 1.0 : -c.z;
  if (!(-c.z > 0.0)) return false;
  const double u = (c.x / (ahead * half) * kRows / kColumns * 0.5 + 0.5) * kColumns,
               v = (0.5 - 0.5 * c.y / (ahead * half)) * kRows;
  if (u < 0.0 || v < 0.0 || u >= kColumns || v >= kRows) return false;
  x = static_cast<std::uint32_t>(u);
  y = static_cast<std::uint32_t>(v);
  return true;
}

// Spheres everywhere: far, beside, behind and around the eye; points within them and on their outlines.
TEST(ScreenBox, holdsEveryPixelThroughWhichASphereIsSeen) {
  RandomStream random(1, 2, 3);
  for (const bool orthographic : {false, true}) {
    Camera camera = lookAt({1, 2, 3}, {4, 1, -2}, 1.1f);
    camera.orthographic = orthographic;
    camera.yMag = 2.0f;
    const CameraRays rays(camera, kColumns, kRows);
    for (int i = 0; i < 100000; ++i) {
      const glm::vec3 center = rays.origin + cube(random, 6.0f);
      const float radius = std::pow(10.0f, 3.0f * random.uniform() - 2.0f);
      const ScreenBox box = boxOfSphere(rays, center, radius);
      const glm::vec3 within = cube(random, 1.0f);
      const float length = std::max(glm::length(within), 1e-6f);
      const glm::vec3 p =
          center + radius * (random.uniform() < 0.5f ? within / length : within / std::max(length, 1.0f));
      std::uint32_t x = 0, y = 0;
      if (!pixelOf(camera, p, x, y)) continue;
      ASSERT_TRUE(x >= box.minX && x < box.maxX && y >= box.minY && y < box.maxY)
          << i << ": " << x << ' ' << y << " of " << box.minX << ".." << box.maxX << ' ' << box.minY << ".."
          << box.maxY;
    }
  }
}

TEST(ScreenBox, isSmallFarAwayAndEmptyBehindTheEye) {
  const CameraRays rays(lookAt({0, 0, 0}, {0, 0, -1}, 1.0f), kColumns, kRows);
  const ScreenBox far = boxOfSphere(rays, {0, 0, -100}, 0.1f);
  EXPECT_LE(far.maxX - far.minX, 2u);
  EXPECT_LE(far.maxY - far.minY, 2u);
  const ScreenBox behind = boxOfSphere(rays, {0, 0, 5}, 1.0f);
  EXPECT_TRUE(behind.minX >= behind.maxX || behind.minY >= behind.maxY);
  const ScreenBox around = boxOfSphere(rays, {0, 0, 0.5f}, 1.0f);
  EXPECT_EQ(around.maxX - around.minX, kColumns);
  EXPECT_EQ(around.maxY - around.minY, kRows);
}

// A floor seen at a slant, and records strewn over it.
struct Floor {
  Camera camera = lookAt({0, 2, 4}, {0, 0, 0}, 0.9f);
  CameraRays rays{camera, kColumns, kRows};
  std::vector<PixelReceiver> receivers;

  Floor() {
    for (std::uint32_t i = 0; i < kColumns * kRows; ++i) {
      glm::vec3 origin, direction;
      rays.at(static_cast<float>(i % kColumns) + 0.5f, static_cast<float>(i / kColumns) + 0.5f, origin, direction);
      PixelReceiver r;
      if (direction.y < -0.02f) r = {origin - direction * (origin.y / direction.y), {0, 1, 0}, {0, 1, 0}, 0.05f};
      receivers.push_back(r);
    }
  }
};

// Irradiance 10 + 3 x - 2 z: its vector, for a normal that is +Y, and its gradient.
RecordLight linearAt(const glm::vec3& p) {
  const float e = 10.0f + 3.0f * p.x - 2.0f * p.z;
  RecordLight light;
  for (int c = 0; c < 3; ++c) {
    light.vector[c] = static_cast<float>(c + 1) * glm::vec3(0, e, 0);
    light.gradient[c] = static_cast<float>(c + 1) * glm::vec3(3, 0, -2);
  }
  return light;
}

std::vector<Record> strewn(const Floor& floor, std::size_t count) {
  RandomStream random(5, 6, 7);
  std::vector<Record> records;
  while (records.size() < count) {
    const PixelReceiver& r = floor.receivers[random.below(kColumns * kRows)];
    if (r.normal == glm::vec3(0.0f)) continue;
    Record record;
    record.positionWorld = r.positionWorld;
    record.normal = glm::normalize(glm::vec3(0.05f, 1, 0) * glm::vec3(random.uniform(), 1, 1));
    record.distance = 1.0f + 4.0f * random.uniform();
    record.nearest = record.distance;
    record.footprint = r.footprint;
    record.reflected = linearAt(r.positionWorld);
    record.sky.vector[1] = random.uniform() * record.normal;
    records.push_back(record);
  }
  return records;
}

// The paper's "quality identical to classical irradiance caching": the splat is Eq. (1) over all records.
TEST(RecordTiles, splatIsEquationOne) {
  const Floor floor;
  const std::vector<Record> records = strewn(floor, 400);
  for (const RecordWeight weight : {RecordWeight::smooth, RecordWeight::ward, RecordWeight::tabellion}) {
    Interpolation options;
    options.weight = weight;
    const RecordTiles tiles(floor.rays, records, options);
    std::uint32_t lit = 0;
    for (std::uint32_t i = 0; i < floor.receivers.size(); ++i) {
      const PixelReceiver& r = floor.receivers[i];
      glm::dvec3 reflected(0.0), sky(0.0);
      double total = 0.0;
      for (const Record& record : records) {
        if (r.normal == glm::vec3(0.0f)) continue;
        const double w = weightOf(record, reachOf(record, options), r, options);
        const glm::vec3 offset = r.positionWorld - record.positionWorld;
        reflected += w * glm::dvec3(extrapolate(record.reflected, offset, r.normal));
        sky += w * glm::dvec3(extrapolate(record.sky, offset, r.normal));
        total += w;
      }
      const Splat splat = tiles.splat(i % kColumns, i / kColumns, r);
      EXPECT_NEAR(splat.weight, total, 1e-5 * total);
      if (total <= 0.0) continue;
      ++lit;
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(splat.reflected[c], reflected[c] / total, 1e-5 * reflected[c] / total);
        EXPECT_NEAR(splat.sky[c], sky[c] / total, 1e-5 * (sky[c] / total + 1e-6));
      }
    }
    EXPECT_GT(lit, 500u);
  }
}

TEST(RecordTiles, aLinearFieldIsExactFromAnyRecord) {
  const Floor floor;
  std::vector<Record> records = strewn(floor, 50);
  for (Record& record : records) record.normal = {0, 1, 0};
  const RecordTiles tiles(floor.rays, records, {});
  std::uint32_t lit = 0;
  for (std::uint32_t i = 0; i < floor.receivers.size(); ++i) {
    const PixelReceiver& r = floor.receivers[i];
    const Splat splat = tiles.splat(i % kColumns, i / kColumns, r);
    if (!(splat.weight > 0.0f)) continue;
    ++lit;
    const float e = std::max(0.0f, 10.0f + 3.0f * r.positionWorld.x - 2.0f * r.positionWorld.z);
    EXPECT_NEAR(splat.reflected.x, e, 1e-3f + 1e-4f * e);
    EXPECT_NEAR(splat.reflected.z, 3.0f * e, 3e-3f + 3e-4f * e);
  }
  EXPECT_GT(lit, 100u);
}

TEST(RecordTiles, markedPixelsAreThoseThatHaveAWeight) {
  const Floor floor;
  const std::vector<Record> records = strewn(floor, 60);
  for (const int threads : {1, 2, 7}) {
    Context context;
    context.threads = threads;
    std::vector<std::uint8_t> covered(floor.receivers.size(), 0);
    markCovered(floor.rays, records, {}, floor.receivers, covered, context);
    const RecordTiles tiles(floor.rays, records, {});
    for (std::uint32_t i = 0; i < covered.size(); ++i) {
      const PixelReceiver& r = floor.receivers[i];
      const bool reached = r.normal != glm::vec3(0.0f) && tiles.splat(i % kColumns, i / kColumns, r).weight > 0.0f;
      EXPECT_EQ(covered[i] != 0, reached) << i;
    }
  }
}

// Records that agree keep their reach; of two that do not, neither reaches where they met.
TEST(LimitReaches, onlyRecordsThatContradictEachOther) {
  const Floor floor;
  Context context;
  std::vector<Record> records = strewn(floor, 200);
  for (Record& record : records) {
    record.normal = {0, 1, 0};
    record.sky = {};
  }
  // Close to the eye, where many records overlap.
  records[7].positionWorld = floor.receivers[20 * kColumns + 32].positionWorld;
  records[7].reflected = linearAt(records[7].positionWorld);
  records[8] = records[7];
  records[8].positionWorld = floor.receivers[20 * kColumns + 33].positionWorld;
  records[8].reflected = linearAt(records[8].positionWorld);
  const std::vector<Record> before = records;
  {
    const RecordTiles tiles(floor.rays, records, {});
    EXPECT_EQ(limitReaches(tiles, floor.receivers, kColumns, 0.1f, records, context), 0u);
  }
  // One record says twice the light.
  records[7].reflected.vector *= 2.0f;
  const RecordTiles tiles(floor.rays, records, {});
  EXPECT_GT(limitReaches(tiles, floor.receivers, kColumns, 0.1f, records, context), 1u);
  EXPECT_LT(records[7].limit, reachOf(before[7], {}));
  for (std::size_t k = 0; k < records.size(); ++k) {
    const float apart = glm::distance(records[k].positionWorld, records[7].positionWorld);
    if (apart > reachOf(before[k], {}) + reachOf(before[7], {})) {
      EXPECT_EQ(records[k].limit, INFINITY) << k;
    }
  }
  // What noise explains is no contradiction.
  std::vector<Record> noisy = before;
  noisy[7].reflected.vector *= 2.0f;
  for (Record& record : noisy) record.noise = 100.0f;
  const RecordTiles noisyTiles(floor.rays, noisy, {});
  EXPECT_EQ(limitReaches(noisyTiles, floor.receivers, kColumns, 0.1f, noisy, context), 0u);
}

}  // namespace
}  // namespace relume
