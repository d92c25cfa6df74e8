// SPDX-License-Identifier: MIT
// The OpenGL passes of light in volumes that lie in one another against their twins on the CPU.
#include "relume/live_light.h"
#include "runtime/live/nested_caches.h"
#include "runtime/live_gl/live_caches_gl.h"
#include "tests/live/irradiance_by_shader.h"
#include "tests/live/lit_volumes.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace relume {
namespace {

using namespace test;

// A hall with a glowing panel in its ceiling, boxes, and one that moves.
VoxelLevel hallOfBoxes() {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.6f, 0.5f, 0.4f)}, {glm::vec3(0.0f), glm::vec3(6.0f)}, {glm::vec3(0.2f, 0.6f, 0.3f)}};
  level.addBox({0, 0, 0}, {16, 4, 6}, true);
  level.addQuad({2, 3.9f, 1}, {7, 3.9f, 1}, {7, 3.9f, 5}, {2, 3.9f, 5}, 1);  // faces down
  level.addBox({5.2f, 0, 3.4f}, {6.4f, 1.6f, 4.9f}, false, 2);
  level.addBox({10.2f, 0, 1.4f}, {11.4f, 1.6f, 2.9f}, false, 2);
  level.addBox({-0.3f, -0.3f, -0.3f}, {0.3f, 0.3f, 0.3f}, false, 2);
  level.parts.back().moves = true;
  level.parts.back().toWorld[3] = {7.6f, 1.1f, 3.0f};
  return level;
}

std::vector<Light> lampOfHall() {
  std::vector<Light> lights(1);
  lights[0].positionWorld = {9, 3, 3};
  lights[0].intensity = {8, 6, 4};
  lights[0].range = 20.0f;
  return lights;
}

