// SPDX-License-Identifier: MIT
// The runtime's public door on the CPU backend: analytic light, checks, sharing.
#include "relume/relighter.h"

#include "formats/pack.h"

#include "tests/runtime/furnace_bake.h"
#include "tests/runtime/make_relighter.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <thread>

namespace relume {
namespace {

// Tolerances: albedo is kept in 8 bits, radiosity in 8 to 9 (runtime/shared/pack_surfel.h, pack_color.h).

using test::makeRelighter;

TEST(Furnace, bouncesFollowTheGeometricSeries) {
  const float rho = 0.6f, emission = 2.0f;
  for (const std::uint32_t bands : {2u, 3u, 4u, 6u}) {
    Relighter relighter = makeRelighter(test::makeFurnaceBake(rho, emission, bands));
    float radiosity = 0.0f;
    for (int frame = 0; frame < 40; ++frame) {
      ASSERT_TRUE(relighter.relight({}));
      // B_k+1 = pi Le + rho B_k.
      radiosity = std::numbers::pi_v<float> * emission + rho * radiosity;
      ASSERT_NEAR(relighter.nodeRadiosity()[0].g, radiosity, 0.004f * radiosity)
          << "bands " << bands << " frame " << frame;
    }
    // In the limit irradiance is the radiosity pi Le / (1 - rho).
    const float limit = std::numbers::pi_v<float> * emission / (1.0f - rho);
    EXPECT_NEAR(relighter.irradianceOnLightmap({0.5f / 6.0f, 0.5f}, {1, 0, 0}).r, limit, 0.005f * limit);
    EXPECT_NEAR(relighter.irradianceInGrid({0, 0, 0}, {0, 1, 0}).b, limit, 0.005f * limit);
  }
}

TEST(Furnace, bounceScaleScalesEachBounce) {
  Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 4));
  LightSetup setup;
  setup.bounceScale = 0.0f;
  for (int frame = 0; frame < 3; ++frame) EXPECT_TRUE(relighter.relight(setup));
  EXPECT_NEAR(relighter.nodeRadiosity()[0].g, std::numbers::pi_v<float>, 0.004f * std::numbers::pi_v<float>);
  setup.bounceScale = 0.5f;
  EXPECT_GT(relightUntilConverged(relighter, setup).value(), 3);
  EXPECT_NEAR(relighter.nodeRadiosity()[0].g, std::numbers::pi_v<float> / (1.0f - 0.25f),
              0.01f * std::numbers::pi_v<float>);
}

TEST(Furnace, hostsOwnLightTakesThePlaceOfLightsAndEmission) {
  const Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 3);
  Relighter relighter = makeRelighter(bake);
  LightSetup setup;
  setup.emissionScale = glm::vec3(0.0f);
  setup.bounceScale = 0.0f;
  EXPECT_TRUE(relighter.relight(setup));
  EXPECT_EQ(relighter.nodeRadiosity()[0], glm::vec3(0.0f));
  const std::vector<glm::vec3> irradiance(6, glm::vec3(3, 2, 1));
  setup.surfelIrradiance = irradiance;
  EXPECT_TRUE(relighter.relight(setup));
  EXPECT_NEAR(relighter.nodeRadiosity()[0].r, 1.5f, 0.006f);
  EXPECT_NEAR(relighter.nodeRadiosity()[0].b, 0.5f, 0.012f);
  const std::vector<glm::vec3> emission(6, glm::vec3(0, 1, 0));
  setup.surfelEmission = emission;
  EXPECT_TRUE(relighter.relight(setup));
  EXPECT_NEAR(relighter.nodeRadiosity()[0].g, 1.0f + std::numbers::pi_v<float>, 0.015f);
}

TEST(Furnace, hostsOwnLightIsRefusedWithoutItsOption) {
  RelightOptions options;
  options.surfelArrays = false;
  Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 3), options);
  EXPECT_TRUE(relighter.relight({}));
  EXPECT_NEAR(relighter.nodeRadiosity()[0].g, std::numbers::pi_v<float>, 0.004f * std::numbers::pi_v<float>);
  const std::vector<glm::vec3> irradiance(6, glm::vec3(3, 2, 1));
  LightSetup setup;
  setup.surfelIrradiance = irradiance;
  EXPECT_FALSE(relighter.relight(setup));
  EXPECT_NE(relighter.check(setup).error().message.find("surfelArrays"), std::string::npos);
}

