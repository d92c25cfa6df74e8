// SPDX-License-Identifier: MIT
// Caches of small scenes with known answers: on surfaces, in free space, on the side that is seen.
#include "bake/caches/caches.h"
#include "bake/caches/receivers_in_sight.h"
#include "bake/import/find_solids.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/caches/reads.h"
#include "tests/caches/room.h"

#include <gtest/gtest.h>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cstring>
#include <random>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;
using test::addQuad;
using test::addTriangle;
using test::cameraAt;
using test::fewCaches;
using test::kHalfThickness;
using test::kRoomHigh;
using test::kRoomLow;
using test::kWall;
using test::place;
using test::Placed;
using test::readLightmap;
using test::roomScene;
using test::walledRoomScene;

std::uint32_t gridCount(const Caches& caches) {
  return static_cast<std::uint32_t>(std::count(caches.normal.begin(), caches.normal.end(), glm::vec3(0.0f)));
}

TEST(PlaceCaches, RoomHasItsCachesOnTheWallsLookingIn) {
  Placed p{roomScene(), {}, {}, {}};
  place(p, fewCaches(1000));
  const std::uint32_t grid = gridCount(p.caches);
  EXPECT_GT(grid, 100u);
  EXPECT_NEAR(static_cast<double>(p.caches.count() - grid), 1000.0, 50.0);
  for (std::uint32_t c = 0; c < p.caches.count(); ++c) {
    const glm::vec3 x = p.caches.positionWorld[c], n = p.caches.normal[c];
    const glm::vec3 low = x - kRoomLow, high = kRoomHigh - x;
    const float off = std::min({low.x, low.y, low.z, high.x, high.y, high.z});
    EXPECT_GT(off, 0.0f);
    if (c < grid) {
      EXPECT_EQ(n, glm::vec3(0.0f)) << "grid first";
      continue;
    }
    EXPECT_LT(off, 0.011f) << "on a wall";
    EXPECT_GT(glm::dot(n, glm::vec3(0, 1.5f, 0) - x), 0.0f);
    EXPECT_NEAR(glm::length(n), 1.0f, 1e-4);
  }
}

// Interpolating the caches' own positions must give the point that is read: the test of texel centres, corners,
// packing.
TEST(PlaceCaches, ReadsInterpolateBetweenCachesAroundThePoint) {
  Placed p{roomScene(), {}, {}, {}};
  place(p, fewCaches(1000));
  const float texel = std::sqrt(108.0f / 1000.0f);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  double error = 0.0;
  int count = 0;
  for (std::uint32_t t = 0; t < 12; ++t) {
    for (int k = 0; k < 400; ++k) {
      glm::vec2 w(uniform(random), uniform(random));
      if (w.x + w.y > 1.0f) w = 1.0f - w;
      const auto c = p.scene.corners(p.scene.instances[0], t);
      const glm::vec3 x = c[0] + (c[1] - c[0]) * w.x + (c[2] - c[0]) * w.y;
      const auto read = readLightmap(p.caches, 0, t, w, false);
      ASSERT_FALSE(read.gridLit);
      EXPECT_EQ(read.unfilled, 0.0f);
      EXPECT_LT(glm::distance(read.position, x), 1.1f * texel);
      error += glm::distance(read.position, x);
      ++count;
    }
  }
  EXPECT_LT(error / count, 0.12 * texel);
  EXPECT_TRUE(p.caches.lightmap.backCornerUv.empty()) << "nobody sees the room from outside";
}

TEST(PlaceCaches, MirroredAndScaledInstancesReadTheSameWay) {
  Placed p;
  p.scene = roomScene();
  Mesh unit = p.scene.meshes[0];
  for (glm::vec3& v : unit.position) v *= 100.0f;
  p.scene.meshes.clear();
  p.scene.instances.clear();
  addInstance(p.scene, unit, "mirrored", glm::scale(glm::mat4(1.0f), glm::vec3(-0.01f, 0.01f, 0.02f)));
  place(p, fewCaches(1000));
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0.0f, 0.5f);
  for (std::uint32_t t = 0; t < 12; ++t) {
    const glm::vec2 w(uniform(random), uniform(random));
    const auto c = p.scene.corners(p.scene.instances[0], t);
    // Corners in the world are wound for the front: 1 and 2 trade places.
    const glm::vec3 x = c[0] + (c[1] - c[0]) * w.y + (c[2] - c[0]) * w.x;
    const auto read = readLightmap(p.caches, 0, t, w, false);
    ASSERT_FALSE(read.gridLit);
    EXPECT_LT(glm::distance(read.position, x), 0.35f);
    EXPECT_GT(glm::dot(read.normal, geometricNormal(p.scene, {0, t, {0.3f, 0.3f}})), 0.9f);
  }
}