NestedVolumes volumesOf(VoxelLevel& level, std::uint32_t cascades, std::uint32_t cells, const glm::vec3& eye,
                        bool boxFollowsEye = false) {
  NestedOptions options;
  options.outermost.cells = cells;
  options.cascades = cascades;
  options.eyeWorld = eye;
  options.boxFollowsEye = boxFollowsEye;
  if (boxFollowsEye) {
    options.outermost.boxMin = eye - glm::vec3(4.0f);
    options.outermost.boxMax = eye + glm::vec3(4.0f);
  }
  auto made = NestedVolumes::create(level.geometry(), options);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

NestedCaches onCpu(std::uint32_t rays) {
  auto made = NestedCaches::create({rays});
  EXPECT_TRUE(made);
  return std::move(*made);
}

class NestedCachesOnGl : public GlTest {
 protected:
  static LiveCachesGl onGl(std::uint32_t rays, std::optional<gpu::GroupThreads> groups = {}) {
    auto made = LiveCachesGl::create({{rays}, EglContext::getProcAddress, "", groups});
    EXPECT_TRUE(made) << made.error().message;
    return std::move(*made);
  }

  // Of all caches, those with a coefficient that is off by more than 2e-3 of their first, at most one in 200.
  static void expectTwins(const NestedCaches& cpu, const LiveCachesGl& gl, const std::string& when) {
    ASSERT_EQ(gl.activeCells(), cpu.activeCells()) << when;
    for (std::size_t level = 0; level < cpu.size(); ++level) {
      const std::vector<float> found = gl.coefficients(level), brightest = gl.brightest(level);
      const std::span<const float> expected = cpu[level].coefficients();
      ASSERT_EQ(found.size(), expected.size());
      std::size_t off = 0, lit = 0;
      for (std::size_t c = 0; c < brightest.size(); ++c) {
        float most = 0.0f, first = 1e-6f;
        for (std::size_t k = 27 * c; k < 27 * c + 27; ++k) most = std::max(most, std::abs(found[k] - expected[k]));
        for (const std::size_t k : {0u, 9u, 18u}) first = std::max(first, std::abs(expected[27 * c + k]));
        lit += first > 1e-3f ? 1 : 0;
        const float b = cpu[level].brightest()[c];
        if (!(most <= 2e-3f * first) || !(std::abs(brightest[c] - b) <= 2e-3f * b + 1e-6f)) ++off;
      }
      EXPECT_LE(off, brightest.size() / 200) << when << ", volume " << level << " of " << brightest.size();
      EXPECT_GT(lit, brightest.size() / 2) << when;
    }
  }
};

// While the eye walks on by cells, jumps and comes back, and a part moves.
TEST_F(NestedCachesOnGl, eachPassIsItsTwins) {
  const std::vector<Light> lights = lampOfHall();
  LightSetup setup;
  setup.lights = lights;
  for (const auto groups : {gpu::GroupThreads::serial, gpu::GroupThreads::parallel}) {
    for (const std::uint32_t cascades : {2u, 3u}) {
      VoxelLevel level = hallOfBoxes();
      NestedVolumes volumes = volumesOf(level, cascades, 10, {6, 2, 3});
      NestedCaches cpu = onCpu(16);
      LiveCachesGl gl = onGl(16, groups);
      std::uint32_t f = 0;
      for (const float eye : {6.0f, 7.1f, 8.9f, 14.0f, 7.5f}) {
        ASSERT_TRUE(volumes.centre({eye, 2, 3}));
        if (f % 2 == 1) {
          glm::mat4x3 to(1.0f);
          to[3] = {7.6f + 0.4f * static_cast<float>(f), 1.1f, 3.0f};
          ASSERT_TRUE(volumes.move(std::vector<glm::mat4x3>{to}));
        }
        ASSERT_TRUE(volumes.lightDirectly(setup));
        ASSERT_TRUE(f == 3 ? gl.copyDirect(volumes) : gl.lightDirectly(volumes, setup));
        LiveFrame frame;
        frame.raySet = f;
        frame.keep = 0.4f;
        frame.sky.radiance = glm::vec3(0.5f);
        ASSERT_TRUE(cpu.update(volumes, frame));
        ASSERT_TRUE(gl.update(volumes, frame));
        expectTwins(cpu, gl, std::to_string(cascades) + " volumes, frame " + std::to_string(f));
        ++f;
      }
      const std::vector<glm::vec3> radiance = gl.radiance(cascades - 1);
      const VoxelVolume& inner = volumes[cascades - 1];
      ASSERT_EQ(radiance.size(), inner.sideCount());
      std::size_t off = 0;
      for (std::uint32_t s = 0; s < inner.sideCount(); ++s) {
        const glm::vec3 side = inner.radianceOf(s);
        if (glm::distance(radiance[s], side) > 2e-3f * glm::length(side) + 1e-5f) ++off;
      }
      EXPECT_LE(off, radiance.size() / 200);
      for (float x = -0.5f; x < 17.0f; x += 0.37f) {
        const glm::vec3 e = cpu.irradiance({x, 0, 2}, {0, 1, 0});
        EXPECT_LT(glm::distance(gl.irradiance({x, 0, 2}, {0, 1, 0}), e), 0.01f * glm::length(e) + 1e-4f) << x;
      }
    }
  }
}

// What has entered begins with the light around it, and what stays keeps its own: before it has gathered once more.
TEST_F(NestedCachesOnGl, whatEntersBeginsWithTheLightAroundIt) {
  VoxelLevel level = hallOfBoxes();
  NestedVolumes volumes = volumesOf(level, 3, 12, {4, 2, 3});
  NestedCaches cpu = onCpu(32);
  LiveCachesGl gl = onGl(32);
  for (int f = 0; f < 4; ++f) {
    ASSERT_TRUE(cpu.update(volumes, {}));
    ASSERT_TRUE(gl.update(volumes, {}));
  }
  for (const float eye : {6.3f, 14.0f}) {
    ASSERT_TRUE(*volumes.centre({eye, 2, 3}));
    LiveFrame frame;  // voxels alone are what the caches have been before
    frame.emissionScale = glm::vec3(0.0f);
    ASSERT_TRUE(cpu.update(volumes, frame));
    ASSERT_TRUE(gl.update(volumes, frame));
    expectTwins(cpu, gl, "at " + std::to_string(eye));
  }
}

// Within the volumes, where they take over from one another, and beyond; where the outermost follows the eye, to the
// sky.
TEST_F(NestedCachesOnGl, aShaderReadsTheLightAsTheCpuDoes) {
  for (const bool boxFollowsEye : {false, true}) {
    VoxelLevel level = hallOfBoxes();
    NestedVolumes volumes = volumesOf(level, boxFollowsEye ? 2 : 3, 10, {5, 2, 3}, boxFollowsEye);
    NestedCaches cpu = onCpu(16);
    LiveCachesGl gl = onGl(16);
    LiveFrame frame;
    frame.sky.radiance = {0.5f, 1.0f, 2.0f};
    for (const float eye : {5.0f, 6.5f, 8.5f}) {
      ASSERT_TRUE(volumes.centre({eye, 2, 3}));
      ASSERT_TRUE(cpu.update(volumes, frame));
      ASSERT_TRUE(gl.update(volumes, frame));
    }
    constexpr std::size_t kPlaces = 1000;
    const std::vector<float> places = placesInBox(kPlaces, glm::vec3(-0.5f), {16.5f, 3.5f, 5.5f});
    const std::vector<float> found = irradianceByShader(gl, places);
    std::size_t off = 0, between = 0, inSky = 0;
    double sum = 0.0;
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const float* const p = &places[6 * i];
      const glm::vec3 place(p[0], p[1], p[2]), normal(p[3], p[4], p[5]), expected = cpu.irradiance(place, normal);
      const NestedStencil stencil = cpu.stencil(place, normal);
      between += stencil.share[0] > 0.05f && stencil.share[1] > 0.05f ? 1 : 0;
      inSky += stencil.sky > 0.05f ? 1 : 0;
      sum += static_cast<double>(expected.g);
      const float bar = 5e-3f * glm::length(expected) + 1e-4f;
      if (glm::distance(glm::vec3(found[3 * i], found[3 * i + 1], found[3 * i + 2]), expected) > bar) ++off;
      if (i < 100) {
        EXPECT_LT(glm::distance(gl.irradiance(place, normal), expected), bar) << i;
      }
    }
    EXPECT_GT(sum, 0.1 * kPlaces);
    EXPECT_GT(between, kPlaces / 50);
    EXPECT_EQ(inSky > kPlaces / 10, boxFollowsEye);
    EXPECT_LE(off, kPlaces / 100);
    // Where it is read from follows the eye between frames as well.
    std::vector<VoxelVolume> seen(volumes.all().begin(), volumes.all().end());
    setReach(seen, {9.1f, 2, 3}, boxFollowsEye);
    gl.takeReach(std::span<const VoxelVolume>(seen));
    const std::vector<float> next = irradianceByShader(gl, places);
    std::size_t others = 0;
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const float* const p = &places[6 * i];
      others += std::abs(next[3 * i + 1] - found[3 * i + 1]) > 1e-3f ? 1 : 0;
      if (i >= 200) continue;
      const glm::vec3 expected = gl.irradiance({p[0], p[1], p[2]}, {p[3], p[4], p[5]});
      EXPECT_LT(glm::distance(glm::vec3(next[3 * i], next[3 * i + 1], next[3 * i + 2]), expected),
                5e-3f * glm::length(expected) + 1e-4f)
          << i;
    }
    EXPECT_GT(others, kPlaces / 50);
    gl.reset();
    EXPECT_EQ(gl.irradiance({14, 2, 3}, {0, 1, 0}), glm::vec3(0.0f));
  }
}