TEST(Furnace, resetForgets) {
  Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 3));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(relighter.relight({}));
  relighter.reset();
  EXPECT_EQ(relighter.irradianceInGrid({0, 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_TRUE(relighter.relight({}));
  EXPECT_NEAR(relighter.nodeRadiosity()[0].g, std::numbers::pi_v<float>, 0.004f * std::numbers::pi_v<float>);
}

TEST(Visibility, isAskedForAndMultiplied) {
  const Bake bake = test::makeFurnaceBake(0.5f, 0.0f, 3);
  Relighter relighter = makeRelighter(bake);
  std::vector<Light> lights(2);
  lights[0].kind = LightKind::directional;
  lights[0].direction = {-1, 0, 0};
  lights[1].intensity = glm::vec3(5.0f);
  LightSetup setup;
  setup.lights = lights;
  setup.bounceScale = 0.0f;
  setup.visibility = [](std::uint32_t light, const glm::vec3&, const glm::vec3& normal) {
    EXPECT_TRUE(light == 1 || normal.x == 1.0f) << "a surfel that faces away needs no shadow";
    return light == 0 ? 0.25f : 0.0f;
  };
  EXPECT_TRUE(relighter.relight(setup));
  // Wall 0 faces +X: leaf 5.
  EXPECT_NEAR(relighter.nodeRadiosity()[5].r, 0.5f * 0.25f, 0.001f);
}

TEST(Threads, changeNothing) {
  const Bake bake = test::makeSyntheticBake({.surfels = 9000, .linksPerCache = 90});
  std::vector<Light> lights(1);
  lights[0].positionWorld = {3, 2, 3};
  LightSetup setup;
  setup.lights = lights;
  RelightOptions threaded;
  threaded.parallelFor = [](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    std::thread other([&] {
      for (std::uint32_t i = tasks; i-- > 0;) {
        if (i % 2) body(i);
      }
    });
    for (std::uint32_t i = 0; i < tasks; i += 2) body(i);
    other.join();
  };
  Relighter one = makeRelighter(bake), two = makeRelighter(bake, threaded);
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_TRUE(one.relight(setup));
    EXPECT_TRUE(two.relight(setup));
  }
  EXPECT_EQ(one.cacheCoefficients(), two.cacheCoefficients());
}

TEST(Sharing, relightersKeepTheBakesArraysAlive) {
  std::vector<Relighter> relighters;
  {
    const Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 4);
    relighters.push_back(makeRelighter(bake));
    relighters.push_back(makeRelighter(bake, {.lumaBands = 3, .chromaBands = 1}));
  }
  LightSetup dark;
  dark.emissionScale = glm::vec3(0.0f);
  std::thread other([&] { EXPECT_TRUE(relighters[1].relight(dark)); });
  EXPECT_TRUE(relighters[0].relight({}));
  other.join();
  EXPECT_NEAR(relighters[0].nodeRadiosity()[0].g, std::numbers::pi_v<float>, 0.004f * std::numbers::pi_v<float>);
  EXPECT_EQ(relighters[1].nodeRadiosity()[0], glm::vec3(0.0f));
  EXPECT_EQ(relighters[1].coefficientsPerCache(), 9 + 2);
}

void expectRefused(const Relighter& relighter, const LightSetup& setup, const std::string& word) {
  const Status status = relighter.check(setup);
  ASSERT_FALSE(status) << word;
  EXPECT_EQ(status.error().code, ErrorCode::usage);
  EXPECT_NE(status.error().message.find(word), std::string::npos) << status.error().message;
}

