// SPDX-License-Identifier: MIT
// The photon grid in uniform light, where irradiance is pi times radiance, and against traced paths.
#include "tests/reference/photon_grid.h"

#include "bake/base/random.h"
#include "tests/measure/traced_light.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kPi = kPathPi;
const glm::vec3 kLow(-1.0f, 0.0f, 0.5f), kHigh(1.0f, 1.5f, 3.5f);
const glm::uvec3 kPoints(5, 4, 6);

// Uniform radiance 1 in the box: ways from everywhere on its sides, by cosine, to where they leave it.
PhotonGrid furnace(PhotonEstimator estimator, std::uint64_t ways) {
  PhotonGrid grid(kLow, kHigh, kPoints, estimator);
  const glm::vec3 size = kHigh - kLow;
  const float sides[] = {size.y * size.z, size.x * size.z, size.x * size.y};
  for (std::uint64_t i = 0; i < ways; ++i) {
    RandomStream random(3, 1, i);
    const auto side = static_cast<int>(i % 6);
    const int a = side / 2;
    glm::vec3 from = kLow + size * glm::vec3(random.uniform(), random.uniform(), random.uniform()), n(0.0f);
    from[a] = side % 2 == 0 ? kLow[a] : kHigh[a];
    n[a] = side % 2 == 0 ? 1.0f : -1.0f;
    const glm::vec3 d = cosineDirection(n, random.uniform2());
    float distance = 1e9f;
    for (int b = 0; b < 3; ++b) {
      if (d[b] == 0.0f || (b == a)) continue;
      distance = std::min(distance, ((d[b] > 0.0f ? kHigh[b] : kLow[b]) - from[b]) / d[b]);
    }
    if (d[a] != 0.0f) distance = std::min(distance, size[a] / std::abs(d[a]));
    grid.addWay(from, from + distance * d, glm::vec3(6.0f * kPi * sides[a] / static_cast<float>(ways)));
  }
  return grid;
}

// Irradiance at the six axes in the mean over the points of the lattice's inside, or of its border.
double meanAtAxes(const PhotonGrid& grid, bool border) {
  double sum = 0.0, count = 0.0;
  for (std::uint32_t z = 0; z < kPoints.z; ++z) {
    for (std::uint32_t y = 0; y < kPoints.y; ++y) {
      for (std::uint32_t x = 0; x < kPoints.x; ++x) {
        const bool outer = x == 0 || y == 0 || z == 0 || x + 1 == kPoints.x || y + 1 == kPoints.y || z + 1 == kPoints.z;
        if (outer != border) continue;
        const SixVectors& green = grid.at({x, y, z})[1];
        for (std::size_t half = 0; half < 6; ++half) {
          const int a = static_cast<int>(half / 2);
          sum += static_cast<double>(half % 2 == 0 ? green[half][a] : -green[half][a]);
          count += 1.0;
        }
      }
    }
  }
  return sum / count;
}

TEST(PhotonGrid, borderPointsHaveHalfOfAFaceAndCornersAQuarter) {
  const PhotonGrid grid(kLow, kHigh, kPoints, PhotonEstimator::printed);
  const float whole = 0.5f * 0.6f;  // a face across x: 1.5 / 3 by 3 / 5
  EXPECT_NEAR(grid.faceArea({2, 1, 1}, 0), whole, 1e-6f);
  EXPECT_NEAR(grid.faceArea({0, 1, 1}, 0), whole, 1e-6f);
  EXPECT_NEAR(grid.faceArea({2, 0, 1}, 0), 0.5f * whole, 1e-6f);
  EXPECT_NEAR(grid.faceArea({2, 1, 5}, 0), 0.5f * whole, 1e-6f);
  EXPECT_NEAR(grid.faceArea({2, 3, 0}, 0), 0.25f * whole, 1e-6f);
  const float volume = 0.5f * whole;
  EXPECT_NEAR(grid.cellVolume({2, 1, 1}), volume, 1e-6f);
  EXPECT_NEAR(grid.cellVolume({0, 1, 1}), 0.5f * volume, 1e-6f);
  EXPECT_NEAR(grid.cellVolume({0, 1, 5}), 0.25f * volume, 1e-6f);
  EXPECT_NEAR(grid.cellVolume({4, 3, 0}), 0.125f * volume, 1e-6f);
}

TEST(PhotonGrid, uniformLightIsPiButForThePrintWhichHasTwoThirdsOfIt) {
  constexpr std::uint64_t kWays = 400000;
  const double pi = static_cast<double>(kPi);
  for (const bool border : {false, true}) {
    EXPECT_NEAR(meanAtAxes(furnace(PhotonEstimator::printed, kWays), border), 2.0 / 3.0 * pi, 0.01 * pi) << border;
    EXPECT_NEAR(meanAtAxes(furnace(PhotonEstimator::corrected, kWays), border), pi, 0.01 * pi) << border;
    EXPECT_NEAR(meanAtAxes(furnace(PhotonEstimator::length, kWays), border), pi, 0.01 * pi) << border;
  }
}

// Between the points and for normals off the axes, by both reads.
TEST(PhotonGrid, uniformLightIsReadAnywhere) {
  const PhotonGrid grid = furnace(PhotonEstimator::length, 2000000);
  for (std::uint64_t i = 0; i < 200; ++i) {
    RandomStream random(5, 1, i);
    const glm::vec3 n = sphereDirection(random.uniform2());
    const glm::vec3 p = kLow + (kHigh - kLow) * glm::vec3(random.uniform(), random.uniform(), random.uniform());
    EXPECT_NEAR(grid.irradiance(p, n, false).y, kPi, 0.05f * kPi) << i;
    EXPECT_NEAR(grid.irradiance(p, n, true).y, kPi, 0.04f * kPi) << i;
  }
}