TEST(PlaceCaches, BothSidesOfACurtainHaveTheirOwnCaches) {
  Placed p{roomScene(), {}, {}, {}};
  Mesh curtain;
  addQuad(curtain, {-1, 0.5f, 0}, {1, 0.5f, 0}, {1, 2.5f, 0}, {-1, 2.5f, 0});
  p.scene.materials.emplace_back();
  p.scene.materials[0].doubleSided = true;
  curtain.material = 0;
  const std::uint32_t instance = addInstance(p.scene, std::move(curtain), "curtain");
  place(p, fewCaches(1000));
  ASSERT_FALSE(p.caches.lightmap.backCornerUv.empty());
  for (std::uint32_t t = 0; t < 2; ++t) {
    const auto front = readLightmap(p.caches, instance, t, {0.2f, 0.5f}, false),
               back = readLightmap(p.caches, instance, t, {0.2f, 0.5f}, true);
    ASSERT_FALSE(front.gridLit);
    ASSERT_FALSE(back.gridLit);
    EXPECT_NEAR(front.normal.z, 1.0f, 1e-3);
    EXPECT_NEAR(back.normal.z, -1.0f, 1e-3);
    EXPECT_GT(front.position.z, 0.0f);
    EXPECT_LT(back.position.z, 0.0f);
    EXPECT_NEAR(front.position.x, back.position.x, 0.05f);
  }
}

// A room of six slabs that run into each other at its edges, as an exporter that marks every material as two-sided
// writes it.
Scene kitScene(bool twoSided) {
  constexpr float t = 0.2f;
  Scene scene;
  scene.name = "kit";
  scene.materials.emplace_back();
  scene.materials[0].doubleSided = twoSided;
  const auto slab = [&](const char* node, const glm::vec3& low, const glm::vec3& high) {
    Mesh mesh;
    addBox(mesh, low, high, false);
    mesh.material = 0;
    addInstance(scene, std::move(mesh), node);
  };
  slab("floor", {-t, -t, -t}, {4 + t, 0, 4 + t});
  slab("ceiling", {-t, 3, -t}, {4 + t, 3 + t, 4 + t});
  slab("left", {-t, -t, -t}, {0, 3 + t, 4 + t});
  slab("right", {4, -t, -t}, {4 + t, 3 + t, 4 + t});
  slab("far", {-t, -t, -t}, {4 + t, 3 + t, 0});
  slab("near", {-t, -t, 4}, {4 + t, 3 + t, 4 + t});
  scene.cameras = {test::cameraAt({3.2f, 1.6f, 3.2f})};
  return scene;
}

// Corners of a room are not darkened by caches in the joints between its pieces.
TEST(PlaceCaches, ClosedTwoSidedPiecesAreSolid) {
  Placed oneSided{kitScene(false), {}, {}, {}}, sheets{kitScene(true), {}, {}, {}}, solid{kitScene(true), {}, {}, {}};
  Context context;
  findSolids(solid.scene, context);
  for (Placed* p : {&oneSided, &sheets, &solid}) place(*p, fewCaches(1000));
  const auto inJoints = [](const Placed& p) {
    return std::count_if(p.caches.positionWorld.begin(), p.caches.positionWorld.end(), [](const glm::vec3& c) {
      return glm::any(glm::lessThan(c, glm::vec3(0.0f))) || glm::any(glm::greaterThan(c, glm::vec3(4, 3, 4)));
    });
  };
  EXPECT_EQ(inJoints(solid), 0);
  EXPECT_GT(inJoints(sheets), 0) << "nothing is shown";
  EXPECT_EQ(solid.caches.positionWorld.toVector(), oneSided.caches.positionWorld.toVector());
  EXPECT_EQ(solid.caches.lightmap.cache.toVector(), oneSided.caches.lightmap.cache.toVector());
  EXPECT_EQ(solid.caches.lightmap.cornerUv.toVector(), oneSided.caches.lightmap.cornerUv.toVector());
}