TEST(Setup, whatCannotBeLitIsRefusedByName) {
  Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 2));
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(relighter.check({}));
  const std::vector<glm::vec3> five(5, glm::vec3(1.0f));
  std::vector<glm::vec3> six(6, glm::vec3(1.0f));
  LightSetup setup;
  setup.surfelIrradiance = five;
  expectRefused(relighter, setup, "surfelIrradiance has 5 elements, expected none or 6");
  setup = {};
  setup.skyPatches = five;
  expectRefused(relighter, setup, "skyPatches");
  setup = {};
  six[3].y = nan;
  setup.surfelEmission = six;
  expectRefused(relighter, setup, "surfelEmission[3]");
  setup = {};
  setup.bounceScale = 1.5f;
  expectRefused(relighter, setup, "bounceScale");
  setup = {};
  setup.skyRadiance.x = -1.0f;
  expectRefused(relighter, setup, "skyRadiance");
  setup = {};
  setup.emissionScale.z = infinite;
  expectRefused(relighter, setup, "emissionScale");
  std::vector<Light> lights(2);
  setup = {};
  setup.lights = lights;
  lights[1].intensity.x = nan;
  expectRefused(relighter, setup, "lights[1].intensity");
  // A refused setup leaves the light as it was.
  lights.resize(1);
  setup.lights = lights;
  ASSERT_TRUE(relighter.relight(setup));
  const std::vector<float> before = relighter.cacheCoefficients();
  setup.bounceScale = nan;
  EXPECT_FALSE(relighter.relight(setup));
  EXPECT_EQ(relighter.cacheCoefficients(), before);
}

TEST(Setup, eachFieldOfALightIsRefusedByIndexAndName) {
  Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 2));
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  std::vector<Light> lights(3);
  LightSetup setup;
  setup.lights = lights;
  const auto expect = [&](LightKind kind, const std::string& field, const std::function<void(Light&)>& breakIt) {
    lights[2] = {};
    lights[2].kind = kind;
    ASSERT_TRUE(relighter.check(setup));
    breakIt(lights[2]);
    expectRefused(relighter, setup, "lights[2]." + field);
  };
  for (const LightKind kind : {LightKind::directional, LightKind::point, LightKind::spot}) {
    for (const float bad : {nan, infinite, -1.0f, 2e20f}) {
      for (int c = 0; c < 3; ++c) expect(kind, "intensity is (", [&](Light& l) { l.intensity[c] = bad; });
    }
  }
  for (const LightKind kind : {LightKind::point, LightKind::spot}) {
    for (const float bad : {nan, infinite, -infinite, 2e9f, -2e9f}) {
      for (int c = 0; c < 3; ++c) expect(kind, "positionWorld is (", [&](Light& l) { l.positionWorld[c] = bad; });
    }
    for (const float bad : {nan, infinite, -1e-6f}) expect(kind, "range is ", [&](Light& l) { l.range = bad; });
  }
  for (const LightKind kind : {LightKind::directional, LightKind::spot}) {
    for (const float bad : {nan, infinite, -infinite, 1e30f, 2.0f}) {
      for (int c = 0; c < 3; ++c) expect(kind, "direction is (", [&](Light& l) { l.direction[c] = bad; });
    }
    const std::string text = std::string("direction is (0, 0, 0) of length 0, expected 1, for its kind is ") +
                             (kind == LightKind::spot ? "spot" : "directional");
    expect(kind, text, [&](Light& l) { l.direction = glm::vec3(0.0f); });
  }
  for (const float bad : {nan, infinite, -0.1f, 3.2f})
    expect(LightKind::spot, "outerConeRad is ", [&](Light& l) { l.outerConeRad = bad; });
  for (const float bad : {nan, infinite, -0.1f, 0.8f})
    expect(LightKind::spot, "innerConeRad is ", [&](Light& l) { l.innerConeRad = bad; });
  expect(LightKind::point, "kind is 3", [&](Light& l) { l.kind = static_cast<LightKind>(3); });
}

TEST(Setup, whatAKindOfLightDoesNotHaveMayHoldAnything) {
  Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 2));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Light> lights(2);
  lights[0] = {.kind = LightKind::directional,
               .positionWorld = glm::vec3(nan),
               .range = nan,
               .innerConeRad = nan,
               .outerConeRad = nan};
  lights[1] = {.kind = LightKind::point, .direction = glm::vec3(nan), .innerConeRad = nan, .outerConeRad = nan};
  LightSetup setup;
  setup.lights = lights;
  ASSERT_TRUE(relighter.relight(setup));
  for (const float c : relighter.cacheCoefficients()) ASSERT_TRUE(std::isfinite(c));
}

