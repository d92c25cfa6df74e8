// SPDX-License-Identifier: MIT
// relume/live_light.h: what games call, on either backend.
#include "relume/live_light.h"

#include "tests/runtime/gl_test_support.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kPi = std::numbers::pi_v<float>;

class LiveLights : public GlTest {
 protected:
  static LiveLightOptions options(BackendKind backend) {
    LiveLightOptions options;
    options.backend = backend;
    options.cells = 16;
    if (backend == BackendKind::gl) options.getProcAddress = EglContext::getProcAddress;
    return options;
  }
  static LiveLight made(VoxelLevel& level, const LiveLightOptions& options) {
    auto light = LiveLight::create(level.geometry(), options);
    EXPECT_TRUE(light) << light.error().message;
    return std::move(*light);
  }
  static std::vector<Light> lampAt(const glm::vec3& positionWorld) {
    std::vector<Light> lights(1);
    lights[0].positionWorld = positionWorld;
    lights[0].intensity = {10, 10, 10};
    return lights;
  }
  static void addMovingBox(VoxelLevel& level, const glm::vec3& at, std::uint32_t surface) {
    level.addBox(glm::vec3(-0.4f), glm::vec3(0.4f), false, surface);
    level.parts.back().moves = true;
    level.parts.back().toWorld[3] = at;
  }
  static void frames(LiveLight& light, const LightSetup& setup, std::uint32_t count, float keep = 0.0f) {
    for (std::uint32_t f = 0; f < count; ++f) {
      LiveFrame frame;
      frame.raySet = f;
      frame.keep = f > 8 ? keep : 0.0f;
      const Status ok = light.update(setup, frame);
      ASSERT_TRUE(ok) << ok.error().message;
    }
  }
};

// Emission L and albedo a in a closed room: L / (1 - a) from all sides.
TEST_F(LiveLights, aFurnaceIsClosedOnBothBackends) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(0.5f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  for (const BackendKind backend : {BackendKind::cpu, BackendKind::gl}) {
    LiveLight light = made(level, options(backend));
    frames(light, {}, 20);
    EXPECT_NEAR(light.irradiance({2, 0, 2}, {0, 1, 0}).x, 2.0f * kPi, 0.04f * kPi);
    EXPECT_GT(light.voxels().occupied, 3000u);
    EXPECT_GT(light.caches(), 1000u);
    light.reset();
    EXPECT_EQ(light.irradiance({2, 0, 2}, {0, 1, 0}), glm::vec3(0.0f));
  }
}

// What is far from surfaces has the light of the nearest caches in sight, and none of those behind a wall.
TEST_F(LiveLights, openAirIsLitOnBothBackends) {
  VoxelLevel plane;
  plane.surfaces[0] = {glm::vec3(0.5f)};
  plane.addQuad({-10, 0, -10}, {-10, 0, 10}, {10, 0, 10}, {10, 0, -10});
  VoxelLevel rooms;
  rooms.surfaces = {{glm::vec3(0.5f)}, {glm::vec3(0.5f), glm::vec3(1.0f)}};
  rooms.addBox({0, 0, 0}, {8, 8, 8}, true, 1);
  rooms.addBox({8.5f, 0, 0}, {16, 8, 8}, true);
  for (const BackendKind backend : {BackendKind::cpu, BackendKind::gl}) {
    LiveLightOptions high = options(backend);
    high.boxMin = {-10, -1, -10};
    high.boxMax = {10, 19, 10};
    LiveLight open = made(plane, high);
    LiveFrame frame;
    frame.sky.radiance = glm::vec3(1.0f);
    for (frame.raySet = 0; frame.raySet < 20; ++frame.raySet) ASSERT_TRUE(open.update({}, frame));
    float before = open.irradiance({0.3f, 0, 0.2f}, {0, -1, 0}).x;
    for (float y = 0.25f; y < 18.0f; y += 0.25f) {
      EXPECT_NEAR(open.irradiance({0.3f, y, 0.2f}, {0, 1, 0}).x, kPi, 0.05f * kPi) << y;
      // Beneath it, half of what the sky gives.
      const float below = open.irradiance({0.3f, y, 0.2f}, {0, -1, 0}).x;
      EXPECT_NEAR(below, y < 1.0f ? below : before, 0.1f * kPi) << y;
      before = below;
    }
    EXPECT_NEAR(before, 0.5f * kPi, 0.15f * kPi);
    EXPECT_EQ(open.irradiance({0, 19.5f, 0}, {0, 1, 0}), glm::vec3(0.0f)) << "out of the box";
    EXPECT_EQ(open.irradiance({0, 12, 0}, glm::vec3(std::numeric_limits<float>::quiet_NaN())), glm::vec3(0.0f));
    LiveLight closed = made(rooms, options(backend));
    frames(closed, {}, 20);
    EXPECT_NEAR(closed.irradiance({4, 4, 4}, {0, 0, 1}).x, 2.0f * kPi, 0.04f * kPi);
    EXPECT_EQ(closed.irradiance({12.5f, 4, 4}, {-1, 0, 0}), glm::vec3(0.0f));
    closed.reset();
    EXPECT_EQ(closed.irradiance({4, 4, 4}, {0, 0, 1}), glm::vec3(0.0f));
  }
}

