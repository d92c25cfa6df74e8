// SPDX-License-Identifier: MIT
// Where surfels of emitters lie on an image: evenly, whatever the coordinates are; and what marked materials are taken
// for where they are dark.
#include "bake/surfels/surfels.h"
#include "formats/pack.h"
#include "tests/surfels/make_level.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace relume {
namespace {

// A room with a lamp, and a dark screen of 2 x 1 m with coordinates from `low` to `high`.
struct Screen {
  glm::vec2 low{0.0f}, high{1.0f};
  Wrap wrap = Wrap::clamp;
  bool drivable = true;
};

constexpr std::uint32_t kLamp = 1, kScreen = 2;

Level levelWith(const Screen& screen) {
  Level level;
  level.begin("room");
  level.addRoom({6, 3, 5});
  Material& lamp = level.begin("lamp");
  lamp.name = "lamp";
  lamp.emission = {8, 6, 4};
  level.addRectangle({1, 2.9f, 1}, {0.5f, 0, 0}, {0, 0, 0.5f});
  Material& material = level.begin("screen");
  material.name = "screen";
  material.drivable = screen.drivable;
  material.emissionTexture.wrapU = material.emissionTexture.wrapV = screen.wrap;
  level.addRectangle({2, 1, 0.1f}, {2, 0, 0}, {0, 1, 0});
  const glm::vec2 a = screen.low, c = screen.high;
  level.scene().meshes[kScreen].uv[0] = {a, {c.x, a.y}, c, a, c, {a.x, c.y}};
  return level;
}

PlacedSurfels place(const Level& level, std::uint32_t count = 6000) {
  Context context;
  const RayTracer tracer = level.tracer(context);
  SurfelOptions options;
  options.count = count;
  auto placed = placeSurfels(tracer, level.fronts(), options, 1, context);
  EXPECT_TRUE(placed) << (placed ? "" : placed.error().message);
  return std::move(*placed);
}

std::vector<glm::vec2> tapsOf(const Emitters& e, std::uint32_t material) {
  std::vector<glm::vec2> taps;
  const DrivableMaterial& m = e.materials[material];
  for (std::uint32_t i = kFootprintTaps * m.firstEntry; i < kFootprintTaps * (m.firstEntry + m.entryCount); ++i)
    taps.push_back(unpackUnorm16x2(e.tap[i]));
  return taps;
}

TEST(EmitterFootprints, nameEmittersAndMarkedMaterialsAlone) {
  const PlacedSurfels placed = place(levelWith({}));
  const Emitters& e = placed.emitters;
  ASSERT_EQ(e.materials.size(), 2u);
  EXPECT_EQ(findMaterial(e, "lamp"), 0u);
  EXPECT_EQ(findMaterial(e, "screen"), 1u);
  EXPECT_FALSE(findMaterial(e, "room"));
  EXPECT_FALSE(e.materials[0].marked || e.materials[0].textured);
  EXPECT_TRUE(e.materials[1].marked && e.materials[1].textured && e.materials[1].clampU);
  EXPECT_EQ(e.materials[1].firstEntry, e.materials[0].entryCount);
  EXPECT_EQ(e.count(), e.materials[0].entryCount + e.materials[1].entryCount);
  const std::set<std::uint32_t> once(e.surfel.begin(), e.surfel.end());
  EXPECT_EQ(once.size(), e.count());
  for (std::uint32_t i = 0; i < e.count(); ++i)
    EXPECT_EQ(placed.surfels.instance[e.surfel[i]], i < e.materials[0].entryCount ? kLamp : kScreen);
  // Without the mark, the dark screen is a wall.
  EXPECT_EQ(place(levelWith({.drivable = false})).emitters.materials.size(), 1u);
}

TEST(EmitterFootprints, bakesWithoutEmittersHaveNone) {
  Level level;
  level.begin("room");
  level.addRoom({6, 3, 5});
  const PlacedSurfels placed = place(level, 500);
  EXPECT_TRUE(placed.emitters.materials.empty() && placed.emitters.surfel.empty());
  EXPECT_TRUE(placed.bakedEmission.empty());
}

// Taps are even over the image, and each as wide as its part of it.
TEST(EmitterFootprints, coverTheImageEvenly) {
  const PlacedSurfels placed = place(levelWith({}));
  const Emitters& e = placed.emitters;
  const std::vector<glm::vec2> taps = tapsOf(e, 1);
  ASSERT_GT(taps.size(), 200u);
  for (const glm::vec2& split :
       {glm::vec2(0.5f, 1.0f), glm::vec2(1.0f, 0.5f), glm::vec2(0.25f, 1.0f), glm::vec2(1.0f, 0.8f)}) {
    const auto below =
        std::count_if(taps.begin(), taps.end(), [&](const glm::vec2& t) { return t.x <= split.x && t.y <= split.y; });
    EXPECT_NEAR(static_cast<double>(below) / static_cast<double>(taps.size()), split.x * split.y, 0.05);
  }
  double area = 0.0;
  const DrivableMaterial& m = e.materials[1];
  for (std::uint32_t i = m.firstEntry; i < m.firstEntry + m.entryCount; ++i)
    area += kFootprintTaps * double{e.tapWidth[i]} * double{e.tapWidth[i]};
  EXPECT_NEAR(area, 1.0, 0.15);
  // Near their surfels.
  for (std::uint32_t i = 0; i < m.entryCount; ++i) {
    const glm::vec3 p = placed.surfels.positionWorld[e.surfel[m.firstEntry + i]];
    for (std::uint32_t k = 0; k < kFootprintTaps; ++k) {
      const glm::vec2 tap = taps[kFootprintTaps * i + k];
      EXPECT_LT(glm::length(glm::vec2(2.0f * tap.x + 2.0f, tap.y + 1.0f) - glm::vec2(p)), 0.2f);
    }
  }
}

// A cell across the seam of a repeated image has taps on both of its ends, none in between.
TEST(EmitterFootprints, repeatedAndMirroredImagesAreFolded) {
  const std::vector<glm::vec2> repeated = tapsOf(place(levelWith({{-0.5f, 0}, {1.5f, 1}, Wrap::repeat})).emitters, 1);
  const std::vector<glm::vec2> mirrored = tapsOf(place(levelWith({{-0.5f, 0}, {1.5f, 1}, Wrap::mirror})).emitters, 1);
  for (const auto* taps : {&repeated, &mirrored}) {
    for (const float end : {0.25f, 0.5f, 0.75f}) {
      const auto below = std::count_if(taps->begin(), taps->end(), [&](const glm::vec2& t) { return t.x <= end; });
      EXPECT_NEAR(static_cast<double>(below) / static_cast<double>(taps->size()), end, 0.04);
    }
  }
}

// Clusters and links reckon with a marked screen as with an emitter; the bake says that it is dark.
TEST(EmitterFootprints, markedMaterialsShineUntilTheBakeIsDone) {
  const PlacedSurfels placed = place(levelWith({}));
  const Emitters& e = placed.emitters;
  ASSERT_EQ(placed.bakedEmission.size(), placed.surfels.count());
  double power[2] = {0, 0};
  for (std::uint32_t i = 0; i < e.count(); ++i) {
    const bool screen = i >= e.materials[1].firstEntry;
    const glm::vec3 shining = placed.surfels.emission[e.surfel[i]], baked = placed.bakedEmission[e.surfel[i]];
    EXPECT_GT(shining.x, 0.0f);
    EXPECT_LE(shining.x, 8.0f);
    EXPECT_EQ(baked, screen ? glm::vec3(0.0f) : shining);
    power[screen] +=
        (screen ? 2.0 : 0.25) * double{shining.x + shining.y + shining.z} / (3.0 * e.materials[screen].entryCount);
  }
  EXPECT_NEAR(power[1], power[0], 0.2 * power[0]);
}

}  // namespace
}  // namespace relume
