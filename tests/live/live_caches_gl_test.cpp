// SPDX-License-Identifier: MIT
// The OpenGL passes of light without a bake against their twins on the CPU.
#include "runtime/live_gl/live_caches_gl.h"

#include "tests/live/irradiance_by_shader.h"
#include "tests/live/lit_volumes.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

// A room with a block, a glowing panel, a thin wall and a ball-like box that moves.
VoxelLevel room() {
  VoxelLevel level;
  level.surfaces = {
      {glm::vec3(0.7f, 0.6f, 0.5f)}, {glm::vec3(0.4f), glm::vec3(6.0f, 4.0f, 2.0f)}, {glm::vec3(0.2f, 0.5f, 0.8f)}};
  level.addBox({0, 0, 0}, {6, 3, 5}, true);
  level.addBox({1.0f, 0, 1.0f}, {2.2f, 1.4f, 1.8f}, false, 2);
  level.addBox({3.49f, 0, 0}, {3.51f, 3, 3.5f}, false);
  level.addQuad({1, 2.9f, 2}, {2, 2.9f, 2}, {2, 2.9f, 3}, {1, 2.9f, 3}, 1);
  level.addBox({-0.3f, -0.3f, -0.3f}, {0.3f, 0.3f, 0.3f}, false, 2);
  level.parts.back().moves = true;
  level.parts.back().toWorld[3] = {2.6f, 0.6f, 3.6f};
  return level;
}

std::vector<Light> lamps() {
  std::vector<Light> lights(3);
  lights[0].kind = LightKind::point;
  lights[0].positionWorld = {5, 2.2f, 1.5f};
  lights[0].intensity = {8, 6, 4};
  lights[0].range = 9.0f;
  lights[1].kind = LightKind::spot;
  lights[1].positionWorld = {0.5f, 2.5f, 4.5f};
  lights[1].direction = glm::normalize(glm::vec3(1, -1, -1));
  lights[1].innerConeRad = 0.3f;
  lights[1].outerConeRad = 0.7f;
  lights[1].intensity = {3, 9, 12};
  lights[2].kind = LightKind::directional;
  lights[2].direction = glm::normalize(glm::vec3(-0.4f, -1, 0.2f));
  lights[2].intensity = {1, 1, 2};
  return lights;
}

// Half in shadow, by the same arithmetic as kHalfShadow.
float halfShadow(std::uint32_t light, const glm::vec3& position, const glm::vec3&) {
  return light == 2 && position.x > 3.0f ? 0.0f : light == 0 ? 2.0f : 0.5f;
}
const char* const kHalfShadow =
    "float relumeVisibility(uint light, vec3 p, vec3 n) { return light == 2u && p.x > 3.0 ? 0.0 : light == 0u ? 2.0 : "
    "0.5; }\n";

class LiveCachesOnGl : public GlTest {
 protected:
  static LiveCachesGl made(std::uint32_t rays, const char* visibility = "",
                           std::optional<gpu::GroupThreads> groups = {}) {
    auto light = LiveCachesGl::create({{rays}, EglContext::getProcAddress, visibility, groups});
    EXPECT_TRUE(light) << light.error().message;
    return std::move(*light);
  }

  LiveCachesGl litByLamps(const VoxelVolume& volume) {
    const std::vector<Light> lights = lamps();
    LightSetup setup;
    setup.lights = lights;
    LiveCachesGl gl = made(32);
    EXPECT_TRUE(gl.lightDirectly(volume, setup));
    EXPECT_TRUE(gl.update(volume, {}));
    return gl;
  }

  // How many caches have a coefficient that is off by more than 2e-3 of their first.
  static std::size_t countOff(const LiveCaches& cpu, const LiveCachesGl& gl) {
    const std::vector<float> found = gl.coefficients();
    EXPECT_EQ(found.size(), cpu.coefficients().size());
    std::size_t off = 0;
    for (std::size_t c = 0; c + 27 <= found.size(); c += 27) {
      float most = 0.0f, first = 1e-6f;
      for (std::size_t k = 0; k < 27; ++k) most = std::max(most, std::abs(found[c + k] - cpu.coefficients()[c + k]));
      for (const std::size_t k : {0u, 9u, 18u}) first = std::max(first, std::abs(cpu.coefficients()[c + k]));
      if (!(most <= 2e-3f * first)) ++off;
    }
    return off;
  }
};

