// SPDX-License-Identifier: MIT
// Cones through volumes in one another, in OpenGL, against their twins on the CPU.
#include "runtime/live_gl/cones_gl.h"
#include "runtime/live_gl/live_caches_gl.h"

#include "tests/cones/cones_gl_room.h"
#include "tests/cones/nested_rooms.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

class NestedConesOnGl : public GlTest {};

NestedOptions aboutEye(std::uint32_t cascades, const glm::vec3& eye) {
  return nestedAbout(cascades, 10, {-4.2f, -4.2f, -4.2f}, {4.2f, 4.2f, 4.2f}, eye);
}

// By where it is, so that what is read in another place shows.
glm::vec3 byPlace(const VoxelVolume& volume, std::uint32_t side) {
  const glm::vec3 p = volume.positionOfSide(side);
  return {p.x > 3.5f ? 6.0f : 0.2f, 0.5f + 0.1f * p.y, volume.side(side).isFaced ? 1.0f : 0.0f};
}

VoxelLevel levelOfRoom() {
  VoxelLevel level;
  Level::make(level, 8);
  return level;
}

std::vector<glm::vec4> mirroredIn(const Picture& picture, const glm::vec3& eye, float exponent) {
  std::vector<glm::vec4> mirrored(picture.depth.size(), glm::vec4(0.0f, 0.0f, 0.0f, -1.0f));
  for (std::size_t i = 0; i < mirrored.size(); ++i) {
    if (picture.depth[i] > 0.0f)
      mirrored[i] = glm::vec4(glm::reflect(glm::normalize(picture.position[i] - eye), picture.normal[i]), exponent);
  }
  return mirrored;
}

// Which may be empty.
void expectLevel(std::span<const glm::vec4> expected, const std::vector<glm::vec4>& found, double most,
                 const std::string& when) {
  const bool isEmpty = std::all_of(expected.begin(), expected.end(), [](const glm::vec4& t) { return t.w == 0.0f; });
  if (!isEmpty) {
    EXPECT_LE(relativeRmse(expected, found), most) << when;
  } else {
    EXPECT_TRUE(std::all_of(found.begin(), found.end(), [](const glm::vec4& t) { return t.w == 0.0f; })) << when;
  }
}

void expectTwins(const NestedRoom& room, ConesGl& gl, const LiveSky& sky, double most, const std::string& when) {
  const glm::vec3 eye(-3, -1, 3.2f);
  const Picture picture(32, 20, eye, {1, -2, 0});
  const ConeTracer tracer(room.volumes.all(), room.mips.all(), sky);
  PixelCones cpu = conesOf({.interleaved = false, .gather = false, .blur = false, .keep = false, .falloff = 0.7f});
  const std::vector<glm::vec4> mirrored = mirroredIn(picture, eye, 32.0f);
  ASSERT_TRUE(cpu.update(tracer, picture.receivers(), {}));
  const Status ok = gl.trace(picture.receivers(), sky, mirrored);
  ASSERT_TRUE(ok) << ok.error().message;
  EXPECT_LE(relativeRmse(cpu.light(), gl.light()), most) << when;
  std::vector<glm::vec3> glossy(mirrored.size(), glm::vec3(0.0f));
  for (std::size_t i = 0; i < mirrored.size(); ++i) {
    if (mirrored[i].w >= 0.0f)
      glossy[i] = tracer.glossy(picture.position[i], picture.normal[i], glm::vec3(mirrored[i]), mirrored[i].w);
  }
  EXPECT_LE(relativeRmse<glm::vec3>(glossy, gl.glossy()), most) << when;
}