// Nor while the eye walks, once there is room for what enters.
TEST_F(NestedCachesOnGl, framesMakeNoObject) {
  VoxelLevel level = hallOfBoxes();
  NestedVolumes volumes = volumesOf(level, 3, 8, {5, 2, 3});
  auto gl = LiveCachesGl::create({{16}, countingLoader(0), "", {}});
  ASSERT_TRUE(gl);
  const auto walk = [&](float from) {
    for (int f = 0; f < 5; ++f) {
      ASSERT_TRUE(*volumes.centre({from + 0.6f * static_cast<float>(f), 2, 3}));
      ASSERT_TRUE(gl->lightDirectly(volumes, {}));
      ASSERT_TRUE(gl->update(volumes, {}));
    }
  };
  walk(5.3f);
  forgetCalls(0);
  walk(5.2f);
  EXPECT_GT(calls(0, "glDispatchCompute"), 50);
  EXPECT_EQ(objectsMade(0), 0);
}

// As games call it: the light is the CPU's while the eye walks, in volumes within the level's and in one that follows.
TEST_F(NestedCachesOnGl, liveLightFollowsTheEye) {
  VoxelLevel level = hallOfBoxes();
  for (const bool boxFollowsEye : {false, true}) {
    LiveLightOptions options;
    options.cells = 8;
    options.cascades = 2;
    options.raysPerCell = 16;
    options.eyeWorld = {4, 2, 3};
    options.boxFollowsEye = boxFollowsEye;
    if (boxFollowsEye) options.boxMax = {6, 4, 6};
    options.getProcAddress = EglContext::getProcAddress;
    auto cpu = LiveLight::create(level.geometry(), options);
    options.backend = BackendKind::gl;
    auto gl = LiveLight::create(level.geometry(), options);
    ASSERT_TRUE(cpu && gl) << gl.error().message;
    const std::vector<Light> lights = lampOfHall();
    LightSetup setup;
    setup.lights = lights;
    LiveFrame frame;
    frame.sky.radiance = glm::vec3(0.5f);
    for (const float eye : {4.0f, 5.5f, 7.0f}) {
      for (LiveLight* const light : {&*cpu, &*gl}) {
        ASSERT_TRUE(light->centre({eye, 2, 3}));
        ASSERT_TRUE(light->update(setup, frame));
        ASSERT_TRUE(light->update(setup, frame));
      }
    }
    EXPECT_EQ(gl->caches(), cpu->caches());
    for (float x = -3.0f; x < 20.0f; x += 0.31f) {
      const glm::vec3 e = cpu->irradiance({x, 0, 2}, {0, 1, 0});
      EXPECT_LT(glm::distance(gl->irradiance({x, 0, 2}, {0, 1, 0}), e), 0.01f * glm::length(e) + 1e-4f) << x;
    }
    EXPECT_EQ(gl->irradiance({30, 0, 2}, {0, 1, 0}).x > 1.0f, boxFollowsEye) << "the sky, beyond";
    options.cascades = 5;
    EXPECT_FALSE(LiveLight::create(level.geometry(), options));
    options.cascades = 2;
  }
}

