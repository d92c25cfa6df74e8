// SPDX-License-Identifier: MIT
// Records that are relit: under other lights they are what rays would gather there.
#include "bake/preview/leaf_records.h"

#include "bake/base/random.h"
#include "relume/bake/context.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr std::uint32_t kSide = 24;  // leaves along a side of a wall, 6 walls
constexpr std::uint32_t kLeaves = 6 * kSide * kSide;

// A room with an open window, and a leaf for each square of its walls. There is none on the block within.
struct Room {
  Scene scene;
  std::optional<RayTracer> tracer;
  Sky sky;
  std::vector<PixelReceiver> receivers;

  Room() {
    addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, true));
    addInstance(scene, box({0.2f, -1, 0.2f}, {0.6f, 0.1f, 0.7f}, false));
    // A wall is its two triangles: without them there is a window.
    scene.meshes[0].triangle.resize(scene.meshes[0].triangle.size() - 2);
    finish(scene);
    Context context;
    auto made = RayTracer::create(scene, "avx2", context, RayStructure::bundles);
    EXPECT_TRUE(made);
    tracer.emplace(std::move(*made));
    sky.radiance = {0.3f, 0.2f, 0.1f};
    RandomStream random(3, 0, 0);
    for (int i = 0; i < 64; ++i) {
      const glm::vec2 at = random.uniform2();
      const glm::vec3 n = glm::normalize(glm::vec3(random.uniform2() - 0.5f, 1.0f));
      receivers.push_back({{0.9f * at.x - 0.8f, -0.9f + 0.1f * random.uniform(), 1.6f * at.y - 0.8f},
                           {n.x, n.z, n.y},
                           {0, 1, 0},
                           0.01f});
    }
  }

  static std::uint32_t leafAt(const Ray& ray, const Hit& hit) {
    if (hit.instance != 0) return kNone;
    const glm::vec3 p = ray.origin + hit.distance * ray.direction, size = glm::abs(p);
    const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    const auto square = [](float v) {
      return static_cast<std::uint32_t>(std::clamp(0.5f * (v + 1.0f) * kSide, 0.0f, kSide - 1.0f));
    };
    const auto wall = static_cast<std::uint32_t>(2 * axis + (p[axis] > 0.0f ? 1 : 0));
    return (wall * kSide + square(p[(axis + 1) % 3])) * kSide + square(p[(axis + 2) % 3]);
  }
  static void leavesOf(std::span<const Ray> rays, std::span<const Hit> hits, std::span<std::uint32_t> leaf) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i]) leaf[i] = leafAt(rays[i], hits[i]);
    }
  }
};

// Smooth light with patches of sun in it.
std::vector<glm::vec3> lightNumber(std::uint64_t number) {
  std::vector<glm::vec3> radiance(kLeaves);
  RandomStream random(number, 1, 0);
  for (std::uint32_t i = 0; i < kLeaves; ++i) {
    const auto wall = static_cast<float>(i / (kSide * kSide) + number), t = static_cast<float>(i % kSide) / kSide;
    radiance[i] = glm::vec3(0.5f + 0.4f * std::sin(wall), 0.5f + 0.4f * t, 0.6f - 0.5f * t);
    if (random.uniform() < 0.02f) radiance[i] += glm::vec3(20.0f, 15.0f, 10.0f);
  }
  return radiance;
}

std::vector<std::uint32_t> all(const std::vector<PixelReceiver>& receivers) {
  std::vector<std::uint32_t> chosen(receivers.size());
  std::iota(chosen.begin(), chosen.end(), 0u);
  return chosen;
}

LeafRecords::Options leavesOfRays(std::uint32_t rays) { return {rays, 5}; }

void expectNear(const glm::mat3& a, const glm::mat3& b, float allowed) {
  for (int c = 0; c < 3; ++c) EXPECT_LE(glm::distance(a[c], b[c]), allowed);
}

// Root of the sum of squared differences over that of squares.
struct Difference {
  double square = 0.0, sum = 0.0;
  void add(const glm::vec3& truth, const glm::vec3& found) {
    square += glm::dot(found - truth, found - truth);
    sum += glm::dot(truth, truth);
  }
  double relative() const { return std::sqrt(square / sum); }
};