// A lamp in shadow, a wall that is taken away, a box that moves: each backend follows, and both have one light.
TEST_F(LiveLights, bothBackendsFollowLampsWallsAndMovingParts) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.6f, 0.5f, 0.4f)}, {glm::vec3(0.3f, 0.6f, 0.2f)}};
  level.addBox({0, 0, 0}, {6, 3, 4}, true);
  level.addBox({2.9f, 0, 0}, {3.1f, 3, 4}, false);  // between lamp and dark room
  addMovingBox(level, {1.2f, 0.5f, 1.2f}, 1);
  const std::vector<Light> lights = lampAt({0.8f, 2.4f, 2.0f});
  LightSetup setup;
  setup.lights = lights;
  // Half of it is hidden, and beyond the wall all, on both.
  setup.visibility = [](std::uint32_t, const glm::vec3& p, const glm::vec3&) { return p.x < 2.95f ? 0.5f : 0.0f; };
  LiveLightOptions onGl = options(BackendKind::gl);
  onGl.visibilityGlsl = "float relumeVisibility(uint light, vec3 p, vec3 n) { return p.x < 2.95 ? 0.5 : 0.0; }\n";
  LiveLight cpu = made(level, options(BackendKind::cpu)), gl = made(level, onGl);
  ASSERT_EQ(cpu.gl(), nullptr);
  ASSERT_NE(gl.gl(), nullptr);
  const auto expectSame = [&] {
    double off = 0.0, sum = 0.0;
    for (float x = 0.3f; x < 6.0f; x += 0.4f) {
      for (float z = 0.3f; z < 4.0f; z += 0.5f) {
        const glm::vec3 a = cpu.irradiance({x, 0, z}, {0, 1, 0}), b = gl.irradiance({x, 0, z}, {0, 1, 0});
        off += static_cast<double>(std::abs(a.y - b.y));
        sum += static_cast<double>(a.y);
      }
    }
    EXPECT_GT(sum, 0.0);
    EXPECT_LE(off, 2e-3 * sum);
  };
  const glm::vec3 darkRoom{4.5f, 0, 2}, up{0, 1, 0};
  for (LiveLight* light : {&cpu, &gl}) frames(*light, setup, 6);
  expectSame();
  EXPECT_LT(cpu.irradiance(darkRoom, up).y, 1e-3f * cpu.irradiance({1.5f, 0, 3}, up).y);
  for (LiveLight* light : {&cpu, &gl}) {
    ASSERT_TRUE(light->edit(std::vector<PartEdit>{{1, glm::mat4x3(1.0f), false}}));
    glm::mat4x3 to(1.0f);
    to[3] = {4.8f, 0.5f, 1.0f};
    ASSERT_TRUE(light->move(std::vector<glm::mat4x3>{to}));
    frames(*light, setup, 6);
  }
  expectSame();
  EXPECT_GT(cpu.irradiance(darkRoom, up).y, 0.05f * cpu.irradiance({1.5f, 0, 3}, up).y);
  for (const LiveLight* light : {&cpu, &gl}) {
    const std::vector<PassTime> times = light->passTimes();
    ASSERT_EQ(times.size(), 6u);
    for (std::size_t i = 0; i < times.size(); ++i) {
      const char* const names[] = {"voxelise", "move", "cells", "direct", "bounce", "gather"};
      EXPECT_STREQ(times[i].pass, names[i]);
    }
    std::size_t bytes = 0;
    for (const auto& [name, size] : light->bufferSizes()) bytes += size;
    EXPECT_GT(bytes, 100000u);
  }
}

