// SPDX-License-Identifier: MIT
// Materials that a frame drives, on the CPU: against light that is handed over for each surfel, images against their
// means, what is refused, and that frames allocate nothing.
#include "relume/relighter.h"
#include "runtime/shared/image_pyramid.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/driven_bake.h"
#include "tests/runtime/some_lights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace relume {
namespace {

using test::kPanel, test::kScreen;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

const Bake& bakeOfRoom() {
  static const Bake bake = test::makeDrivenBake({.surfels = 3000, .lightmapCaches = 60, .linksPerCache = 48});
  return bake;
}

Relighter make(const Bake& bake, std::vector<DrivenImage> images = {}) {
  RelightOptions options;
  options.drivenImages = std::move(images);
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

// Radiosity of a material's leaves, by entry.
std::vector<glm::vec3> lit(const Relighter& relighter, const Bake& bake, std::uint32_t material) {
  const std::vector<glm::vec3> nodes = relighter.nodeRadiosity();
  const DrivableMaterial& m = bake.emitters.materials[material];
  std::vector<glm::vec3> result;
  for (std::uint32_t e = m.firstEntry; e < m.firstEntry + m.entryCount; ++e)
    result.push_back(nodes[bake.hierarchy.leafNode[bake.emitters.surfel[e]]]);
  return result;
}

glm::vec3 meanOf(const std::vector<glm::vec3>& values) {
  const glm::dvec3 sum = std::accumulate(values.begin(), values.end(), glm::dvec3(0.0),
                                         [](const glm::dvec3& a, const glm::vec3& b) { return a + glm::dvec3(b); });
  return glm::vec3(sum / static_cast<double>(values.size()));
}

TEST(ImagePyramid, everyLevelHasTheMeanOfTheImage) {
  for (const glm::uvec2& size : {glm::uvec2(1, 1), glm::uvec2(8, 8), glm::uvec2(7, 5), glm::uvec2(13, 1),
                                 glm::uvec2(1, 6), glm::uvec2(33, 20), glm::uvec2(100, 63)}) {
    ImagePyramid pyramid(size.x, size.y, std::pmr::new_delete_resource());
    const std::vector<glm::vec3> image = test::makeStripes(size.x, size.y);
    pyramid.set(image, {});
    const glm::vec3 mean = meanOf(image);
    EXPECT_EQ(pyramid.size(pyramid.levels() - 1), glm::uvec2(1, 1));
    for (std::uint32_t level = 0; level < pyramid.levels(); ++level) {
      const auto texels = pyramid.texels(level);
      const glm::vec3 found = meanOf({texels.begin(), texels.end()});
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], mean[c], 1e-5f) << size.x << " x " << size.y << ", " << level;
    }
    const glm::vec3 whole = pyramid.sample({0.3f, 0.9f}, 99.0f, false, true);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(whole[c], mean[c], 1e-5f);
  }
}

TEST(ImagePyramid, edgesAreContinuedOrRepeated) {
  ImagePyramid pyramid(2, 1, std::pmr::new_delete_resource());
  const std::vector<glm::vec3> image = {glm::vec3(1.0f), glm::vec3(3.0f)};
  pyramid.set(image, {});
  EXPECT_EQ(pyramid.sample({0.25f, 0.5f}, 0.0f, true, true), glm::vec3(1.0f));
  EXPECT_EQ(pyramid.sample({0.5f, 0.5f}, 0.0f, true, true), glm::vec3(2.0f));
  EXPECT_EQ(pyramid.sample({0.0f, 0.5f}, 0.0f, true, true), glm::vec3(1.0f));
  EXPECT_EQ(pyramid.sample({0.0f, 0.5f}, 0.0f, false, true), glm::vec3(2.0f));
  EXPECT_EQ(pyramid.sample({1.0f, 1.0f}, 0.0f, false, false), glm::vec3(2.0f));
  EXPECT_EQ(pyramid.sample({0.25f, 0.5f}, 0.5f, true, true), glm::vec3(1.5f));
}

// A colour is the same as that emission handed over for each surfel, and emissionScale is of the others.
TEST(Driven, aColorIsLightOfEachSurfel) {
  const Bake& bake = bakeOfRoom();
  const std::vector<Light> lights = test::someLights();
  Relighter driven = make(bake), handed = make(bake);
  MaterialEmission panel;
  panel.material = kPanel;
  panel.radiance = {4, 0, 7};
  LightSetup byMaterial, bySurfel;
  byMaterial.lights = bySurfel.lights = lights;
  byMaterial.materialEmissions = {&panel, 1};
  byMaterial.emissionScale = glm::vec3(0.5f);
  std::vector<glm::vec3> emission = bake.surfels.emission.toVector();
  for (glm::vec3& e : emission) e *= 0.5f;
  const DrivableMaterial& m = bake.emitters.materials[kPanel];
  for (std::uint32_t e = m.firstEntry; e < m.firstEntry + m.entryCount; ++e)
    emission[bake.emitters.surfel[e]] = panel.radiance;
  bySurfel.surfelEmission = emission;
  for (int frame = 0; frame < 3; ++frame) {
    ASSERT_TRUE(driven.relight(byMaterial));
    ASSERT_TRUE(handed.relight(bySurfel));
    ASSERT_EQ(driven.nodeRadiosity(), handed.nodeRadiosity());
  }
  // Without it, the light is the baked one again.
  Relighter fresh = make(bake);
  driven.reset();
  ASSERT_TRUE(driven.relight({}) && fresh.relight({}));
  EXPECT_EQ(driven.cacheCoefficients(), fresh.cacheCoefficients());
}