// A two-sided room that faces inward, or one that faces outward with the camera inside, is lit inside.
TEST(PlaceCaches, TwoSidedRoomsAreLitInside) {
  for (const bool inward : {true, false}) {
    Placed p{{}, {}, {}, {}};
    p.scene.materials.emplace_back();
    p.scene.materials[0].doubleSided = true;
    Mesh room;
    addBox(room, kRoomLow, kRoomHigh, inward);
    room.material = 0;
    addInstance(p.scene, std::move(room), "room");
    p.scene.cameras = {test::cameraAt({0.1f, 1.4f, 2.2f})};
    Context context;
    findSolids(p.scene, context);
    EXPECT_TRUE(p.scene.bothSides(p.scene.instances[0], 0));
    place(p, fewCaches(500));
    for (std::uint32_t t = 0; t < p.scene.triangleCount(); ++t) {
      const auto read = readLightmap(p.caches, 0, t, {0.3f, 0.3f}, !inward);
      EXPECT_FALSE(read.gridLit) << t;
    }
  }
}

// A heap of leaves, each far smaller than a texel, shares caches; hardly any leaf is left to the grid.
TEST(PlaceCaches, TinyTrianglesShareCachesNearBy) {
  Placed p{roomScene(), {}, {}, {}};
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  Mesh leaves;
  for (int i = 0; i < 20000; ++i) {
    const glm::vec3 c = glm::vec3(0, 1, 0) + 0.6f * glm::vec3(uniform(random), uniform(random), uniform(random));
    const glm::vec3 a = glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)) + 1e-3f) * 0.01f;
    const glm::vec3 b =
        glm::normalize(glm::cross(a, glm::vec3(uniform(random), uniform(random), uniform(random)) + 1e-3f)) * 0.01f;
    addTriangle(leaves, c - a, c + a, c + b);
  }
  p.scene.materials.emplace_back();
  p.scene.materials[0].doubleSided = true;
  leaves.material = 0;
  const std::uint32_t instance = addInstance(p.scene, std::move(leaves), "leaves");
  place(p, fewCaches(1500));
  EXPECT_NEAR(static_cast<double>(p.caches.count() - gridCount(p.caches)), 1500.0, 75.0);
  int lit = 0, seen = 0;
  const std::uint32_t first = p.scene.instances[instance].firstTriangle;
  for (std::uint32_t t = 0; t < 20000; ++t) {
    if (!(p.playSpace.seenArea[2 * (first + t)] > 0.0f)) continue;
    ++seen;
    const auto read = readLightmap(p.caches, instance, t, {0.3f, 0.3f}, false);
    if (read.gridLit) continue;
    ++lit;
    const SurfacePoint middle{instance, t, {0.3f, 0.3f}};
    const auto c = p.scene.corners(p.scene.instances[instance], t);
    ASSERT_NE(read.nearest, kNoCache);
    EXPECT_LT(glm::distance(p.caches.positionWorld[read.nearest], (c[0] + c[1] + c[2]) / 3.0f), 2.0f);
    EXPECT_GT(glm::dot(p.caches.normal[read.nearest], geometricNormal(p.scene, middle)), 0.39f);
  }
  EXPECT_GT(seen, 5000);
  EXPECT_GT(lit, seen * 8 / 10);
}

// Pebbles on both sides of a thin wall: sharing must not reach through.
TEST(PlaceCaches, NothingIsSharedThroughAWall) {
  Placed p{roomScene(), {}, {}, {}};
  Mesh wall;
  addBox(wall, {-2, 0, -0.05f}, {2, 3, 0.05f}, false);
  addInstance(p.scene, std::move(wall), "wall");
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  Mesh pebbles;
  for (int i = 0; i < 2000; ++i) {
    const float z = 0.2f * uniform(random);
    const glm::vec3 c(1.9f * uniform(random), 0.05f, z + (z < 0.0f ? -0.08f : 0.08f));
    addTriangle(pebbles, c + glm::vec3(-0.02f, 0, 0.02f), c + glm::vec3(0.02f, 0, 0.02f), c + glm::vec3(0, 0, -0.02f));
  }
  const std::uint32_t instance = addInstance(p.scene, std::move(pebbles), "pebbles");
  Camera other;
  other.toWorld = glm::translate(glm::mat4(1.0f), glm::vec3(0.1f, 1.4f, -2.2f));
  p.scene.cameras.push_back(other);
  place(p, fewCaches(600));
  int lit = 0;
  for (std::uint32_t t = 0; t < 2000; ++t) {
    const auto read = readLightmap(p.caches, instance, t, {0.3f, 0.3f}, false);
    if (read.gridLit) continue;
    ++lit;
    const auto c = p.scene.corners(p.scene.instances[instance], t);
    EXPECT_GT(p.caches.positionWorld[read.nearest].z * c[0].z, 0.0f) << "triangle " << t;
  }
  EXPECT_GT(lit, 1500);
}