struct Room {
  Scene scene;
  std::unique_ptr<RayTracer> tracer;
};

Room roomOf(float albedo, float emission, bool pillar) {
  Room room;
  const std::uint32_t material = addMaterial(room.scene, glm::vec3(albedo), glm::vec3(emission));
  addInstance(room.scene, box(kLow, kHigh, true, material));
  if (pillar) {
    const std::uint32_t grey = addMaterial(room.scene, glm::vec3(0.5f));
    addInstance(room.scene, box({0.3f, 0.0f, 1.0f}, {0.6f, 0.9f, 1.4f}, false, grey));
  }
  finish(room.scene);
  return room;
}

void makeTracer(Room& room) {
  Context context;
  auto tracer = RayTracer::create(room.scene, "avx2", context);
  ASSERT_TRUE(tracer);
  room.tracer = std::make_unique<RayTracer>(std::move(*tracer));
}

// Walls of radiance 1 and albedo one half: what is reflected has radiance 1 as well.
TEST(PhotonGrid, aFurnaceReflectsWhatItEmits) {
  Room room = roomOf(0.5f, 1.0f, false);
  makeTracer(room);
  const EmittingTriangles emitters(room.scene);
  Context context;
  for (const PhotonEstimator estimator : {PhotonEstimator::corrected, PhotonEstimator::length}) {
    PhotonGrid grid(kLow, kHigh, kPoints, estimator);
    tracePhotons(*room.tracer, {{}, &emitters}, 400000, 1, grid, context);
    EXPECT_NEAR(meanAtAxes(grid, false), static_cast<double>(kPi), 0.015 * static_cast<double>(kPi));
  }
}

TEST(PhotonGrid, lightsOfEveryKindAreWhatPathsFind) {
  Room room = roomOf(0.6f, 0.0f, true);
  makeTracer(room);
  SceneLight light;
  light.intensity = {2.0f, 1.0f, 0.5f};
  light.positionWorld = {-0.4f, 1.1f, 1.5f};
  light.direction = glm::normalize(glm::vec3(0.3f, -1.0f, 0.4f));
  light.innerConeRad = 0.3f;
  light.outerConeRad = 0.7f;
  for (const LightKind kind : {LightKind::point, LightKind::spot}) {
    light.kind = kind;
    Context context;
    PhotonGrid grid(kLow, kHigh, {17, 13, 25}, PhotonEstimator::length);
    tracePhotons(*room.tracer, {{&light, 1}, nullptr}, 1500000, 2, grid, context);
    const TracedLevel level{room.scene, *room.tracer, {light}};
    for (std::uint64_t i = 0; i < 6; ++i) {
      TracedReceiver r{{-0.3f, 0.8f, 2.2f}, glm::vec3(0.0f), {}};
      r.normal[static_cast<int>(i / 2)] = i % 2 == 0 ? 1.0f : -1.0f;
      RandomStream random(9, 2, i);
      traceIrradiance(level, 20000, random, r);
      const glm::vec3 found = grid.irradiance(r.position, r.normal, false);
      EXPECT_NEAR(found.x, r.truth().x, 0.06f * r.truth().x) << static_cast<int>(kind) << " " << i;
      EXPECT_NEAR(found.z, r.truth().z, 0.06f * r.truth().z) << static_cast<int>(kind) << " " << i;
    }
  }
}

// A sun through a room's open top is what paths find, too; and threads change nothing.
TEST(PhotonGrid, theSunIsWhatPathsFindAtAnyNumberOfThreads) {
  Room room;
  const std::uint32_t grey = addMaterial(room.scene, glm::vec3(0.6f));
  addInstance(room.scene, quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, grey));
  addInstance(room.scene, quad({-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, grey));
  finish(room.scene);
  makeTracer(room);
  SceneLight sun;
  sun.kind = LightKind::directional;
  sun.intensity = {3.0f, 2.0f, 1.0f};
  sun.direction = glm::normalize(glm::vec3(0.2f, -1.0f, -0.6f));
  const auto trace = [&](int threads) {
    Context context;
    context.threads = threads;
    PhotonGrid grid({-2, 0, -2}, {2, 3, 2}, {17, 13, 17}, PhotonEstimator::length);
    tracePhotons(*room.tracer, {{&sun, 1}, nullptr}, 1000000, 2, grid, context);
    return grid;
  };
  const PhotonGrid grid = trace(1);
  const TracedLevel level{room.scene, *room.tracer, {sun}};
  for (const glm::vec3& n : {glm::vec3(0, -1, 0), glm::vec3(0, 0, -1)}) {
    TracedReceiver r{{0.2f, 1.2f, 0.3f}, n, {}};
    RandomStream random(9, 3, 0);
    traceIrradiance(level, 40000, random, r);
    const glm::vec3 found = grid.irradiance(r.position, r.normal, false);
    EXPECT_NEAR(found.x, r.truth().x, 0.06f * r.truth().x);
  }
  for (const int threads : {2, 7}) {
    const PhotonGrid same = trace(threads);
    for (std::uint32_t x = 0; x < 17; ++x)
      EXPECT_EQ(std::memcmp(&grid.at({x, 6, 8}), &same.at({x, 6, 8}), sizeof(PhotonGrid::Vectors)), 0) << x;
  }
}

}  // namespace
}  // namespace relume
