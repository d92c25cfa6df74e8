// SPDX-License-Identifier: MIT
// Small pieces far apart: the grid has caches between them though its points see little else than the sky, and what the
// log says of pieces that get no cache on the light map.
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/caches/room.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;
using test::fewCaches;
using test::Placed;

constexpr int kAcross = 10;
constexpr float kSize = 0.03f, kApart = 0.4f;  // [m]

// Cubes in a slanting plane, 40 cm apart.
Scene loneCubes() {
  Scene scene;
  for (int i = 0; i < kAcross * kAcross; ++i) {
    const float row = static_cast<float>(i / kAcross);
    const glm::vec3 low(kApart * static_cast<float>(i % kAcross), 0.1f * row, kApart * row);
    Mesh cube;
    addBox(cube, low, low + kSize, false);
    addInstance(scene, std::move(cube), "cube" + std::to_string(i));
  }
  return scene;
}

// What is told of where caches lie, the error last.
std::vector<std::string> messagesOf(Scene scene, const CacheOptions& options) {
  std::vector<std::string> said;
  Context context;
  context.onMessage = [&](Severity severity, std::string_view text) {
    if (severity == Severity::warning) said.emplace_back(text);
  };
  const auto tracer = RayTracer::create(scene, "avx2", context);
  EXPECT_TRUE(tracer);
  const auto space = findPlaySpace(*tracer, test::walks(1u << 14), 1, context);
  EXPECT_TRUE(space);
  if (const auto placed = placeCaches(*tracer, *space, options, 1, context); !placed)
    said.push_back(placed.error().message);
  return said;
}

std::size_t countWith(const std::vector<std::string>& said, std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(said.begin(), said.end(), [&](const std::string& s) { return s.find(text) != std::string::npos; }));
}

CacheOptions lightmapOf(std::uint32_t side, std::uint32_t gridCaches) {
  CacheOptions options = fewCaches(0);
  options.lightmapSize = side;
  options.gridCaches = gridCaches;
  return options;
}

TEST(LonePieces, TheGridHasCachesBetweenThem) {
  Placed p{loneCubes(), {}, {}, {}};
  test::place(p, fewCaches(0));
  EXPECT_GT(p.caches.count(), 100u);
  for (const glm::vec3& c : p.caches.positionWorld) {
    for (int i = 0; i < kAcross * kAcross; ++i) {
      const glm::vec3 low = p.scene.meshes[static_cast<std::size_t>(i)].position[0], from = c - low;
      EXPECT_GT(std::max({from.x - kSize, from.y - kSize, from.z - kSize, -from.x, -from.y, -from.z}), 0.0f) << i;
    }
  }
}

// A room around a corner, whose box has its middle outside, beyond walls that are two-sided: no receiver is there.
TEST(LonePieces, NoCacheLiesWhereNoReceiverIs) {
  Scene scene;
  scene.materials.emplace_back();
  scene.materials[0].doubleSided = true;
  Mesh room;
  const std::vector<glm::vec2> outline = {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 4}, {0, 4}};
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const glm::vec2 a = outline[i], b = outline[(i + 1) % outline.size()];
    test::addQuad(room, {a.x, 0, a.y}, {a.x, 2, a.y}, {b.x, 2, b.y}, {b.x, 0, b.y});
  }
  for (const float y : {0.0f, 2.0f}) {
    test::addQuad(room, {0, y, 0}, {0, y, 1}, {4, y, 1}, {4, y, 0});
    test::addQuad(room, {0, y, 1}, {0, y, 4}, {1, y, 4}, {1, y, 1});
  }
  room.material = 0;
  addInstance(scene, std::move(room), "room");
  scene.cameras = {test::cameraAt({0.5f, 1.2f, 0.5f})};
  CacheOptions options = fewCaches(0);
  options.gridResolution = {1, 1, 1};
  EXPECT_EQ(countWith(messagesOf(std::move(scene), options), "neither the grid nor the light map"), 1u);
}

TEST(LonePieces, WhatIsTooSmallReadsTheGridOrStaysDark) {
  const auto lit = messagesOf(loneCubes(), lightmapOf(16, 200)), dark = messagesOf(loneCubes(), lightmapOf(16, 0));
  EXPECT_GT(countWith(lit, "m and read the grid; "), 0u);
  EXPECT_GT(countWith(lit, "gridLit"), 0u);
  EXPECT_EQ(countWith(lit, "dark"), 0u);
  EXPECT_EQ(
      countWith(dark, "they stay dark; give --grid-caches, or ask for more light-map caches (--lightmap, now 16)"), 1u);
  EXPECT_GT(countWith(dark, "m and stay dark; "), 0u);
  EXPECT_EQ(countWith(dark, "gridLit"), 0u) << "there is no grid";
}

// The reason why there is no light map is the one that mends it.
TEST(LonePieces, TooFewCachesForAnyPieceAreNotCalledBuried) {
  CacheOptions options = fewCaches(2);
  const auto lit = messagesOf(loneCubes(), options);
  ASSERT_EQ(lit.size(), 1u);
  EXPECT_EQ(lit[0].rfind("no light map, everything reads the grid: no piece of surface is large enough for texels", 0),
            0u)
      << lit[0];
  EXPECT_NE(lit[0].find(" m: raise --lightmap-caches or "), std::string::npos) << lit[0];
  options.gridCaches = 0;
  const auto failed = messagesOf(loneCubes(), options);
  ASSERT_EQ(failed.size(), 1u);
  EXPECT_EQ(failed[0].rfind("no piece of surface is large enough for texels of ", 0), 0u) << failed[0];
}

TEST(LonePieces, FacesThatAreTurnedAwayAreCalledSo) {
  Scene scene;
  Mesh box;
  addBox(box, {-1, -1, -1}, {1, 1, 1}, false);
  addInstance(scene, std::move(box), "box");
  scene.cameras = {test::cameraAt({0, 0, 0})};
  CacheOptions options = fewCaches(100);
  options.gridCaches = 0;
  EXPECT_EQ(countWith(messagesOf(std::move(scene), options), "turn faces to the side that is seen"), 1u);
}

}  // namespace
}  // namespace relume