// Albedo 1 and volumes that walk: what is there goes round and never grows.
TEST_F(NestedCachesOnGl, aWhiteFurnaceStaysBounded) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(1.0f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {8, 2, 2}, true);
  NestedVolumes volumes = volumesOf(level, 3, 8, {4, 1, 1});
  LiveCachesGl gl = onGl(16);
  // Of what rays have met. Coefficients are sums of that, weighted by functions of at most 0.64.
  const auto brightestOf = [&] {
    float most = 0.0f;
    for (std::size_t l = 0; l < volumes.size(); ++l) {
      for (const float radiance : gl.brightest(l)) most = std::max(most, radiance);
    }
    for (std::size_t l = 0; l < volumes.size(); ++l) {
      for (const float c : gl.coefficients(l)) EXPECT_LE(std::abs(c), 0.64f * 4.0f * 3.14159265f * most);
    }
    return most;
  };
  LiveFrame frame;
  for (std::uint32_t f = 0; f < 60; ++f) {
    frame.raySet = f;
    ASSERT_TRUE(gl.update(volumes, frame));
  }
  const float lit = brightestOf();
  EXPECT_GT(lit, 30.0f);
  frame.emissionScale = glm::vec3(0.0f);
  for (std::uint32_t k = 0; k < 20; ++k) {
    ASSERT_TRUE(volumes.centre({4.0f + 3.5f * std::sin(0.8f * static_cast<float>(k)), 1, 1}));
    for (std::uint32_t f = 0; f < 2; ++f) {
      frame.raySet = 60 + 2 * k + f;
      ASSERT_TRUE(gl.update(volumes, frame));
    }
    EXPECT_LE(brightestOf(), lit) << k;
  }
}

}  // namespace
}  // namespace relume