// While the eye walks, jumps and comes back, and a part moves; in floats and in halves, of six directions and of one.
TEST_F(NestedConesOnGl, areTheirTwins) {
  const LiveSky sky{{0.3f, 0.4f, 0.5f}, {}, 0};
  for (const auto groups : {gpu::GroupThreads::serial, gpu::GroupThreads::parallel}) {
    for (const std::uint32_t cascades : {2u, 3u, 4u}) {
      if (groups == gpu::GroupThreads::parallel && cascades == 2) continue;
      const Directions directions = cascades == 4 ? Directions::one : Directions::six;
      const double most = groups == gpu::GroupThreads::serial ? 1e-3 : 5e-3;
      VoxelLevel level = levelOfRoom();
      NestedRoom room(level, aboutEye(cascades, {-3, -1, 3}), byPlace, directions);
      ConesGl gl = onGl({.interleaved = false, .gather = false, .blur = false, .keep = false, .falloff = 0.7f},
                        directions, groups);
      int frame = 0;
      for (const float x : {-3.0f, -2.1f, 3.0f, -3.0f}) {
        ASSERT_TRUE(room.volumes.centre({x, -1, 3}));
        if (frame % 2 == 1) {
          glm::mat4x3 to(1.0f);
          to[3] = {-2.5f + 0.3f * static_cast<float>(frame), -2.0f, 1.0f};
          ASSERT_TRUE(room.volumes.move(std::vector<glm::mat4x3>{to}));
        }
        room.light(byPlace);
        const std::string when = std::to_string(cascades) + " volumes, frame " + std::to_string(frame++);
        const Status ok = gl.fill(room.volumes);
        ASSERT_TRUE(ok) << ok.error().message;
        for (std::size_t v = 0; v < room.volumes.size(); ++v) {
          ASSERT_EQ(gl.levels(v), room.mips.all()[v].levels());
          for (std::uint32_t l = 1; l <= gl.levels(v); ++l)
            expectLevel(room.mips.all()[v].texels(l), gl.texels(l, v), most > 2e-3 ? 3e-3 : 1e-5,
                        when + ", volume " + std::to_string(v) + ", level " + std::to_string(l));
        }
        expectTwins(room, gl, sky, most, when);
      }
    }
  }
}

// One volume is followed by the program that it had, several by their own: in turns on one object.
TEST_F(NestedConesOnGl, goFromOneVolumeToSeveralAndBack) {
  VoxelLevel level = levelOfRoom();
  const NestedRoom one(level, aboutEye(1, {-3, -1, 3}), byPlace), three(level, aboutEye(3, {-3, -1, 3}), byPlace);
  const Level alone;
  ConesGl gl = onGl({.interleaved = false, .gather = false, .blur = false, .keep = false, .falloff = 0.7f});
  for (const NestedRoom* room : {&one, &three, &one}) {
    ASSERT_TRUE(gl.fill(room->volumes));
    expectTwins(*room, gl, {}, 1e-3, std::to_string(room->volumes.size()));
  }
}

// As the passes of the caches have lit them, each volume in rows of its own; and not what has changed since.
TEST_F(NestedConesOnGl, takeLightFromTheCaches) {
  VoxelLevel level = levelOfRoom();
  level.surfaces[0].emission = glm::vec3(0.2f);
  NestedRoom room(level, aboutEye(3, {-3, -1, 3}), byPlace);
  std::vector<Light> lights(1);
  lights[0].positionWorld = {0, 2, 0};
  lights[0].intensity = {20, 18, 10};
  lights[0].range = 20.0f;
  LightSetup setup;
  setup.lights = lights;
  auto caches = LiveCachesGl::create({{16}, EglContext::getProcAddress, "", {}});
  ASSERT_TRUE(caches);
  const auto sides = [&] {
    std::vector<const gl::LitSides*> all;
    for (std::size_t v = 0; v < room.volumes.size(); ++v) all.push_back(&caches->sides(v));
    return all;
  };
  ConesGl gl = onGl({.interleaved = false, .gather = false, .blur = false, .keep = false, .falloff = 0.7f});
  for (int frame = 0; frame < 3; ++frame) {
    if (frame == 2) {
      ASSERT_TRUE(room.volumes.centre({1, -1, 1}));
    }
    ASSERT_TRUE(caches->lightDirectly(room.volumes, setup));
    ASSERT_TRUE(caches->update(room.volumes, {}));
    room.mips = NestedMips();
    for (std::size_t v = 0; v < room.volumes.size(); ++v) {
      const std::vector<glm::vec3> radiance = caches->radiance(v);
      for (std::uint32_t s = 0; s < radiance.size(); ++s) room.volumes[v].setRadiance(s, radiance[s]);
    }
    ASSERT_TRUE(room.mips.update(room.volumes.all()));
    ASSERT_TRUE(gl.fill(room.volumes, sides()));
    expectTwins(room, gl, {}, 1e-3, "frame " + std::to_string(frame));
  }
  ASSERT_TRUE(room.volumes.centre({-2, -1, 2}));
  EXPECT_FALSE(gl.fill(room.volumes, sides())) << "whose sides are those of before";
  const gl::LitSides* const first = sides().front();
  EXPECT_FALSE(gl.fill(room.volumes, {&first, 1})) << "of one volume alone";
}

}  // namespace
}  // namespace relume
