// SPDX-License-Identifier: MIT
// Placement of surfels: equal areas, spacing, sides, emitters, progressive order, determinism.
#include "bake/import/find_solids.h"
#include "bake/surfels/surfels.h"
#include "formats/color.h"
#include "tests/surfels/make_level.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace relume {
namespace {

using Placement = SurfelOptions::Placement;
constexpr Placement kPlacements[] = {Placement::halton, Placement::relaxed, Placement::eliminated};

SurfelOptions optionsFor(Placement placement, std::uint32_t count) {
  SurfelOptions options;
  options.placement = placement;
  options.count = count;
  return options;
}

Level room() {
  Level level;
  level.begin("room");
  level.addRoom({8, 3, 5});
  return level;
}

template <class T>
bool sameBytes(const Array<T>& a, const Array<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

// Distance from each point to the nearest of the others on the same side of the same plane.
std::vector<double> nearestDistances(std::span<const SurfelSeed> seeds) {
  std::vector<double> nearest(seeds.size(), 1e30);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    for (std::size_t j = 0; j < seeds.size(); ++j) {
      if (i == j || glm::dot(seeds[i].normal, seeds[j].normal) < 0.99f) continue;
      const glm::vec3 apart = seeds[i].positionWorld - seeds[j].positionWorld;
      if (std::fabs(glm::dot(apart, seeds[i].normal)) > 1e-3f) continue;
      nearest[i] = std::min<double>(nearest[i], glm::length(apart));
    }
  }
  return nearest;
}

TEST(PlaceSurfels, areasSumToWhatIsSeen) {
  Context context;
  Level level = room();
  const RayTracer tracer = level.tracer(context);
  for (const Placement placement : kPlacements) {
    for (const std::uint32_t count : {2u, 100u, 5000u}) {
      const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(placement, count), 1, context);
      ASSERT_TRUE(placed);
      const double area = 2.0 * (8 * 3 + 8 * 5 + 3 * 5);
      EXPECT_EQ(placed->surfels.count(), count);
      EXPECT_NEAR(placed->surfels.areaEach * static_cast<double>(count), area, 1e-3 * area);
      EXPECT_LE(placed->statistics.areaError, 1e-3f);
      EXPECT_NEAR(placed->statistics.areaSeen, area, 1e-3);
    }
  }
}

TEST(PlaceSurfels, everyWallGetsItsShare) {
  Context context;
  Level level = room();
  const RayTracer tracer = level.tracer(context);
  for (const Placement placement : kPlacements) {
    const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(placement, 8000), 1, context);
    ASSERT_TRUE(placed);
    std::vector<double> area(6, 0.0);
    for (const SurfelSeed& seed : placed->seeds) area[seed.side / 4] += placed->surfels.areaEach;
    const double expected[] = {40, 40, 24, 24, 15, 15};
    for (int wall = 0; wall < 6; ++wall) EXPECT_NEAR(area[wall], expected[wall], 0.06 * expected[wall]) << wall;
  }
}

TEST(PlaceSurfels, surfelsLieOnTheirTriangleAndFaceItsSide) {
  Context context;
  Level level = room();
  level.begin("tilted");
  level.addRectangle({2, 1, 2}, {1, 0.3f, 0}, {0, 0.5f, 1});
  const RayTracer tracer = level.tracer(context);
  for (const Placement placement : kPlacements) {
    const auto placed = placeSurfels(tracer, level.bothSides(), optionsFor(placement, 3000), 1, context);
    ASSERT_TRUE(placed);
    for (std::uint32_t i = 0; i < placed->surfels.count(); ++i) {
      const SurfelSeed& seed = placed->seeds[i];
      EXPECT_EQ(placed->surfels.positionWorld[i], seed.positionWorld);
      EXPECT_EQ(placed->surfels.normal[i], seed.normal);
      EXPECT_EQ(placed->surfels.instance[i], seed.point.instance);
      EXPECT_EQ(placed->surfels.receiver[i], kGridReceiver);
      const Instance& instance = level.scene().instances[seed.point.instance];
      EXPECT_EQ(seed.side / 2, instance.firstTriangle + seed.point.triangle);
      const glm::vec2 b = seed.point.barycentric;
      EXPECT_TRUE(b.x >= 0 && b.y >= 0 && b.x + b.y <= 1.0001f);
      const auto c = level.scene().corners(instance, seed.point.triangle);
      EXPECT_LT(glm::length(c[0] + b.x * (c[1] - c[0]) + b.y * (c[2] - c[0]) - seed.positionWorld), 1e-4f);
      const glm::vec3 front = geometricNormal(level.scene(), seed.point);
      EXPECT_LT(glm::length(seed.normal - (seed.side % 2 == 0 ? front : -front)), 1e-6f);
    }
  }
}