TEST(PlaceCaches, DynamicMeshesAreLitByTheGrid) {
  Placed p{roomScene(), {}, {}, {}};
  Mesh box;
  addBox(box, {-0.5f, 0.5f, -0.5f}, {0.5f, 1.5f, 0.5f}, false);
  const std::uint32_t instance = addInstance(p.scene, std::move(box), "ball");
  p.scene.instances[instance].mode = BakeMode::dynamic;
  place(p, fewCaches(500));
  for (std::uint32_t t = 0; t < 12; ++t) EXPECT_TRUE(readLightmap(p.caches, instance, t, {0.3f, 0.3f}, false).gridLit);
  EXPECT_EQ(p.caches.lightmap.parts[instance].triangleCount, 12u);
}

TEST(PlaceCaches, TexelDensityOfANodeIsRespected) {
  const auto cachesOnPanel = [](float density) {
    Placed p{roomScene(), {}, {}, {}};
    Mesh panel;
    addQuad(panel, {-1, 1, -2.9f}, {1, 1, -2.9f}, {1, 2, -2.9f}, {-1, 2, -2.9f});
    const std::uint32_t instance = addInstance(p.scene, std::move(panel), "panel");
    p.scene.instances[instance].texelDensity = density;
    place(p, fewCaches(1500));
    return std::count_if(p.caches.positionWorld.begin(), p.caches.positionWorld.end(), [](const glm::vec3& x) {
      return std::abs(x.z + 2.89f) < 0.012f && std::abs(x.x) < 1.01f && std::abs(x.y - 1.5f) < 0.51f;
    });
  };
  EXPECT_GT(cachesOnPanel(3.0f), 4 * cachesOnPanel(1.0f));
}

// The search for the size of texels begins with what densities make of the surface.
TEST(PlaceCaches, DensityEverywhereIsNoDetour) {
  const auto stepsOf = [](float density) {
    Placed p{roomScene(), {}, {}, {}};
    for (Instance& instance : p.scene.instances) instance.texelDensity = density;
    Context context;
    Context::Stage stage(context, "caches");
    test::place(p, fewCaches(1000), test::walks(1u << 16), context);
    return test::figureOf(context, "search_steps");
  };
  EXPECT_GE(stepsOf(1.0f), 1.0);
  EXPECT_EQ(stepsOf(100.0f), stepsOf(1.0f));
}

TEST(PlaceCaches, AskedForSizeIsTheSizeOfTheLightMap) {
  Placed p{roomScene(), {}, {}, {}};
  CacheOptions options = fewCaches(100);
  options.lightmapSize = 64;
  place(p, options);
  EXPECT_EQ(p.caches.lightmap.width, 64u);
  EXPECT_EQ(p.caches.lightmap.height, 64u);
  EXPECT_GT(p.caches.count(), 2000u) << "most of 4096 texels are used";
}

TEST(PlaceCaches, GridAloneAndLightMapAlone) {
  Placed p{roomScene(), {}, {}, {}};
  CacheOptions options = fewCaches(0);
  options.gridResolution = {3, 4, 5};
  place(p, options);
  EXPECT_EQ(p.caches.count(), 60u);
  EXPECT_EQ(p.caches.grid.resolution, glm::uvec3(3, 4, 5));
  EXPECT_TRUE(p.caches.lightmap.cache.empty());

  options = fewCaches(300);
  options.gridCaches = 0;
  place(p, options);
  EXPECT_TRUE(p.caches.grid.cache.empty());
  EXPECT_EQ(gridCount(p.caches), 0u);
  EXPECT_GT(p.caches.count(), 280u);
}

TEST(PlaceCaches, OneThreadAndTwoGiveTheSameBytes) {
  Placed a{roomScene(), {}, {}, {}}, b{roomScene(), {}, {}, {}};
  for (Placed* p : {&a, &b}) {
    addInstance(p->scene, test::sphere(0.8f, 40, 60), "ball", glm::translate(glm::mat4(1.0f), glm::vec3(0, 1, 0)));
    place(*p, fewCaches(1200), p == &a ? 1 : 2);
  }
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
  };
  EXPECT_TRUE(same(a.caches.positionWorld, b.caches.positionWorld));
  EXPECT_TRUE(same(a.caches.normal, b.caches.normal));
  EXPECT_TRUE(same(a.caches.grid.cache, b.caches.grid.cache));
  EXPECT_TRUE(same(a.caches.lightmap.cache, b.caches.lightmap.cache));
  EXPECT_TRUE(same(a.caches.lightmap.cornerUv, b.caches.lightmap.cornerUv));
  EXPECT_TRUE(same(a.caches.lightmap.backCornerUv, b.caches.lightmap.backCornerUv));
}