TEST(Setup, directionsWithinOnePercentOfUnitLengthAreNormalised) {
  const glm::vec3 unit = glm::normalize(glm::vec3(-0.6f, 0.7f, 0.2f));
  for (const LightKind kind : {LightKind::directional, LightKind::spot}) {
    const auto coefficients = [&](float length) {
      Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 0.0f, 3));
      const Light light{.kind = kind, .intensity = glm::vec3(7.0f), .direction = unit * length};
      LightSetup setup;
      setup.lights = std::span(&light, 1);
      EXPECT_TRUE(relighter.relight(setup)) << length;
      return relighter.cacheCoefficients();
    };
    const std::vector<float> exact = coefficients(1.0f);
    for (const float length : {0.9905f, 0.9999f, 1.0095f}) {
      const std::vector<float> off = coefficients(length);
      ASSERT_EQ(off.size(), exact.size());
      for (std::size_t i = 0; i < off.size(); ++i)
        ASSERT_NEAR(off[i], exact[i], 1e-5f + 0.005f * std::abs(exact[i])) << length;
    }
    Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 0.0f, 3));
    for (const float length : {0.0f, 0.5f, 0.985f, 1.015f, 30.0f}) {
      const Light light{.kind = kind, .direction = unit * length};
      LightSetup setup;
      setup.lights = std::span(&light, 1);
      expectRefused(relighter, setup, "lights[0].direction");
      const Status lit = relighter.relight(setup);
      ASSERT_FALSE(lit);
      EXPECT_NE(lit.error().message.find(length == 0.0f ? "give it a direction" : "normalise"), std::string::npos)
          << lit.error().message;
      const Result<int> frames = relightUntilConverged(relighter, setup);
      ASSERT_FALSE(frames);
      EXPECT_EQ(frames.error().message, lit.error().message);
    }
  }
}

TEST(Setup, convergingHasItsOwnRanges) {
  Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 3));
  const auto refusal = [&](float tolerance, int maxFrames) {
    const Result<int> frames = relightUntilConverged(relighter, {}, tolerance, maxFrames);
    return frames ? "" : frames.error().message;
  };
  EXPECT_EQ(refusal(std::numeric_limits<float>::quiet_NaN(), 4), "tolerance is nan, expected 0 or more");
  EXPECT_EQ(refusal(-0.5f, 4), "tolerance is -0.5, expected 0 or more");
  EXPECT_EQ(refusal(1e-4f, -5), "maxFrames is -5, expected 0 or more");
  EXPECT_EQ(relighter.nodeRadiosity()[0], glm::vec3(0.0f)) << "no frame was run";
  EXPECT_EQ(relightUntilConverged(relighter, {}, 0.0f, 0).value(), 0);
  EXPECT_EQ(relightUntilConverged(relighter, {}, 0.0f, 3).value(), 3);
}