// Of what is no place or direction a shader has what the CPU has: no light.
TEST_F(LiveCachesOnGl, placesThatAreNoneAreDark) {
  VoxelLevel level = room();
  const VoxelVolume volume = volumeOf(level, coarse(8));
  const LiveCachesGl gl = litByLamps(volume);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const std::vector<glm::vec3> odd{{nan, 1, 1},    {1, -nan, 1},  {1, 1, inf},   {-inf, 1, 1},
                                   glm::vec3(nan), {1e30f, 1, 1}, {1, 1, -1e38f}};
  std::vector<float> places;
  for (const glm::vec3& each : odd) {
    places.insert(places.end(), {each.x, each.y, each.z, 0, 1, 0});
    places.insert(places.end(), {4.5f, 0.5f, 2.0f, each.x, each.y, each.z});
  }
  const std::vector<float> found = irradianceByShader(gl, places);
  for (std::size_t i = 0; 6 * i < places.size(); ++i) {
    const float* const p = &places[6 * i];
    const glm::vec3 expected = gl.irradiance({p[0], p[1], p[2]}, {p[3], p[4], p[5]});
    const bool isUnit = std::isfinite(p[3]) && std::isfinite(p[4]) && std::isfinite(p[5]) &&
                        glm::length(glm::vec3(p[3], p[4], p[5])) < 2.0f;
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(std::isfinite(found[3 * i + static_cast<std::size_t>(c)])) << i;
      if (isUnit || !std::isfinite(p[3] + p[4] + p[5])) {
        EXPECT_EQ(expected[c], 0.0f) << i;
        EXPECT_EQ(found[3 * i + static_cast<std::size_t>(c)], 0.0f) << i;
      }
    }
  }
}

// By a sampler that filters, textures of integers would read as nothing.
TEST_F(LiveCachesOnGl, samplersAndTheActiveUnitOfTheHostAreNoMatter) {
  VoxelLevel level = room();
  const VoxelVolume volume = volumeOf(level, coarse(8));
  const LiveCachesGl gl = litByLamps(volume);
  const std::vector<float> places = placesInBox(200, {0, 0, 0}, {6, 3, 5}), expected = irradianceByShader(gl, places);
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0.0f);
  GLuint sampler = 0;
  glGenSamplers(1, &sampler);
  glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  for (const GLuint unit : {12u, 13u, 14u}) glBindSampler(unit, sampler);
  glActiveTexture(GL_TEXTURE0 + 3);
  EXPECT_EQ(irradianceByShader(gl, places), expected);
  GLint active = 0;
  glGetIntegerv(GL_ACTIVE_TEXTURE, &active);
  EXPECT_EQ(active, GL_TEXTURE0 + 3);
  glDeleteSamplers(1, &sampler);
}