// A plane whose corners have the normals of a dome.
TEST(PlaceSurfels, smoothSurfacesAreLitByTheirShadingNormals) {
  Context context;
  Level level = room();
  level.begin("dome");
  level.addRectangle({2, 1, 2}, {0, 0, 1}, {1, 0, 0});
  Mesh& dome = level.scene().meshes.back();
  for (const glm::vec3& p : dome.position) dome.normal.push_back(glm::normalize(p - glm::vec3(2.5f, 0.5f, 2.5f)));
  const RayTracer tracer = level.tracer(context);
  const auto placed = placeSurfels(tracer, level.bothSides(), optionsFor(Placement::eliminated, 3000), 1, context);
  ASSERT_TRUE(placed);
  const std::vector<glm::vec3> lit = litNormals(level.scene(), placed->seeds, context);
  ASSERT_EQ(lit.size(), placed->seeds.size());
  std::array<int, 2> onDome = {};
  for (std::size_t i = 0; i < lit.size(); ++i) {
    const SurfelSeed& seed = placed->seeds[i];
    if (seed.point.instance + 1 < level.scene().instances.size()) {
      EXPECT_EQ(lit[i], seed.normal) << "the room's meshes have no normals";
      continue;
    }
    ++onDome[seed.side % 2];
    const glm::vec3 up = (seed.side % 2 == 0 ? 1.0f : -1.0f) * lit[i];
    EXPECT_NEAR(glm::length(up), 1.0f, 1e-5f);
    // Interpolated on the plane, the dome's normals point away from below its middle.
    const glm::vec3 expected = glm::normalize(seed.positionWorld - glm::vec3(2.5f, 0.5f, 2.5f));
    EXPECT_LT(glm::length(up - expected), 1e-4f);
  }
  EXPECT_GT(onDome[0], 5);
  EXPECT_GT(onDome[1], 5);
}

TEST(PlaceSurfels, bothSidesOfAThinWallHaveTheirOwn) {
  Context context;
  Level level;
  level.begin("wall");
  level.addRectangle({0, 0, 0}, {4, 0, 0}, {0, 3, 0});
  const RayTracer tracer = level.tracer(context);
  for (const Placement placement : kPlacements) {
    const auto placed = placeSurfels(tracer, level.bothSides(), optionsFor(placement, 1000), 1, context);
    ASSERT_TRUE(placed);
    int front = 0;
    for (const glm::vec3& n : placed->surfels.normal) {
      EXPECT_NEAR(std::fabs(n.z), 1.0f, 1e-6f);
      front += n.z > 0.0f ? 1 : 0;
    }
    EXPECT_NEAR(front, 500, 25);
    EXPECT_NEAR(placed->surfels.areaEach * 1000.0, 24.0, 0.024);
  }
}

TEST(PlaceSurfels, nothingOnSidesThatAreNotSeen) {
  Context context;
  Level level = room();
  const RayTracer tracer = level.tracer(context);
  const PlaySpace floorOnly = level.playSpace([](std::uint32_t side) { return side == 0 || side == 2; });
  for (const Placement placement : kPlacements) {
    const auto placed = placeSurfels(tracer, floorOnly, optionsFor(placement, 500), 1, context);
    ASSERT_TRUE(placed);
    for (const SurfelSeed& seed : placed->seeds) EXPECT_TRUE(seed.side == 0 || seed.side == 2);
  }
}

TEST(PlaceSurfels, eliminationSpreadsBestAndRelaxationBeatsHalton) {
  Context context;
  Level level;
  level.begin("floor");
  level.addRectangle({0, 0, 0}, {0, 0, 10}, {10, 0, 0});
  const RayTracer tracer = level.tracer(context);
  std::vector<float> min, cv;
  for (const Placement placement : kPlacements) {
    const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(placement, 3000), 1, context);
    ASSERT_TRUE(placed);
    const auto& s = placed->statistics;
    min.push_back(s.spacingMin / s.spacingDensest);
    cv.push_back(s.spacingCv);
    // The statistics are those of the surfels.
    const std::vector<double> nearest = nearestDistances(placed->seeds);
    EXPECT_NEAR(*std::min_element(nearest.begin(), nearest.end()), s.spacingMin, 1e-5);
    double mean = 0.0;
    for (const double d : nearest) mean += d / 3000.0;
    EXPECT_NEAR(mean, s.spacingMean, 1e-4);
    // To a step of the ladder.
    const double densest = std::sqrt(2.0 / std::sqrt(3.0) * 100.0 / 3000.0);
    EXPECT_NEAR(s.spacingDensest, densest, 0.023 * densest);
  }
  EXPECT_LT(cv[1], 0.8f * cv[0]);
  EXPECT_LT(cv[2], 0.12f);
  EXPECT_GT(min[2], 0.62f);
}