// Light of the furthest numbers that check() takes, in every field.
TEST(Setup, whatIsTakenStaysFinite) {
  const Bake furnace = test::makeFurnaceBake(0.0f, 0.5f, 3), level = test::makeSyntheticBake({.surfels = 500});
  for (const Bake* bake : {&furnace, &level}) {
    for (const Simd simd : {Simd::baseline, Simd::best}) {
      RelightOptions options;
      options.simd = simd;
      Relighter relighter = makeRelighter(*bake, options);
      std::vector<Light> lights;
      const glm::vec3 surfel = bake->surfels.positionWorld[0];
      for (const LightKind kind : {LightKind::directional, LightKind::point, LightKind::spot}) {
        for (const glm::vec3& at : {surfel, surfel + 1e-20f, glm::vec3(1e9f), glm::vec3(-1e9f, 1e9f, 0.0f)}) {
          for (const float range : {0.0f, 1e-38f, 1e-20f, 1.0f, 3e38f}) {
            for (const float cone : {0.0f, 1e-30f, 3.14159265f})
              lights.push_back({kind, glm::vec3(1e20f, 0.0f, 1e-30f), at, {0, -1, 0}, range, 0.0f, cone});
          }
        }
      }
      const std::vector<glm::vec3> irradiance(bake->surfels.count(), glm::vec3(1e20f, 0.0f, 1.0f));
      LightSetup byLights, byHost;
      byLights.lights = lights;
      byLights.emissionScale = byLights.skyRadiance = glm::vec3(1e20f);
      LightSetup shadowed = byLights;
      shadowed.visibility = [](std::uint32_t light, const glm::vec3&, const glm::vec3&) {
        constexpr float kBroken[] = {std::numeric_limits<float>::quiet_NaN(), -1.0f, 1e38f,
                                     std::numeric_limits<float>::infinity(), 0.5f};
        return kBroken[light % 5];
      };
      byHost.surfelIrradiance = byHost.surfelEmission = irradiance;
      for (const LightSetup& setup : {byLights, shadowed, byHost}) {
        for (int frame = 0; frame < 3; ++frame)
          ASSERT_TRUE(relighter.relight(setup)) << relighter.check(setup).error().message;
        for (const float c : relighter.cacheCoefficients()) ASSERT_TRUE(std::isfinite(c));
        for (const glm::vec3& r : relighter.nodeRadiosity()) ASSERT_TRUE(r.r >= 0 && r.g >= 0 && r.b >= 0);
      }
      // And leaves when the light goes.
      LightSetup dark;
      dark.emissionScale = glm::vec3(0.0f);
      dark.bounceScale = 0.0f;
      ASSERT_TRUE(relighter.relight(dark));
      for (const glm::vec3& r : relighter.nodeRadiosity()) ASSERT_LT(r.r + r.g + r.b, 1e-6f);
    }
  }
}

TEST(Options, bandsAreHeldAgainstLinksAndEachOther) {
  const Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 3);
  EXPECT_EQ(makeRelighter(bake).lumaBands(), 3);
  for (const RelightOptions& options :
       {RelightOptions{.lumaBands = 4}, RelightOptions{.lumaBands = -1},
        RelightOptions{.lumaBands = 2, .chromaBands = 3}, RelightOptions{.chromaBands = 9}}) {
    const Result<Relighter> made = Relighter::create(bake, options);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::usage);
    EXPECT_NE(made.error().message.find("Bands is"), std::string::npos);
  }
}

// Breaks one thing of a good bake.
void expectInvalid(void (*breakIt)(Bake&), const std::string& word) {
  Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 2);
  breakIt(bake);
  const Result<Relighter> made = Relighter::create(bake, {});
  ASSERT_FALSE(made) << word;
  EXPECT_EQ(made.error().code, ErrorCode::invalidFile);
  EXPECT_NE(made.error().message.find(word), std::string::npos) << made.error().message;
}

template <class T>
void change(Array<T>& array, std::size_t index, T value) {
  std::vector<T> copy = array.toVector();
  copy[index] = value;
  array = std::move(copy);
}

