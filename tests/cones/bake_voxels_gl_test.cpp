// SPDX-License-Identifier: MIT
// Voxels lit by a bake in OpenGL against their twin on the CPU.
#include "runtime/live_gl/bake_voxels_gl.h"

#include "shaders/shared/layout.h"
#include "tests/cones/cones_gl_room.h"
#include "tests/live/lit_volumes.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <thread>
#include <utility>
#include <vector>

namespace relume {
namespace {

using namespace test;

// The room of a synthetic bake, with a lamp in it and a box that moves, neither of which the bake knows.
struct BakedRoom {
  Bake bake;
  VoxelLevel level;
  VoxelVolume volume;

  explicit BakedRoom(const glm::uvec3& grid = {4, 3, 4}) : bake(bakeOf(grid)), volume(make(level)) {}
  static Bake bakeOf(const glm::uvec3& grid) {
    SyntheticOptions options;
    options.grid = grid;
    options.surfels = 4096;
    options.kind = LinkKind::oct6;
    return makeSyntheticBake(options);
  }
  static VoxelVolume make(VoxelLevel& level) {
    level.surfaces = {{glm::vec3(0.6f)}, {glm::vec3(0.2f), glm::vec3(3.0f, 2.0f, 1.0f)}, {glm::vec3(0.3f, 0.6f, 0.9f)}};
    level.addBox({0, 0, 0}, {12, 4, 6}, true);
    level.addBox({4.0f, 2.5f, 2.0f}, {4.5f, 3.0f, 2.5f}, false, 1);
    level.addBox({-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}, false, 2);
    level.parts.back().moves = true;
    level.parts.back().toWorld[3] = {8.0f, 1.5f, 3.0f};
    return volumeOf(level, coarse(8));
  }
};

std::vector<Light> lampOf(float power) {
  std::vector<Light> lights(1);
  lights[0].intensity = power * glm::vec3(1.0f, 0.8f, 0.6f);
  lights[0].positionWorld = {6.0f, 3.0f, 2.0f};
  return lights;
}

// Dark beyond a plane, by the same arithmetic as kDarkHalf.
float darkHalf(std::uint32_t, const glm::vec3& position, const glm::vec3&) { return position.x > 8.0f ? 0.0f : 1.0f; }
const char* const kDarkHalf = "float relumeVisibility(uint light, vec3 p, vec3 n) { return p.x > 8.0 ? 0.0 : 1.0; }\n";

BakeVoxelsGl onGlOf(const Relighter& relighter) {
  auto made =
      BakeVoxelsGl::create({relighter.lumaBands(), relighter.chromaBands(), EglContext::getProcAddress, kDarkHalf});
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

class BakeVoxelsOnGl : public GlTest {};

TEST_F(BakeVoxelsOnGl, sendOutWhatTheCpuFinds) {
  BakedRoom room;
  // Threads that have no context look into the grid as well.
  room.volume.useParallelFor([](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    std::vector<std::thread> threads;
    for (std::uint32_t t = 0; t < tasks; ++t) threads.emplace_back(body, t);
    for (std::thread& thread : threads) thread.join();
  });
  for (const int bands : {2, 4}) {
    Relighter relighter = makeRelighter(room.bake, BackendKind::gl, bands, 2, kDarkHalf);
    BakeVoxelsGl gl = onGlOf(relighter);
    auto surfels = SurfelVoxels::create(room.volume, room.bake);
    ASSERT_TRUE(surfels);
    ASSERT_GT(surfels->covered(), 0.5f);
    ASSERT_LT(surfels->covered(), 1.0f);
    for (int f = 0; f < 4; ++f) {
      glm::mat4x3 to(1.0f);
      to[3] = {8.0f - static_cast<float>(f), 1.5f, 3.0f};
      ASSERT_TRUE(room.volume.move(std::vector<glm::mat4x3>{to}));
      const std::vector<Light> lights = lampOf(10.0f + static_cast<float>(f));
      LightSetup setup;
      setup.lights = lights;
      ASSERT_TRUE(relighter.relight(setup));
      const glm::vec3 emission(1.0f, 0.5f, 2.0f);
      ASSERT_TRUE(gl.light(room.volume, *surfels, relighter.gl()->inputs(), lights, emission));
      setup.visibility = darkHalf;
      ASSERT_TRUE(room.volume.lightDirectly(setup));
      ASSERT_TRUE(surfels->light(room.volume, relighter, emission));
      std::vector<glm::vec3> expected;
      for (const VoxelRadiance& r : room.volume.radiance()) {
        expected.push_back(r.front());
        expected.push_back(r.back());
      }
      const std::vector<glm::vec3> found = gl.radiance();
      EXPECT_LE(relativeRmse<glm::vec3>(expected, found), 1e-4) << "frame " << f << ", " << bands << " bands";
      // What moves has none but the grid's light, and the lamp's.
      const std::size_t standing = room.volume.standingSides();
      EXPECT_LE(relativeRmse(std::span(std::as_const(expected)).subspan(standing), std::span(found).subspan(standing)),
                1e-4)
          << "frame " << f;

      // Cones read the same levels.
      RadianceMips mips(Directions::six);
      ASSERT_TRUE(mips.update(room.volume));
      ConesGl cones = onGl({});
      ASSERT_TRUE(cones.fill(room.volume, gl.sides()));
      for (std::uint32_t l = 1; l <= cones.levels(); ++l)
        EXPECT_LE(relativeRmse(mips.texels(l), cones.texels(l)), 1e-4) << "frame " << f << ", level " << l;
    }
  }
}

// A bake without a grid: what has no surfels reflects direct light alone.
TEST_F(BakeVoxelsOnGl, doWithoutAGrid) {
  BakedRoom room(glm::uvec3(0));
  Relighter relighter = makeRelighter(room.bake, BackendKind::gl, 0, 0, kDarkHalf);
  BakeVoxelsGl gl = onGlOf(relighter);
  const auto surfels = SurfelVoxels::create(room.volume, room.bake);
  ASSERT_TRUE(surfels);
  const std::vector<Light> lights = lampOf(10.0f);
  LightSetup setup;
  setup.lights = lights;
  ASSERT_TRUE(relighter.relight(setup));
  ASSERT_TRUE(gl.light(room.volume, *surfels, relighter.gl()->inputs(), lights, glm::vec3(1.0f)));
  float lit = 0.0f;
  const std::vector<glm::vec3> radiance = gl.radiance();
  for (std::uint32_t s = room.volume.standingSides(); s < room.volume.sideCount(); ++s) {
    ASSERT_TRUE(std::isfinite(radiance[s].x)) << s;
    lit = std::max(lit, radiance[s].x);
  }
  EXPECT_GT(lit, 0.0f);
}

TEST_F(BakeVoxelsOnGl, refuseByName) {
  BakedRoom room;
  Relighter relighter = makeRelighter(room.bake, BackendKind::gl, 0, 0, kDarkHalf);
  BakeVoxelsGl gl = onGlOf(relighter);
  const auto surfels = SurfelVoxels::create(room.volume, room.bake);
  ASSERT_TRUE(surfels);
  std::vector<Light> lights = lampOf(10.0f);
  LightSetup setup;
  setup.lights = lights;
  ASSERT_TRUE(relighter.relight(setup));
  const GlResolveInputs inputs = relighter.gl()->inputs();
  ASSERT_TRUE(gl.light(room.volume, *surfels, inputs, lights, glm::vec3(1.0f)));
  const std::vector<glm::vec3> before = gl.radiance();

  for (const float scale : {-1.0f, 2e9f, std::numeric_limits<float>::quiet_NaN()}) {
    const Status refused = gl.light(room.volume, *surfels, inputs, lights, glm::vec3(scale));
    ASSERT_FALSE(refused) << scale;
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
  }
  lights[0].intensity.y = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(gl.light(room.volume, *surfels, inputs, lights, glm::vec3(1.0f)));
  const Status none = gl.light(room.volume, *surfels, GlResolveInputs{}, lampOf(10.0f), glm::vec3(1.0f));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::usage);
  EXPECT_NE(none.error().message.find("of a GL relighter"), std::string::npos) << none.error().message;
  EXPECT_EQ(gl.radiance(), before);
  ASSERT_TRUE(room.volume.edit(std::vector<PartEdit>{{1}}));
  const Status stale = gl.light(room.volume, *surfels, inputs, lampOf(10.0f), glm::vec3(1.0f));
  ASSERT_FALSE(stale);
  EXPECT_EQ(stale.error().code, ErrorCode::usage);
  EXPECT_FALSE(BakeVoxelsGl::create({}));
}

// Frames make nothing, also where the box moves, and put back what they bind.
TEST_F(BakeVoxelsOnGl, framesMakeNoObjects) {
  BakedRoom room;
  Relighter relighter = makeRelighter(room.bake, BackendKind::gl, 0, 0, kDarkHalf);
  auto gl = BakeVoxelsGl::create({relighter.lumaBands(), relighter.chromaBands(), countingLoader(0), kDarkHalf});
  ASSERT_TRUE(gl);
  const auto surfels = SurfelVoxels::create(room.volume, room.bake);
  ASSERT_TRUE(surfels);
  const std::vector<Light> lights = lampOf(10.0f);
  LightSetup setup;
  setup.lights = lights;
  const auto frame = [&](float x) {
    glm::mat4x3 to(1.0f);
    to[3] = {x, 1.5f, 3.0f};
    EXPECT_TRUE(room.volume.move(std::vector<glm::mat4x3>{to}));
    EXPECT_TRUE(relighter.relight(setup));
    EXPECT_TRUE(gl->light(room.volume, *surfels, relighter.gl()->inputs(), lights, glm::vec3(1.0f)));
  };
  frame(8.0f);
  forgetCalls(0);
  GLint bound[3]{};
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, RELUME_LIVE_SLOT_NODES, relighter.gl()->inputs().caches);
  for (int f = 0; f < 5; ++f) frame(7.5f - 0.3f * static_cast<float>(f));
  EXPECT_EQ(objectsMade(0), 0);
  EXPECT_EQ(objectsDeleted(0), 0);
  glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, RELUME_LIVE_SLOT_NODES, &bound[0]);
  EXPECT_EQ(static_cast<GLuint>(bound[0]), relighter.gl()->inputs().caches);
  glGetIntegerv(GL_CURRENT_PROGRAM, &bound[1]);
  glGetIntegeri_v(GL_UNIFORM_BUFFER_BINDING, RELUME_RESOLVE_SLOT_UNIFORMS, &bound[2]);
  EXPECT_EQ(bound[1], 0);
  EXPECT_EQ(bound[2], 0);
  EXPECT_GT(gl->bufferSizes().size(), 2u);
}

}  // namespace
}  // namespace relume