TEST(PlaceSurfels, anyPrefixOfEliminatedIsWellSpread) {
  Context context;
  Level level;
  level.begin("floor");
  level.addRectangle({0, 0, 0}, {0, 0, 10}, {10, 0, 0});
  const RayTracer tracer = level.tracer(context);
  const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(Placement::eliminated, 4096), 1, context);
  ASSERT_TRUE(placed);
  for (const std::size_t prefix : {64u, 200u, 700u, 1024u, 3000u}) {
    const std::vector<double> nearest = nearestDistances(std::span(placed->seeds).first(prefix));
    const double densest = std::sqrt(2.0 / std::sqrt(3.0) * 100.0 / static_cast<double>(prefix));
    EXPECT_GT(*std::min_element(nearest.begin(), nearest.end()), 0.45 * densest) << prefix;
    // Every quadrant has its share.
    int quadrant[4] = {};
    for (std::size_t i = 0; i < prefix; ++i) {
      const glm::vec3& p = placed->seeds[i].positionWorld;
      ++quadrant[(p.x > 5 ? 1 : 0) + (p.z > 5 ? 2 : 0)];
    }
    for (const int n : quadrant) EXPECT_NEAR(n, prefix / 4.0, 2.0 + 0.08 * static_cast<double>(prefix)) << prefix;
  }
}

TEST(PlaceSurfels, trianglesTooSmallAccumulate) {
  // 400 scattered triangles of 1/16 surfel's area each, beside a floor of the same area in one piece.
  Context context;
  Level level;
  level.begin("crumbs");
  const float size = 0.1f;
  for (int i = 0; i < 400; ++i) {
    const glm::vec3 at(static_cast<float>(i % 20), 5.0f, static_cast<float>(i / 20));
    level.addTriangle(at, at + glm::vec3(0, 0, size), at + glm::vec3(size, 0, 0));
  }
  level.begin("floor");
  level.addRectangle({0, 0, 0}, {0, 0, 2}, {1, 0, 0});
  const RayTracer tracer = level.tracer(context);
  for (const Placement placement : kPlacements) {
    const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(placement, 50), 1, context);
    ASSERT_TRUE(placed);
    const auto crumbs = std::count(placed->surfels.instance.begin(), placed->surfels.instance.end(), 0u);
    EXPECT_NEAR(static_cast<double>(crumbs), 25.0, 3.0) << static_cast<int>(placement);
  }
}