TEST(BakeCheck, eachBrokenInvariantIsNamed) {
  expectInvalid([](Bake& b) { b = Bake{}; }, "sender");
  expectInvalid([](Bake& b) { b.surfels.normal = std::vector<glm::vec3>(5); }, "surfel.normal: expected 6, found 5");
  expectInvalid([](Bake& b) { change(b.surfels.albedo, 2, glm::vec3(1.5f)); }, "surfel.albedo[2]");
  expectInvalid([](Bake& b) { change(b.surfels.emission, 1, glm::vec3(std::nanf(""))); }, "surfel.emission[1]");
  expectInvalid([](Bake& b) { change(b.hierarchy.child, 1, 0u); }, "node.child[1]");
  expectInvalid([](Bake& b) { change(b.hierarchy.child, 4, 10u); }, "node.child[4]");
  expectInvalid([](Bake& b) { change(b.hierarchy.child, 6, kLeafBit | 6u); }, "node.child[6]");
  expectInvalid([](Bake& b) { change(b.hierarchy.firstWeight, 0, 1.5f); }, "node.weight[0]");
  expectInvalid([](Bake& b) { change(b.hierarchy.levelBegin, 4, 12u); }, "node.level[4]");
  expectInvalid([](Bake& b) { change(b.hierarchy.leafNode, 3, 7u); }, "node.leaf[3]");
  expectInvalid([](Bake& b) { change(b.caches.lightmap.cache, 5, 7u); }, "map.cache[5]");
  expectInvalid([](Bake& b) { change(b.caches.grid.cache, 0, 99u); }, "grid.cache[0]");
  expectInvalid([](Bake& b) { change(b.surfels.positionWorld, 1, glm::vec3(0, 0, 3e38f)); }, "surfel.position[1]");
  expectInvalid([](Bake& b) { change(b.surfels.normal, 1, glm::vec3(0, 0, 1e30f)); }, "surfel.normal[1]");
  expectInvalid([](Bake& b) { change(b.surfels.emission, 1, glm::vec3(2e9f)); }, "surfel.emission[1]");
  for (const float far : {2e9f, 3e38f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    for (int axis = 0; axis < 3; ++axis) {
      Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 2);
      glm::vec3 position(0.0f);
      position[axis] = -far;
      change(bake.caches.positionWorld, 3, position);
      const Result<Relighter> made = Relighter::create(bake, {});
      ASSERT_FALSE(made);
      EXPECT_NE(made.error().message.find("cache.position[3]"), std::string::npos) << made.error().message;
    }
  }
  expectInvalid([](Bake& b) { change(b.caches.normal, 2, glm::vec3(3, 0, 0)); }, "cache.normal[2]");
  expectInvalid([](Bake& b) { b.caches.grid.originWorld.y = 2e9f; }, "grid origin");
  expectInvalid([](Bake& b) { b.caches.grid.spacing.y = -1.0f; }, "grid spacing");
  expectInvalid([](Bake& b) { b.caches.lightmap.width = 7; }, "map.cache: expected 7 x");
  expectInvalid([](Bake& b) { change(b.links.rowBegin, 2, 99u); }, "link.row[2]");
  expectInvalid([](Bake& b) { change(b.links.shNode, 4, 11u); }, "link.node[4]");
  expectInvalid([](Bake& b) { b.links.bands = 9; }, "link bands");
  expectInvalid([](Bake& b) { b.links.bands = 3; }, "link.sh");
  // What a frame would compute with.
  expectInvalid([](Bake& b) { b.surfels.areaEach = std::nanf(""); }, "surfel area");
  expectInvalid([](Bake& b) { change(b.links.shCoefficients, 5, std::uint16_t{0x7C00}); }, "link.sh[5]");
  expectInvalid([](Bake& b) { change(b.links.shCoefficients, 5, std::uint16_t{0xFE00}); }, "link.sh[5]");
}

// Whatever a bake that is taken says of normals: of a texel whose cache has none too.
TEST(BakeCheck, mapsOfWhatPassesAreFinite) {
  Bake bake = test::makeSyntheticBake({.surfels = 500});
  for (std::uint32_t c = bake.caches.firstMapCache(); c < bake.caches.count(); c += 3)
    change(bake.caches.normal, c, glm::vec3(0.0f));
  Relighter relighter = makeRelighter(bake);
  const Light lamp{.kind = LightKind::point, .intensity = glm::vec3(20.0f), .positionWorld = {6, 2, 3}};
  LightSetup setup;
  setup.lights = {&lamp, 1};
  ASSERT_TRUE(relighter.relight(setup));
  std::vector<std::uint16_t> map(4 * bake.caches.lightmap.cache.size()), l1(4 * map.size());
  ASSERT_TRUE(relighter.irradianceMap(map));
  ASSERT_TRUE(relighter.irradianceMapL1(l1));
  for (const std::uint16_t half : map) ASSERT_TRUE(std::isfinite(unpackHalf(half)));
  for (const std::uint16_t half : l1) ASSERT_TRUE(std::isfinite(unpackHalf(half)));
}

}  // namespace
}  // namespace relume