TEST(Driven, anImageOfOneColorIsThatColor) {
  const Bake& bake = bakeOfRoom();
  Relighter byImage = make(bake, {{"screen", 5, 3}}), byColor = make(bake);
  const std::vector<glm::vec3> image(15, glm::vec3(0.25f, 0.5f, 1.0f));
  MaterialEmission screen, plain;
  screen.radiance = glm::vec3(4, 4, 4);
  screen.image = image;
  plain.radiance = {1, 2, 4};
  LightSetup withImage, withColor;
  withImage.materialEmissions = {&screen, 1};
  withColor.materialEmissions = {&plain, 1};
  ASSERT_TRUE(byImage.relight(withImage));
  ASSERT_TRUE(byColor.relight(withColor));
  EXPECT_EQ(byImage.nodeRadiosity(), byColor.nodeRadiosity());
}

TEST(Driven, anImageKeepsItsPowerAndItsPlaces) {
  const Bake& bake = bakeOfRoom();
  for (const glm::uvec2& size : {glm::uvec2(16, 16), glm::uvec2(61, 37), glm::uvec2(512, 256)}) {
    Relighter relighter = make(bake, {{"screen", size.x, size.y}});
    const std::vector<glm::vec3> image = test::makeStripes(size.x, size.y);
    MaterialEmission screen;
    screen.material = kScreen;
    screen.image = image;
    LightSetup setup;
    setup.bounceScale = 0.0f;
    setup.materialEmissions = {&screen, 1};
    ASSERT_TRUE(relighter.relight(setup));
    const std::vector<glm::vec3> found = lit(relighter, bake, kScreen);
    const glm::vec3 mean = meanOf(found) / 3.14159265f, expected = meanOf(image);
    // Within what the places of the room's surfels are uneven.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c], expected[c], 0.035f * expected[c]) << size.x << ", channel " << c;
    // Red ends at two fifths along u, green rises along v.
    const DrivableMaterial& m = bake.emitters.materials[kScreen];
    for (std::uint32_t i = 0; i < m.entryCount; ++i) {
      const glm::vec2 at = unpackUnorm16x2(bake.emitters.tap[std::size_t{kFootprintTaps} * (m.firstEntry + i)]);
      if (at.x < 0.3f) {
        EXPECT_NEAR(found[i].r, 3.14159265f * 3.0f, 0.1f);
      }
      if (at.x > 0.5f) {
        EXPECT_NEAR(found[i].r, 3.14159265f * 0.3f, 0.1f);
      }
      EXPECT_NEAR(found[i].g, 3.14159265f * 3.0f * at.y, 0.7f);
    }
  }
}

TEST(Driven, theFirstFrameAfterAReloadHasIt) {
  const Bake& bake = bakeOfRoom();
  MaterialEmission panel;
  panel.material = kPanel;
  panel.radiance = {9, 9, 9};
  LightSetup setup;
  setup.materialEmissions = {&panel, 1};
  Relighter old = make(bake);
  ASSERT_TRUE(relightUntilConverged(old, setup));
  Relighter next = make(bake);
  ASSERT_TRUE(next.inherit(old, bake));
  ASSERT_TRUE(next.relight(setup));
  const glm::vec3 before = old.irradianceInGrid({5, 2, 5}, {1, 0, 0}),
                  after = next.irradianceInGrid({5, 2, 5}, {1, 0, 0});
  EXPECT_NEAR(after.r, before.r, 0.05f * before.r);
}

struct Mistake {
  const char* says;
  std::function<void(MaterialEmission&, LightSetup&)> make;
};