TEST(PlaceSurfels, footprintsAverageAlbedo) {
  // A checkered image far finer than the surfels: all of them are grey, none black or white.
  Context context;
  Level level;
  Material& material = level.begin("floor");
  material.albedo = glm::vec3(1.0f);
  material.albedoTexture.image = 0;
  Image image;
  image.levels.push_back({2, 2, {255, 255, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255, 255}});
  const auto grey = static_cast<std::uint8_t>(std::lround(255.0f * linearToSrgb(0.5f)));
  image.levels.push_back({1, 1, {grey, grey, grey, 255}});
  level.scene().images.push_back(image);
  level.addRectangle({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  level.scene().meshes[0].uv[0] = {{0, 0}, {0, 400}, {400, 400}, {0, 0}, {400, 400}, {400, 0}};
  const RayTracer tracer = level.tracer(context);
  const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(Placement::eliminated, 200), 1, context);
  ASSERT_TRUE(placed);
  for (const glm::vec3& a : placed->surfels.albedo) EXPECT_NEAR(a.x, 0.5f, 0.02f);
}

// A room with an emitting square of 0.2 m a side under its ceiling.
Level roomWithLamp(bool doubleSided) {
  Level level = room();
  Material& lamp = level.begin("lamp");
  lamp.emission = glm::vec3(10, 8, 6);
  lamp.doubleSided = doubleSided;
  level.addRectangle({4, 2.9f, 2}, {0.2f, 0, 0}, {0, 0, 0.2f});
  return level;
}

TEST(PlaceSurfels, smallEmittersGetSurfelsOfTheirOwnAndKeepTheirRadiance) {
  Context context;
  for (const Placement placement : kPlacements) {
    Level level = roomWithLamp(false);
    const RayTracer tracer = level.tracer(context);
    const auto placed = placeSurfels(tracer, level.bothSides(), optionsFor(placement, 2000), 1, context);
    ASSERT_TRUE(placed);
    int emitters = 0;
    for (std::uint32_t i = 0; i < placed->surfels.count(); ++i) {
      const glm::vec3& e = placed->surfels.emission[i];
      if (e == glm::vec3(0.0f)) continue;
      ++emitters;
      EXPECT_EQ(placed->surfels.instance[i], 1u);
      EXPECT_EQ(placed->seeds[i].side % 2, 0u);
      EXPECT_LT(glm::length(e - glm::vec3(10, 8, 6)), 1e-4f);
    }
    EXPECT_GE(emitters, 12);
    EXPECT_LE(emitters, 24);
    // Every ray to the lamp finds its radiance, none to its back or to the walls does.
    for (std::uint32_t side = 0; side < 2 * level.scene().triangleCount(); ++side) {
      for (const glm::vec2& b : {glm::vec2(0.01f, 0.02f), glm::vec2(0.3f, 0.3f), glm::vec2(0.9f, 0.05f)}) {
        const std::uint32_t surfel = placed->map.at(side, b);
        if (surfel == kNone) continue;
        const bool lamp = side >= 24 && side % 2 == 0;
        EXPECT_EQ(placed->surfels.emission[surfel] != glm::vec3(0.0f), lamp) << side;
      }
    }
    EXPECT_NE(placed->map.at(24, {0.3f, 0.3f}), kNone);
    EXPECT_NE(placed->map.at(26, {0.3f, 0.3f}), kNone);
  }
}

TEST(PlaceSurfels, doubleSidedEmittersEmitFromBothSides) {
  Context context;
  Level level = roomWithLamp(true);
  const RayTracer tracer = level.tracer(context);
  const auto placed = placeSurfels(tracer, level.bothSides(), optionsFor(Placement::eliminated, 2000), 1, context);
  ASSERT_TRUE(placed);
  int side[2] = {};
  for (std::uint32_t i = 0; i < placed->surfels.count(); ++i) {
    if (placed->surfels.emission[i] != glm::vec3(0.0f)) ++side[placed->seeds[i].side % 2];
  }
  EXPECT_GE(side[0], 4);
  EXPECT_GE(side[1], 4);
}

TEST(PlaceSurfels, closedDoubleSidedEmittersEmitOutward) {
  Context context;
  Level level = room();
  Material& lamp = level.begin("lamp");
  lamp.emission = glm::vec3(10, 8, 6);
  lamp.doubleSided = true;
  const std::uint32_t first = level.scene().triangleCount();
  const glm::vec3 low(4, 2, 2), high(4.25f, 2.25f, 2.25f), x(0.25f, 0, 0), y(0, 0.25f, 0), z(0, 0, 0.25f);
  for (const auto& [u, v] : {std::pair(x, y), std::pair(y, z), std::pair(z, x)}) {
    level.addRectangle(low, v, u);
    level.addRectangle(high - u - v, u, v);
  }
  for (std::uint32_t i = 0; i < level.scene().instances.size(); ++i) level.scene().instances[i].nodeIndex = i;
  level.scene().cameras.emplace_back();  // at the origin
  findSolids(level.scene(), context);
  const auto lampOf = static_cast<std::uint32_t>(level.scene().instances.size() - 1);
  for (std::uint32_t t = first; t < level.scene().triangleCount(); ++t) {
    EXPECT_EQ(emitterOf(level.scene(), lampOf, 2 * t), lampOf);
    EXPECT_EQ(emitterOf(level.scene(), lampOf, 2 * t + 1), kReflector);
  }
}

TEST(PlaceSurfels, texturedEmittersKeepTheirMeanRadiance) {
  // Emission in the left half of the image only.
  Context context;
  Level level;
  Material& material = level.begin("screen");
  material.emission = glm::vec3(4.0f);
  material.emissionTexture.image = 0;
  material.emissionTexture.nearest = true;
  Image image;
  image.levels.push_back({2, 1, {255, 255, 255, 255, 0, 0, 0, 255}});
  level.scene().images.push_back(image);
  level.addRectangle({0, 0, 0}, {0, 2, 0}, {0, 0, 2});
  level.scene().meshes[0].uv[0] = {{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}};
  const RayTracer tracer = level.tracer(context);
  const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(Placement::eliminated, 150), 1, context);
  ASSERT_TRUE(placed);
  double power = 0.0;
  for (const glm::vec3& e : placed->surfels.emission) power += static_cast<double>(e.x) * placed->surfels.areaEach;
  EXPECT_NEAR(power, 4.0 * 2.0, 0.06 * 8.0);
}