TEST(PlaceCaches, SurfelsReadCachesAtTheirOwnPlace) {
  Placed p{roomScene(), {}, {}, {}};
  place(p, fewCaches(1000));
  std::vector<SurfelSeed> seeds;
  for (std::uint32_t t = 0; t < 12; ++t) {
    SurfelSeed seed;
    seed.point = {0, t, {0.25f, 0.35f}};
    const auto c = p.scene.corners(p.scene.instances[0], t);
    seed.positionWorld = c[0] * 0.4f + c[1] * 0.25f + c[2] * 0.35f;
    seed.side = 2 * t;
    seeds.push_back(seed);
    seed.side = 2 * t + 1;
    seeds.push_back(seed);
  }
  Context context;
  const auto receivers = findReceivers(*p.tracer, p.packed, seeds, context);
  ASSERT_EQ(receivers.size(), seeds.size());
  for (std::size_t i = 0; i < seeds.size(); i += 2) {
    ASSERT_NE(receivers[i], kGridReceiver);
    const glm::vec2 texel = unpackUnorm16x2(receivers[i]) * static_cast<float>(p.caches.lightmap.width);
    const std::uint32_t cache =
        p.caches.lightmap
            .cache[static_cast<std::size_t>(texel.y) * p.caches.lightmap.width + static_cast<std::size_t>(texel.x)];
    ASSERT_NE(cache, kNoCache);
    EXPECT_LT(glm::distance(p.caches.positionWorld[cache], seeds[i].positionWorld), 0.4f);
    EXPECT_EQ(receivers[i + 1], kGridReceiver) << "the outside has no light map";
  }
}

// A floor in one piece under a thin wall, whose texels lie on both sides of it.
TEST(PlaceCaches, SurfelsReadNothingBeyondAWall) {
  Placed p{walledRoomScene(), {}, {}, {}};
  place(p, fewCaches(400));
  std::vector<SurfelSeed> seeds;
  for (std::uint32_t t = 0; t < 12; ++t) {
    const auto c = p.scene.corners(p.scene.instances[0], t);
    for (float u = 0.02f; u < 1.0f; u += 0.02f) {
      for (float v = 0.02f; u + v < 1.0f; v += 0.02f) {
        SurfelSeed seed;
        seed.point = {0, t, {u, v}};
        seed.positionWorld = c[0] * (1.0f - u - v) + c[1] * u + c[2] * v;
        seed.normal = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
        seed.side = 2 * t;
        if (std::abs(seed.positionWorld.x - kWall) > kHalfThickness) seeds.push_back(seed);
      }
    }
  }
  Context context;
  auto receivers = findReceivers(*p.tracer, p.packed, seeds, context);
  const auto readBeyond = [&] {
    int beyond = 0;
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      if (receivers[i] == kGridReceiver) continue;
      test::forEachRead(p.caches.lightmap, unpackUnorm16x2(receivers[i]), [&](std::uint32_t cache, float weight) {
        if (cache == kNoCache || weight < 0.01f) return;
        beyond += (p.caches.positionWorld[cache].x < kWall) != (seeds[i].positionWorld.x < kWall) ? 1 : 0;
      });
    }
    return beyond;
  };
  ASSERT_GT(readBeyond(), 100) << "or nothing is tested";
  const std::vector<std::uint32_t> before = receivers;
  keepReceiversInSight(*p.tracer, p.packed, seeds, receivers, context);
  EXPECT_EQ(readBeyond(), 0);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const bool away = std::abs(seeds[i].positionWorld.x - kWall) > 2.0f;
    EXPECT_TRUE(!away || receivers[i] == before[i]) << "texels away from the wall";
  }
}

TEST(PlaceCaches, CancelledWorkSaysSo) {
  Placed p{roomScene(), {}, {}, {}};
  place(p, fewCaches(100));
  Context context;
  context.cancel();
  const auto caches = placeCaches(*p.tracer, p.playSpace, fewCaches(100), 1, context);
  ASSERT_FALSE(caches);
  EXPECT_EQ(caches.error().code, ErrorCode::failed);
}

TEST(PlaceCaches, NoValidCacheAnywhereIsAnError) {
  Placed p{roomScene(), {}, {}, {}};
  place(p, fewCaches(100));
  CacheOptions options;
  options.gridCaches = 0;
  options.lightmapCaches = 0;
  Context context;
  EXPECT_FALSE(placeCaches(*p.tracer, p.playSpace, options, 1, context));
}

}  // namespace
}  // namespace relume