// A frozen frame after a wall or the eye has moved has the light of one that is not frozen: new voxels have none to
// keep.
TEST_F(LiveLights, frozenFramesFollowWallsPartsAndTheEye) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(0.5f)};
  level.addBox({0, 0, 0}, {10, 3, 4}, true);
  level.addBox({5.0f, 0, 0}, {5.2f, 3, 2.5f}, false);
  addMovingBox(level, {1.2f, 0.5f, 3.2f}, 0);
  const std::vector<Light> lights = lampAt({1.5f, 2.4f, 2.0f});
  LightSetup setup;
  setup.lights = lights;
  enum Change { kWall, kPart, kEye };
  for (const BackendKind backend : {BackendKind::cpu, BackendKind::gl}) {
    LiveLightOptions wanted = options(backend);
    wanted.cascades = 2;
    wanted.eyeWorld = {2, 1.5f, 2};
    LiveLight thawed = made(level, wanted), frozen = made(level, wanted);
    for (const Change change : {kWall, kPart, kEye}) {
      std::vector<glm::vec3> light[2];
      for (LiveLight* live : {&thawed, &frozen}) {
        frames(*live, setup, 5);
        glm::mat4x3 to(1.0f);
        if (change == kWall) {
          to[3] = {0.7f, 0, 0};
          ASSERT_TRUE(live->edit(std::vector<PartEdit>{{1, to, true}}));
        } else if (change == kPart) {
          to[3] = {3.5f, 0.5f, 1.0f};
          ASSERT_TRUE(live->move(std::vector<glm::mat4x3>{to}));
        } else {
          ASSERT_TRUE(*live->centre({8, 1.5f, 2}));
        }
        LiveFrame frame;
        frame.freezeVoxels = live == &frozen;
        ASSERT_TRUE(live->update(setup, frame));
        for (float x = 0.4f; x < 10.0f; x += 0.8f)
          light[live == &frozen ? 1 : 0].push_back(live->irradiance({x, 0, 2}, {0, 1, 0}));
      }
      for (std::size_t i = 0; i < light[0].size(); ++i)
        EXPECT_NEAR(light[1][i].x, light[0][i].x, 0.05f * light[0][i].x) << change << " at " << i;
    }
  }
}

TEST_F(LiveLights, whatIsRefusedIsNamedAndChangesNothing) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(0.5f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  const auto refused = [&](const LiveLightOptions& options, const char* what) {
    const auto light = LiveLight::create(level.geometry(), options);
    ASSERT_FALSE(light);
    EXPECT_EQ(light.error().code, ErrorCode::usage);
    EXPECT_NE(light.error().message.find(what), std::string::npos) << light.error().message;
  };
  LiveLightOptions bad;
  bad.cells = 7;
  refused(bad, "cells");
  bad = {};
  bad.raysPerCell = 5000;
  refused(bad, "rays");
  bad = {};
  bad.backend = BackendKind::gl;
  refused(bad, "getProcAddress");
  bad = {};
  bad.boxMin.x = std::numeric_limits<float>::quiet_NaN();
  refused(bad, "box");
  level.meshes[0].triangle[3].y = 99;
  refused({}, "triangle 3");
  level.meshes[0].triangle[3].y = 0;
  for (const BackendKind backend : {BackendKind::cpu, BackendKind::gl}) {
    LiveLight light = made(level, options(backend));
    frames(light, {}, 3);
    const glm::vec3 before = light.irradiance({2, 0, 2}, {0, 1, 0});
    std::vector<Light> lights(1);
    lights[0].intensity.x = -1.0f;
    LightSetup setup;
    setup.lights = lights;
    LiveFrame frame;
    EXPECT_FALSE(light.update(setup, frame));
    frame.keep = 1.0f;
    EXPECT_FALSE(light.update({}, frame));
    EXPECT_FALSE(light.move(std::vector<glm::mat4x3>(1)));
    EXPECT_FALSE(light.edit(std::vector<PartEdit>{{1}}));
    EXPECT_EQ(light.irradiance({2, 0, 2}, {0, 1, 0}), before);
  }
}

}  // namespace
}  // namespace relume