TEST_F(LiveCachesOnGl, eachPassIsItsTwins) {
  VoxelLevel level = room();
  VoxelVolume volume = volumeOf(level, coarse(16));
  const std::vector<Light> lights = lamps();
  LightSetup setup;
  setup.lights = lights;
  setup.visibility = halfShadow;
  ASSERT_TRUE(volume.lightDirectly(setup));
  std::vector<glm::vec3> map(16 * 16);
  for (std::size_t i = 0; i < map.size(); ++i) map[i] = {0.1f, 0.2f, 0.01f * static_cast<float>(i % 16)};
  for (const auto groups : {gpu::GroupThreads::serial, gpu::GroupThreads::parallel}) {
    LiveCaches cpu = light(96);
    LiveCachesGl gl = made(96, kHalfShadow, groups);
    ASSERT_TRUE(gl.lightDirectly(volume, setup));
    for (std::uint32_t f = 0; f < 5; ++f) {
      LiveFrame frame;
      frame.raySet = f;
      frame.keep = f < 2 ? 0.0f : 0.4f;
      frame.bounceScale = 0.9f;
      frame.emissionScale = {1.0f, 0.5f, 2.0f};
      frame.sky.map = map;
      frame.sky.side = 16;
      frame.freezeVoxels = f == 4;
      ASSERT_TRUE(cpu.update(volume, frame));
      ASSERT_TRUE(gl.update(volume, frame));
      ASSERT_EQ(gl.activeCells(), cpu.activeCells());
      ASSERT_GT(cpu.activeCells(), 500u);
      EXPECT_LE(countOff(cpu, gl), cpu.activeCells() / 1000) << "frame " << f;
      const std::vector<float> brightest = gl.brightest();
      std::size_t off = 0;
      for (std::size_t i = 0; i < brightest.size(); ++i)
        off += std::abs(brightest[i] - cpu.brightest()[i]) > 2e-3f * cpu.brightest()[i] + 1e-6f ? 1 : 0;
      EXPECT_LE(off, brightest.size() / 1000);
    }
    // What the sides send out: direct light, emission, bounces.
    const std::vector<glm::vec3> radiance = gl.radiance();
    ASSERT_EQ(radiance.size(), volume.sideCount());
    std::size_t off = 0;
    for (std::uint32_t s = 0; s < volume.sideCount(); ++s) {
      const glm::vec3 side = volume.radianceOf(s);
      if (glm::distance(radiance[s], side) > 2e-3f * glm::length(side) + 1e-5f) ++off;
    }
    EXPECT_LE(off, radiance.size() / 1000);
  }
}

// Parts that move and are edited: caches keep their light by place, new ones begin with what they gather.
TEST_F(LiveCachesOnGl, followsAVolumeThatChanges) {
  VoxelLevel level = room();
  VoxelVolume volume = volumeOf(level, coarse(16));
  const std::vector<Light> lights = lamps();
  LightSetup setup;
  setup.lights = lights;
  LiveCaches cpu = light(64);
  LiveCachesGl gl = made(64);
  const auto frames = [&](int count) {
    ASSERT_TRUE(volume.lightDirectly(setup));
    for (int f = 0; f < count; ++f) {
      // By its own pass, and as the CPU found it.
      ASSERT_TRUE(f % 2 == 0 ? gl.lightDirectly(volume, setup) : gl.copyDirect(volume));
      LiveFrame frame;
      frame.raySet = static_cast<std::uint32_t>(f);
      frame.keep = 0.5f;
      ASSERT_TRUE(cpu.update(volume, frame));
      ASSERT_TRUE(gl.update(volume, frame));
      ASSERT_EQ(gl.activeCells(), cpu.activeCells());
      EXPECT_LE(countOff(cpu, gl), cpu.activeCells() / 500 + 1);
    }
  };
  frames(4);
  for (int step = 1; step <= 3; ++step) {
    glm::mat4x3 to(1.0f);
    to[3] = {2.6f + 0.7f * static_cast<float>(step), 0.8f, 3.6f};
    ASSERT_TRUE(volume.move(std::vector<glm::mat4x3>{to}));
    frames(1);
  }
  ASSERT_TRUE(volume.edit(std::vector<PartEdit>{{2, glm::mat4x3(1.0f), false}}));
  frames(3);
  gl.reset();
  for (const float c : gl.coefficients()) ASSERT_EQ(c, 0.0f);
  // Another volume, of other cells.
  volume = volumeOf(level, coarse(12));
  cpu.reset();
  frames(2);
}

