// SPDX-License-Identifier: MIT
// The map from hits to surfels, against looking at all surfels.
#include "bake/surfels/surfel_map.h"
#include "bake/base/random.h"
#include "bake/surfels/map_cost.h"
#include "tests/surfels/make_level.h"

#include <cmath>

namespace relume {
namespace {

std::uint32_t bruteForce(const SurfaceSample& point, std::span<const SurfaceSample> surfels, float spacing,
                         float reach) {
  float best = kNoMapping;
  std::uint32_t found = kNone;
  for (std::uint32_t i = 0; i < surfels.size(); ++i) {
    if (glm::length(surfels[i].positionWorld - point.positionWorld) > reach) continue;
    const float cost = mapCost(mapPoint(point), mapPoint(surfels[i]), spacing, reach);
    if (cost < best) best = cost, found = i;
  }
  return found;
}

TEST(SurfelMap, smallTrianglesMapToTheBestSurfelOfTheirCentre) {
  // Triangles of a tile each, at all angles.
  Level level;
  level.begin("crumbs");
  for (std::uint64_t i = 0; i < 600; ++i) {
    RandomStream r(1, 1, i);
    const auto small = [&] { return 0.1f * glm::vec3(r.uniform() - 0.5f, r.uniform() - 0.5f, r.uniform() - 0.5f); };
    const glm::vec3 at(4.0f * r.uniform(), 2.0f * r.uniform(), 4.0f * r.uniform());
    level.addTriangle(at, at + small(), at + small());
    if (i == 300) level.begin("more");
  }
  const PlaySpace space = level.bothSides();
  const std::vector<SurfaceSample> surfels = scatter(level, space, 300);
  const float spacing = 0.4f;
  Context context;
  const SurfelMap map = buildSurfelMap(level.scene(), space, surfels, spacing, context);
  int mapped = 0;
  for (std::uint32_t side = 0; side < 2 * level.scene().triangleCount(); ++side) {
    const SurfaceSample point = sampleOf(level.scene(), side, glm::vec2(1.0f / 3.0f));
    const std::uint32_t expected = bruteForce(point, surfels, spacing, kSeenReach * spacing);
    EXPECT_EQ(map.at(side, {0.2f, 0.5f}), expected) << side;
    mapped += expected != kNone ? 1 : 0;
  }
  EXPECT_GT(mapped, 1100);
}

TEST(SurfelMap, largeTrianglesMapEveryPointToASurfelAboutAsNearAsTheNearest) {
  Level level;
  level.begin("room");
  level.addRoom({6, 3, 4});
  const PlaySpace space = level.fronts();
  const std::vector<SurfaceSample> surfels = scatter(level, space, 2000);
  const float spacing = std::sqrt(2.0f / std::sqrt(3.0f) * 108.0f / 2000.0f);
  Context context;
  const SurfelMap map = buildSurfelMap(level.scene(), space, surfels, spacing, context);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    RandomStream r(1, 1, i);
    const std::uint32_t side = 2 * r.below(level.scene().triangleCount());
    glm::vec2 b = r.uniform2();
    if (b.x + b.y > 1.0f) b = glm::vec2(1.0f) - b;
    const std::uint32_t surfel = map.at(side, b);
    ASSERT_NE(surfel, kNone);
    const SurfaceSample point = sampleOf(level.scene(), side, b);
    EXPECT_GT(glm::dot(point.normal, surfels[surfel].normal), 0.9f);
    const std::uint32_t best = bruteForce(point, surfels, spacing, 1e30f);
    const auto distance = [&](std::uint32_t s) { return glm::length(surfels[s].positionWorld - point.positionWorld); };
    EXPECT_LE(distance(surfel), distance(best) + 0.75f * spacing);
  }
}

TEST(SurfelMap, edgesAndCornersOfTheTriangleAreCovered) {
  Level level;
  level.begin("floor");
  level.addTriangle({0, 0, 0}, {0, 0, 7}, {3, 0, 0});
  level.addTriangle({0, 0, 0}, {3, 0, 0}, {1, 0, -9});
  const PlaySpace space = level.fronts();
  const std::vector<SurfaceSample> surfels = scatter(level, space, 700);
  Context context;
  const SurfelMap map = buildSurfelMap(level.scene(), space, surfels, 0.2f, context);
  for (const std::uint32_t side : {0u, 2u}) {
    for (int i = 0; i <= 1000; ++i) {
      const float t = static_cast<float>(i) / 1000.0f;
      EXPECT_NE(map.at(side, {t, 1.0f - t}), kNone) << t;
      EXPECT_NE(map.at(side, {t, 0.0f}), kNone) << t;
      EXPECT_NE(map.at(side, {0.0f, t}), kNone) << t;
    }
    EXPECT_NE(map.at(side, {-1e-6f, 1.000001f}), kNone);
  }
}

TEST(SurfelMap, hitsDoNotCrossAOneCentimetreGap) {
  // Two layers 1 cm apart whose surfels are 20 cm apart.
  Level level;
  level.begin("lower");
  level.addRectangle({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  level.begin("upper");
  level.addRectangle({0, 0.01f, 0}, {0, 0, 4}, {4, 0, 0});
  const PlaySpace space = level.bothSides();
  const std::vector<SurfaceSample> surfels = scatter(level, space, 1600);
  Context context;
  const SurfelMap map = buildSurfelMap(level.scene(), space, surfels, 0.2f, context);
  int crossed = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    RandomStream r(2, 1, i);
    const std::uint32_t side = r.below(8);
    glm::vec2 b = r.uniform2();
    if (b.x + b.y > 1.0f) b = glm::vec2(1.0f) - b;
    const std::uint32_t surfel = map.at(side, b);
    ASSERT_NE(surfel, kNone);
    EXPECT_EQ(surfels[surfel].side % 2, side % 2);
    crossed += surfels[surfel].point.instance != side / 4 ? 1 : 0;
  }
  EXPECT_LT(crossed, 40);
}

TEST(SurfelMap, sidesThatAreSearchedForWhenAskedAnswerAsInTheWholeMap) {
  // Crumbs and an emitter, far from the origin; of some sides nothing is seen, or only from far away.
  Level level;
  constexpr glm::vec3 kOffset(1000.0f, -50.0f, 3.0f);
  for (std::uint64_t i = 0; i < 2000; ++i) {
    if (i % 500 == 0) level.begin("crumbs");
    RandomStream r(4, 1, i);
    const auto small = [&] { return 0.1f * glm::vec3(r.uniform() - 0.5f, r.uniform() - 0.5f, r.uniform() - 0.5f); };
    const glm::vec3 at = kOffset + glm::vec3(4.0f * r.uniform(), 2.0f * r.uniform(), 4.0f * r.uniform());
    level.addTriangle(at, at + small(), i % 50 == 0 ? at : at + small());
  }
  level.begin("floor");
  level.addRectangle(kOffset, {0, 0, 4}, {4, 0, 0});
  level.begin("lamp").emission = glm::vec3(1.0f);
  level.addTriangle(kOffset + glm::vec3(0, 1, 0), kOffset + glm::vec3(0.1f, 1, 0), kOffset + glm::vec3(0, 1, 0.1f));
  PlaySpace space = level.playSpace([](std::uint32_t side) { return side % 3 != 0; });
  std::vector<float> farShare(space.seenArea.size(), 0.0f);
  for (std::size_t side = 3000; side < 4000; ++side) farShare[side] = space.seenArea[side] > 0.0f ? 0.01f : 0.0f;
  space.farShare = std::span<const float>(farShare);
  std::vector<SurfaceSample> surfels = scatter(level, space, 600);
  Context context;
  const SurfelMap whole = buildSurfelMap(level.scene(), space, surfels, 0.5f, context),
                  asked = buildSurfelMap(level.scene(), space, surfels, 0.5f, context, 1.0);
  EXPECT_EQ(whole.onDemand, nullptr);
  ASSERT_NE(asked.onDemand, nullptr);
  EXPECT_LT(asked.tile.size(), whole.tile.size() / 2);
  int mapped = 0, searched = 0;
  for (int round = 0; round < 2; ++round) {
    for (std::uint32_t side = 0; side < 2 * level.scene().triangleCount(); ++side) {
      ASSERT_EQ(asked.at(side, {0.2f, 0.5f}), whole.at(side, {0.2f, 0.5f})) << side;
      mapped += whole.at(side, {0.2f, 0.5f}) != kNone ? 1 : 0;
      searched += asked.sides[side].isOnDemand() ? 1 : 0;
    }
  }
  EXPECT_EQ(searched, 2 * 4000);
  EXPECT_GT(mapped, 4000);
}

TEST(SurfelMap, unseenSidesMapOnlyToSurfelsNearby) {
  Level level;
  level.begin("seen");
  level.addRectangle({0, 0, 0}, {0, 0, 2}, {2, 0, 0});
  level.begin("near");
  level.addRectangle({2, 0, 0}, {0, 0, 2}, {0.2f, 0, 0});
  level.begin("far");
  level.addRectangle({20, 0, 0}, {0, 0, 2}, {2, 0, 0});
  const PlaySpace space = level.playSpace([](std::uint32_t side) { return side == 0 || side == 2; });
  const std::vector<SurfaceSample> surfels = scatter(level, space, 400);
  Context context;
  const SurfelMap map = buildSurfelMap(level.scene(), space, surfels, 0.1f, context);
  EXPECT_NE(map.at(4, {0.3f, 0.3f}), kNone);
  EXPECT_EQ(map.at(5, {0.3f, 0.3f}), kNone);
  EXPECT_EQ(map.at(8, {0.3f, 0.3f}), kNone);
  EXPECT_EQ(map.at(1, {0.3f, 0.3f}), kNone);
}

TEST(SurfelMap, hugeTrianglesAndSliversStaySmall) {
  Level level;
  level.begin("plane");
  level.addTriangle({-1e5f, 0, -1e5f}, {0, 0, 1e5f}, {1e5f, 0, -1e5f});
  level.begin("sliver");
  for (int i = 0; i < 100; ++i) {
    const auto x = static_cast<float>(i);
    level.addTriangle({x, 1, 0}, {x + 0.001f, 1, 500}, {x, 1, 1000});
  }
  PlaySpace space = level.bothSides();
  space.seenArea.set(0, 10.0f);
  space.seenArea.set(1, 0.0f);
  std::vector<SurfaceSample> surfels;
  for (std::uint32_t side = 2; side < 202; ++side) surfels.push_back(sampleOf(level.scene(), side, {0.3f, 0.3f}));
  Context context;
  const SurfelMap map = buildSurfelMap(level.scene(), space, surfels, 0.1f, context);
  EXPECT_LT(map.sizeBytes(), 10u << 20);
}

}  // namespace
}  // namespace relume