TEST(PlaceSurfels, alphaMasksLeaveHoles) {
  // The right half of the image is cut out.
  Context context;
  for (const Placement placement : kPlacements) {
    Level level;
    Material& material = level.begin("leaf");
    material.alphaMode = AlphaMode::mask;
    material.albedoTexture.image = 0;
    material.albedoTexture.nearest = true;
    Image image;
    image.levels.push_back({2, 1, {255, 255, 255, 255, 255, 255, 255, 0}});
    level.scene().images.push_back(image);
    level.addRectangle({0, 0, 0}, {0, 2, 0}, {0, 0, 2});
    level.scene().meshes[0].uv[0] = {{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}};
    const RayTracer tracer = level.tracer(context);
    const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(placement, 400), 1, context);
    ASSERT_TRUE(placed);
    EXPECT_EQ(placed->surfels.count(), 400u);
    EXPECT_NEAR(placed->surfels.areaEach * 400.0, 2.0, 0.1);
    if (placement == Placement::relaxed) continue;
    for (const SurfelSeed& seed : placed->seeds) EXPECT_TRUE(opaqueAt(level.scene(), seed.point));
  }
}

TEST(PlaceSurfels, masksThatCutOutEverythingAreRefused) {
  Context context;
  Level level;
  Material& material = level.begin("ghost");
  material.alphaMode = AlphaMode::mask;
  material.alpha = 0.0f;
  level.addRectangle({0, 0, 0}, {0, 2, 0}, {0, 0, 2});
  const RayTracer tracer = level.tracer(context);
  const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(Placement::eliminated, 8192), 1, context);
  ASSERT_FALSE(placed);
  EXPECT_NE(placed.error().message.find("alpha masks"), std::string::npos) << placed.error().message;
}

TEST(PlaceSurfels, threadCountDoesNotChangeTheBytes) {
  Level level = roomWithLamp(false);
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const RayTracer tracer = level.tracer(one);
  const PlaySpace space = level.bothSides();
  for (const Placement placement : kPlacements) {
    const auto a = placeSurfels(tracer, space, optionsFor(placement, 6000), 7, one);
    const auto b = placeSurfels(tracer, space, optionsFor(placement, 6000), 7, two);
    ASSERT_TRUE(a && b);
    EXPECT_TRUE(sameBytes(a->surfels.positionWorld, b->surfels.positionWorld));
    EXPECT_TRUE(sameBytes(a->surfels.normal, b->surfels.normal));
    EXPECT_TRUE(sameBytes(a->surfels.albedo, b->surfels.albedo));
    EXPECT_TRUE(sameBytes(a->surfels.emission, b->surfels.emission));
    EXPECT_EQ(a->map.tile, b->map.tile);
    EXPECT_TRUE(a->map.sides == b->map.sides);
    const auto c = placeSurfels(tracer, space, optionsFor(placement, 6000), 8, one);
    ASSERT_TRUE(c);
    EXPECT_FALSE(sameBytes(a->surfels.positionWorld, c->surfels.positionWorld));
  }
}

TEST(PlaceSurfels, refusesBadInput) {
  Context context;
  Level level = room();
  const RayTracer tracer = level.tracer(context);
  for (const std::uint32_t count : {0u, 1u, 1000000000u}) {
    EXPECT_EQ(placeSurfels(tracer, level.fronts(), optionsFor(Placement::halton, count), 1, context).error().code,
              ErrorCode::usage);
  }
  SurfelOptions options = optionsFor(Placement::eliminated, 100);
  options.candidateFactor = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(placeSurfels(tracer, level.fronts(), options, 1, context).error().code, ErrorCode::usage);
  const PlaySpace blind = level.playSpace([](std::uint32_t) { return false; });
  EXPECT_EQ(placeSurfels(tracer, blind, optionsFor(Placement::halton, 100), 1, context).error().code,
            ErrorCode::failed);
  EXPECT_EQ(placeSurfels(tracer, PlaySpace{}, optionsFor(Placement::halton, 100), 1, context).error().code,
            ErrorCode::failed);
}

TEST(PlaceSurfels, stopsWhenCancelled) {
  Level level = room();
  Context context;
  const RayTracer tracer = level.tracer(context);
  context.onProgress = [](std::string_view, double) { return false; };
  for (const Placement placement : {Placement::relaxed, Placement::eliminated}) {
    Context cancelled;
    cancelled.onProgress = context.onProgress;
    const auto placed = placeSurfels(tracer, level.fronts(), optionsFor(placement, 5000), 1, cancelled);
    ASSERT_FALSE(placed);
    EXPECT_EQ(placed.error().message, "cancelled");
  }
}

}  // namespace
}  // namespace relume