TEST_F(LiveCachesOnGl, aShaderReadsTheLightAsTheCpuDoes) {
  VoxelLevel level = room();
  VoxelVolume volume = volumeOf(level, coarse(16));
  LightSetup setup;
  const std::vector<Light> lights = lamps();
  setup.lights = lights;
  ASSERT_TRUE(volume.lightDirectly(setup));
  LiveCaches cpu = light(64);
  LiveCachesGl gl = made(64);
  ASSERT_TRUE(gl.lightDirectly(volume, setup));
  for (int f = 0; f < 3; ++f) {
    ASSERT_TRUE(cpu.update(volume, {}));
    ASSERT_TRUE(gl.update(volume, {}));
  }
  constexpr std::size_t kPlaces = 2000;
  const std::vector<float> places = placesInBox(kPlaces, glm::vec3(0.0f), {6, 3, 5});
  const std::vector<float> found = irradianceByShader(gl, places);
  std::size_t off = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const float* const p = &places[6 * i];
    const glm::vec3 expected = cpu.irradiance({p[0], p[1], p[2]}, {p[3], p[4], p[5]});
    sum += static_cast<double>(expected.g);
    if (glm::distance(glm::vec3(found[3 * i], found[3 * i + 1], found[3 * i + 2]), expected) >
        5e-3f * glm::length(expected) + 1e-4f)
      ++off;
  }
  EXPECT_GT(sum, 0.1 * kPlaces);
  EXPECT_LE(off, kPlaces / 100);
}

// Nor do parts that move, once there is room for them.
TEST_F(LiveCachesOnGl, framesMakeNoObject) {
  VoxelLevel level = room();
  VoxelVolume volume = volumeOf(level, coarse(16));
  auto gl = LiveCachesGl::create({{32}, countingLoader(0), "", {}});
  ASSERT_TRUE(gl);
  const std::vector<Light> lights = lamps();
  LightSetup setup;
  setup.lights = lights;
  ASSERT_TRUE(gl->lightDirectly(volume, setup));
  ASSERT_TRUE(gl->update(volume, {}));
  forgetCalls(0);
  for (int f = 0; f < 5; ++f) {
    glm::mat4x3 to(1.0f);
    to[3] = {2.6f, 0.6f + 0.05f * static_cast<float>(f), 3.6f};
    ASSERT_TRUE(volume.move(std::vector<glm::mat4x3>{to}));
    ASSERT_TRUE(gl->lightDirectly(volume, setup));
    ASSERT_TRUE(gl->update(volume, {}));
  }
  EXPECT_GT(calls(0, "glDispatchCompute"), 10);
  EXPECT_EQ(objectsMade(0), 0);
}

TEST_F(LiveCachesOnGl, whatIsRefusedChangesNothing) {
  EXPECT_FALSE(LiveCachesGl::create({{7}, EglContext::getProcAddress, "", {}}));
  EXPECT_FALSE(LiveCachesGl::create({{64}, {}, "", {}}));
  const auto bad =
      LiveCachesGl::create({{64}, EglContext::getProcAddress, "float relumeVisibility() { return nothing; }\n", {}});
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().message.find("live_direct.comp"), std::string::npos) << bad.error().message;
  context_->forgetErrors();
  const auto clash = LiveCachesGl::create({{64},
                                           EglContext::getProcAddress,
                                           "layout(std430, binding = 5) readonly buffer Shadow { float shadow[]; };\n"
                                           "float relumeVisibility(uint l, vec3 p, vec3 n) { return shadow[l]; }\n",
                                           {}});
  ASSERT_FALSE(clash);
  EXPECT_EQ(clash.error().code, ErrorCode::usage);
  EXPECT_NE(clash.error().message.find("storage block Shadow has binding 5 in live_direct.comp"), std::string::npos)
      << clash.error().message;
  VoxelLevel level = room();
  VoxelVolume volume = volumeOf(level, coarse(8));
  LiveCachesGl gl = made(32);
  ASSERT_TRUE(gl.update(volume, {}));
  const std::vector<float> before = gl.coefficients();
  LiveFrame frame;
  frame.keep = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(gl.update(volume, frame));
  std::vector<Light> lights(1);
  lights[0].intensity.x = -1.0f;
  LightSetup setup;
  setup.lights = lights;
  EXPECT_FALSE(gl.lightDirectly(volume, setup));
  EXPECT_EQ(gl.coefficients(), before);
}