TEST(LeafRecords, relitTheyAreWhatRaysGatherInTheNewLight) {
  const Room room;
  for (const std::uint32_t rays : {256u, 1024u, 4096u}) {
    Context context;
    LeafRecords records(*room.tracer, Room::leavesOf, room.sky, leavesOfRays(rays));
    records.relight(lightNumber(1), context);
    records.gather(room.receivers, all(room.receivers), context);
    for (const std::uint64_t number : {2u, 3u}) {
      const std::vector<glm::vec3> radiance = lightNumber(number);
      records.relight(radiance, context);
      const HitRadiance light = [&radiance](std::uint64_t, float, std::span<const Ray> r, std::span<const Hit> hits,
                                            std::span<glm::vec3> found) {
        for (std::size_t i = 0; i < r.size(); ++i) {
          const std::uint32_t leaf = hits[i] ? Room::leafAt(r[i], hits[i]) : kNone;
          if (leaf != kNone) found[i] = radiance[leaf];
        }
      };
      RecordGatherer::Options options;
      options.rays = rays;
      options.seed = 5;
      options.secondLook = false;
      const RecordGatherer gatherer(*room.tracer, light, room.sky, options);
      RecordGatherer::Scratch scratch;
      Difference irradiance, vector, gradient;
      for (std::uint32_t k = 0; k < records.records().size(); ++k) {
        const Record truth = gatherer.gather(room.receivers[k], k, scratch), &r = records.records()[k];
        const float e = glm::length(truth.normal * truth.reflected.vector);
        ASSERT_GT(e, 0.1f);
        irradiance.add(truth.normal * truth.reflected.vector, r.normal * r.reflected.vector);
        for (int c = 0; c < 3; ++c) {
          vector.add(truth.reflected.vector[c], r.reflected.vector[c]);
          gradient.add(truth.reflected.gradient[c], r.reflected.gradient[c]);
        }
        // Whole numbers of 16 bits: no record is far off either.
        expectNear(r.reflected.vector, truth.reflected.vector, 2e-4f * e);
        expectNear(r.reflected.gradient, truth.reflected.gradient, 5e-4f * e / truth.distance);
        EXPECT_NEAR(r.noise, truth.noise, 1e-4f * e);
        EXPECT_NEAR(r.distance, truth.distance, 1e-3f * truth.distance);
        EXPECT_EQ(r.nearest, truth.nearest);
        expectNear(r.sky.vector, truth.sky.vector, 1e-12f);
      }
      EXPECT_LT(irradiance.relative(), 1e-4);
      EXPECT_LT(vector.relative(), 1e-4);
      EXPECT_LT(gradient.relative(), 1e-4);
    }
  }
}

TEST(LeafRecords, lightAddsUp) {
  const Room room;
  Context context;
  LeafRecords records(*room.tracer, Room::leavesOf, room.sky, leavesOfRays(1024));
  records.gather(room.receivers, all(room.receivers), context);
  for (const Record& r : records.records()) EXPECT_EQ(r.reflected.vector, glm::mat3(0.0f)) << "no light yet";
  const auto vectorsIn = [&](const std::vector<glm::vec3>& radiance) {
    records.relight(radiance, context);
    std::vector<glm::mat3> vectors;
    for (const Record& r : records.records()) vectors.push_back(r.reflected.vector);
    return vectors;
  };
  const std::vector<glm::vec3> a = lightNumber(1), b = lightNumber(2);
  std::vector<glm::vec3> both = a;
  for (std::uint32_t i = 0; i < kLeaves; ++i) both[i] = 2.0f * a[i] + 3.0f * b[i];
  const auto byA = vectorsIn(a), byB = vectorsIn(b), byBoth = vectorsIn(both);
  for (std::size_t k = 0; k < byA.size(); ++k)
    expectNear(byBoth[k], 2.0f * byA[k] + 3.0f * byB[k], 1e-5f * glm::length(byBoth[k][0]) + 1e-12f);
  // A table that ends before the leaves do.
  for (const glm::mat3& dark : vectorsIn({})) EXPECT_EQ(dark, glm::mat3(0.0f));
}

TEST(LeafRecords, sameBytesAtAnyNumberOfThreads) {
  const Room room;
  const auto made = [&](int threads) {
    Context context;
    context.threads = threads;
    LeafRecords records(*room.tracer, Room::leavesOf, room.sky, leavesOfRays(1024));
    records.gather(room.receivers, all(room.receivers), context);
    records.relight(lightNumber(4), context);
    return records.records();
  };
  const std::vector<Record> one = made(1);
  for (const int threads : {2, 7}) {
    const std::vector<Record> more = made(threads);
    ASSERT_EQ(more.size(), one.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      EXPECT_EQ(more[k].reflected.vector, one[k].reflected.vector);
      EXPECT_EQ(more[k].reflected.gradient, one[k].reflected.gradient);
      EXPECT_EQ(more[k].distance, one[k].distance);
      EXPECT_EQ(more[k].noise, one[k].noise);
    }
  }
}

TEST(LeafRecords, thoseThatAreKeptGoOnBeingRelit) {
  const Room room;
  Context context;
  LeafRecords records(*room.tracer, Room::leavesOf, room.sky, leavesOfRays(256));
  records.gather(room.receivers, all(room.receivers), context);
  const std::size_t before = records.sizeBytes();
  records.relight(lightNumber(6), context);
  const std::vector<Record> whole = records.records();
  std::vector<std::uint8_t> marks(whole.size());
  for (std::size_t k = 0; k < marks.size(); ++k) marks[k] = k % 3 == 1 ? 1 : 0;
  records.keep(marks);
  records.relight({}, context);
  records.relight(lightNumber(6), context);
  ASSERT_EQ(records.records().size(), whole.size() / 3);
  for (std::size_t k = 0; k < records.records().size(); ++k)
    EXPECT_EQ(records.records()[k].reflected.vector, whole[3 * k + 1].reflected.vector);
  EXPECT_LT(records.sizeBytes(), before);
  EXPECT_LT(records.terms(), std::size_t{256} * records.records().size());
}

TEST(LeafRecords, aCancelledGatherLeavesThoseOfBefore) {
  const Room room;
  Context context;
  LeafRecords records(*room.tracer, Room::leavesOf, room.sky, leavesOfRays(256));
  records.gather(room.receivers, std::vector<std::uint32_t>{0, 1, 2}, context);
  context.cancel();
  records.gather(room.receivers, all(room.receivers), context);
  EXPECT_EQ(records.records().size(), 3u);
}

}  // namespace
}  // namespace relume