TEST(Driven, whatCannotBeLitIsRefusedByNameAndLightStays) {
  const Bake& bake = bakeOfRoom();
  Relighter relighter = make(bake, {{"screen", 4, 2}});
  std::vector<glm::vec3> image(8, glm::vec3(1.0f));
  const std::vector<glm::vec3> perSurfel(bake.surfels.count(), glm::vec3(1.0f));
  std::vector<glm::vec3> nan = image, negative = image, endless = image, huge = image;
  nan[5].y = kNan;
  negative[0].x = -1.0f;
  endless[7].z = kInfinity;
  huge[1].x = 2e9f;
  std::vector<MaterialEmission> twice(2);
  const std::vector<Mistake> mistakes = {
      {"materialEmissions[0].material is 2, expected less than 2: \"screen\", \"panel\"",
       [](MaterialEmission& e, LightSetup&) { e.material = 2; }},
      {"materialEmissions[0] (\"screen\").radiance is (",
       [](MaterialEmission& e, LightSetup&) { e.radiance.x = kNan; }},
      {".radiance is (-1, 1, 1)", [](MaterialEmission& e, LightSetup&) { e.radiance.x = -1.0f; }},
      {".radiance is (", [](MaterialEmission& e, LightSetup&) { e.radiance.z = kInfinity; }},
      {"(\"panel\") has an image, but none is declared",
       [&](MaterialEmission& e, LightSetup&) {
         e.material = kPanel;
         e.image = image;
       }},
      {"image has 7 texels, expected 8, the 4 x 2",
       [&](MaterialEmission& e, LightSetup&) { e.image = std::span(image).first(7); }},
      {"image: texel 1, 1 is (", [&](MaterialEmission& e, LightSetup&) { e.image = nan; }},
      {"image: texel 0, 0 is (-1, 1, 1)", [&](MaterialEmission& e, LightSetup&) { e.image = negative; }},
      {"image: texel 3, 1 is (", [&](MaterialEmission& e, LightSetup&) { e.image = endless; }},
      {"image: texel 1, 0 is (", [&](MaterialEmission& e, LightSetup&) { e.image = huge; }},
      {"texture needs the OpenGL backend", [](MaterialEmission& e, LightSetup&) { e.texture = 1; }},
      {"surfelEmission and materialEmissions", [&](MaterialEmission&, LightSetup& s) { s.surfelEmission = perSurfel; }},
      {"names the material of materialEmissions[0] again",
       [&](MaterialEmission&, LightSetup& s) { s.materialEmissions = twice; }}};
  ASSERT_TRUE(relighter.relight({}));
  const std::vector<float> before = relighter.cacheCoefficients();
  for (const Mistake& mistake : mistakes) {
    MaterialEmission emission;
    LightSetup setup;
    setup.materialEmissions = {&emission, 1};
    mistake.make(emission, setup);
    const Status refused = relighter.relight(setup);
    ASSERT_FALSE(refused) << mistake.says;
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_NE(refused.error().message.find(mistake.says), std::string::npos) << refused.error().message;
    EXPECT_EQ(relighter.cacheCoefficients(), before) << mistake.says;
  }
}

TEST(Driven, imagesAreCheckedWhenTheyAreDeclared) {
  Bake bake = bakeOfRoom();
  const auto refused = [&bake](std::vector<DrivenImage> images) {
    RelightOptions options;
    options.drivenImages = std::move(images);
    const Result<Relighter> made = Relighter::create(bake, options);
    return made ? std::string() : made.error().message;
  };
  EXPECT_NE(refused({{"wall", 4, 4}}).find("no such drivable material; there are \"screen\", \"panel\""),
            std::string::npos);
  EXPECT_NE(refused({{"screen", 0, 4}}).find("0 x 4 texels"), std::string::npos);
  EXPECT_NE(refused({{"screen", 4, 8193}}).find("4 x 8193 texels"), std::string::npos);
  EXPECT_NE(refused({{"screen", 4, 4}, {"screen", 4, 4}}).find("declared twice"), std::string::npos);
  std::vector<DrivableMaterial> materials = bake.emitters.materials.toVector();
  materials[kScreen].textured = false;
  bake.emitters.materials = materials;
  EXPECT_NE(refused({{"screen", 4, 4}}).find("have no texture coordinates"), std::string::npos);
}

// As bakes of format version 3 are.
TEST(Driven, aBakeWithoutEmittersSaysSo) {
  Bake bake = bakeOfRoom();
  bake.emitters = {};
  Relighter relighter = make(bake);
  const MaterialEmission emission;
  LightSetup setup;
  setup.materialEmissions = {&emission, 1};
  const Status refused = relighter.relight(setup);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_NE(refused.error().message.find("the bake knows no drivable material"), std::string::npos);
  EXPECT_NE(refused.error().message.find("format 3"), std::string::npos);
  RelightOptions options;
  options.drivenImages = {{"screen", 4, 4}};
  EXPECT_EQ(Relighter::create(bake, options).error().code, ErrorCode::unsupported);
}

TEST(Driven, framesAllocateNothing) {
  const Bake& bake = bakeOfRoom();
  Relighter relighter = make(bake, {{"screen", 64, 48}});
  std::vector<glm::vec3> image = test::makeStripes(64, 48);
  std::vector<MaterialEmission> emissions(2);
  emissions[0].image = image;
  emissions[1].material = kPanel;
  LightSetup setup, plain;
  setup.materialEmissions = emissions;
  const auto frames = [&] {
    for (int i = 0; i < 4; ++i) {
      image[static_cast<std::size_t>(i)] *= 2.0f;
      emissions[1].radiance *= 1.1f;
      EXPECT_TRUE(relighter.relight(setup));
      EXPECT_TRUE(relighter.relight(plain));
    }
  };
  frames();
  const std::size_t before = test::allocations();
  frames();
  EXPECT_EQ(test::allocations(), before);
}

}  // namespace
}  // namespace relume