TEST_F(LiveCachesOnGl, bindingsOfTheHostAreAsTheyWere) {
  VoxelLevel level = room();
  VoxelVolume volume = volumeOf(level, coarse(8));
  LiveCachesGl gl = made(32);
  GLuint buffer = 0, texture = 0;
  glGenBuffers(1, &buffer);
  glGenTextures(1, &texture);
  for (GLuint slot = 0; slot < 6; ++slot) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, slot, buffer);
  for (GLuint unit = 12; unit < 16; ++unit) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, texture);
  }
  glActiveTexture(GL_TEXTURE0 + 5);
  ASSERT_TRUE(gl.lightDirectly(volume, {}));
  ASSERT_TRUE(gl.update(volume, {}));
  gl.reset();
  gl.coefficients();
  GLint found = 0;
  for (GLuint slot = 0; slot < 6; ++slot) {
    glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, slot, &found);
    EXPECT_EQ(static_cast<GLuint>(found), buffer);
  }
  glGetIntegerv(GL_ACTIVE_TEXTURE, &found);
  EXPECT_EQ(found, GL_TEXTURE0 + 5);
  for (GLuint unit = 12; unit < 16; ++unit) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &found);
    EXPECT_EQ(static_cast<GLuint>(found), texture);
    glGetIntegerv(GL_TEXTURE_BINDING_3D, &found);
    EXPECT_EQ(found, 0);
  }
  glGetIntegerv(GL_CURRENT_PROGRAM, &found);
  EXPECT_EQ(found, 0);
  glDeleteBuffers(1, &buffer);
  glDeleteTextures(1, &texture);
}

// As some systems without a context do.
TEST_F(LiveCachesOnGl, errorsWithoutEndAreNotWaitedFor) {
  VoxelLevel level = room();
  const VoxelVolume volume = volumeOf(level, coarse(8));
  auto gl = LiveCachesGl::create({{32},
                                  [](const char* name) -> GlProc {
                                    if (std::string(name) != "glGetError") return EglContext::getProcAddress(name);
                                    return reinterpret_cast<GlProc>(+[]() -> GLenum { return GL_INVALID_OPERATION; });
                                  },
                                  "",
                                  {}});
  ASSERT_TRUE(gl) << gl.error().message;
  EXPECT_TRUE(gl->update(volume, {}));
}

// Buffers that have grown are empty until they are written, for which there may be no memory.
TEST_F(LiveCachesOnGl, framesWithoutMemoryAreMadeUpFor) {
  if (!countsAllocations()) GTEST_SKIP() << "a sanitizer has operator new";
  VoxelLevel level = room();
  level.addBox({-2, -1, -2}, {2, 1, 2}, false);
  level.parts.back().moves = true;
  level.parts.back().toWorld[3] = {3.0f, 100.0f, 2.5f};  // far off
  VoxelOptions options = coarse(16);
  options.boxMax = {6, 3, 5};
  VoxelVolume volume = volumeOf(level, options);
  const std::vector<Light> lights = lamps();
  LightSetup setup;
  setup.lights = lights;
  LiveFrame frame;
  frame.bounceScale = 0.0f;
  LiveCachesGl gl = made(32), same = made(32);
  ASSERT_TRUE(gl.lightDirectly(volume, setup));
  ASSERT_TRUE(gl.update(volume, frame));
  const std::uint32_t standing = volume.standingSides(), before = volume.sideCount();
  std::vector<glm::mat4x3> to(2, glm::mat4x3(1.0f));
  to[0][3] = {2.6f, 0.6f, 3.6f};
  to[1][3] = {3.0f, 1.5f, 2.5f};
  ASSERT_TRUE(volume.move(to));
  ASSERT_GT(volume.sideCount(), before + before / 3) << "more than there is room for";
  ASSERT_TRUE(same.lightDirectly(volume, setup));
  ASSERT_TRUE(same.update(volume, frame));
  refuseAllocationsFrom(std::size_t{48} * standing);  // what packing the standing sides takes, and nothing before it
  const Status refused = gl.lightDirectly(volume, setup);
  refuseAllocationsFrom(0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::memory);
  ASSERT_TRUE(gl.lightDirectly(volume, setup));
  ASSERT_TRUE(gl.update(volume, frame));
  EXPECT_EQ(gl.radiance(), same.radiance());
  EXPECT_EQ(gl.coefficients(), same.coefficients());
}

}  // namespace
}  // namespace relume
