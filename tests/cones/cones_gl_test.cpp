// SPDX-License-Identifier: MIT
// The OpenGL passes of cones against their twins on the CPU.
#include "runtime/live_gl/cones_gl.h"
#include "runtime/live_gl/live_caches_gl.h"

#include "tests/cones/cones_gl_room.h"
#include "tests/live/lit_maps.h"
#include "tests/runtime/counting_loader.h"

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

std::vector<glm::vec3> skyMap(std::uint32_t side) {
  std::vector<glm::vec3> map(std::size_t{side} * side);
  for (std::size_t i = 0; i < map.size(); ++i)
    map[i] = {2.0f, 0.1f * static_cast<float>(i % side), 0.05f * static_cast<float>(i / side)};
  return map;
}

// The picture upside down, as OpenGL draws it.
Picture upsideDown(const Picture& picture) {
  Picture flipped = picture;
  for (std::uint32_t y = 0; y < picture.height; ++y) {
    for (std::uint32_t x = 0; x < picture.width; ++x) {
      const std::size_t from = (picture.height - 1 - y) * picture.width + x, to = y * picture.width + x;
      flipped.position[to] = picture.position[from];
      flipped.normal[to] = picture.normal[from];
      flipped.depth[to] = picture.depth[from];
    }
  }
  return flipped;
}

const Picture& view() {
  static const Picture picture(48, 32, {-3, -1, 3.2f}, {1, -2, 0});
  return picture;
}

TEST_F(ConesOnGl, levelsAreTheirTwins) {
  for (const Directions directions : {Directions::six, Directions::one}) {
    for (const std::uint32_t cells : {8u, 13u}) {
      const Level level(directions, cells);
      ConesGl gl = onGl({}, directions);
      ASSERT_TRUE(gl.fill(level.volume));
      ASSERT_EQ(gl.levels(), level.mips.levels());
      for (std::uint32_t l = 1; l <= gl.levels(); ++l)
        EXPECT_LE(relativeRmse(level.mips.texels(l), gl.texels(l)), 1e-5) << cells << " cells, level " << l;
    }
  }
}

// What hardware has: of radiance so small and so large that halves alone could not hold it, and of none.
TEST_F(ConesOnGl, levelsInHalvesAreNear) {
  for (const Directions directions : {Directions::six, Directions::one}) {
    Level level(directions);
    const std::vector<VoxelRadiance> before(level.volume.radiance().begin(), level.volume.radiance().end());
    const PixelConeOptions options{.keep = false};
    for (const float scale : {1.0f, 1e-9f, 1e7f, 0.0f}) {
      if (directions == Directions::one && scale != 1.0f) continue;
      ConesGl gl = onGl(options, directions, gpu::GroupThreads::parallel);
      for (std::uint32_t s = 0; s < level.volume.sideCount(); ++s)
        level.volume.setRadiance(s, scale * before[s / 2].of(s));
      ASSERT_TRUE(level.mips.update(level.volume));
      ASSERT_TRUE(gl.fill(level.volume));
      for (std::uint32_t l = 1; l <= gl.levels(); ++l)
        EXPECT_LE(relativeRmse(level.mips.texels(l), gl.texels(l)), 3e-3) << scale << ", level " << l;
      const ConeTracer tracer(level.volume, level.mips, {});
      PixelCones cpu = conesOf(options);
      ASSERT_TRUE(cpu.update(tracer, view().receivers(), {}));
      ASSERT_TRUE(gl.trace(view().receivers(), {}));
      std::vector<glm::vec3> light, found;
      for (const glm::vec4& each : cpu.light()) light.emplace_back(each);
      for (const glm::vec4& each : gl.light()) found.emplace_back(each);
      if (scale == 0.0f) {
        EXPECT_EQ(found, light);
      } else {
        EXPECT_LE(relativeRmse<glm::vec3>(light, found), 5e-3) << scale;
      }
    }
  }
}

TEST_F(ConesOnGl, conesAreTheirTwins) {
  const std::vector<glm::vec3> map = skyMap(16);
  for (const Directions directions : {Directions::six, Directions::one}) {
    const Level level(directions);
    for (const bool interleaved : {true, false}) {
      const LiveSky sky =
          interleaved == (directions == Directions::six) ? LiveSky{{}, map, 16} : LiveSky{{0.3f, 0.4f, 0.5f}, {}, 0};
      const ConeTracer tracer(level.volume, level.mips, sky);
      const PixelConeOptions options{
          .interleaved = interleaved, .gather = false, .blur = false, .keep = false, .falloff = 0.7f};
      PixelCones cpu = conesOf(options);
      ConesGl gl = onGl(options, directions);
      ASSERT_TRUE(gl.fill(level.volume));
      for (int f = 0; f < (interleaved ? 2 : 1); ++f) {
        ASSERT_TRUE(cpu.update(tracer, view().receivers(), {}));
        ASSERT_TRUE(gl.trace(view().receivers(), sky));
        EXPECT_LE(relativeRmse(cpu.light(), gl.light()), 1e-3) << interleaved << ' ' << f;
      }
    }
  }
}

// As the camera turns: what is shared, blurred and kept.
TEST_F(ConesOnGl, eachFilterIsItsTwin) {
  const Level level;
  const LiveSky sky{{0.3f, 0.4f, 0.5f}, {}, 0};
  const ConeTracer tracer(level.volume, level.mips, sky);
  // Strips of the blur: one and a part of another, of threads of software and of hardware, whose levels are in halves.
  for (const auto groups : {gpu::GroupThreads::serial, gpu::GroupThreads::parallel}) {
    for (int stages = groups == gpu::GroupThreads::serial ? 0 : 2; stages < 4; ++stages) {
      const PixelConeOptions options{.gather = stages != 0, .blur = stages >= 2, .keep = stages != 1, .mostFrames = 4};
      PixelCones cpu = conesOf(options);
      ConesGl gl = onGl(options, Directions::six, groups);
      ASSERT_TRUE(gl.fill(level.volume));
      for (int f = 0; f < 6; ++f) {
        const auto width = stages < 2 ? 43u : 75u, height = stages < 2 ? 31u : 67u;
        const Picture picture(width, height, {-3, -1, 3.2f}, {1.0f + 0.2f * static_cast<float>(f), -2, 0});
        if (f == 4 && stages == 3) {
          cpu.reset();
          gl.reset();
        }
        ASSERT_TRUE(cpu.update(tracer, picture.receivers(), {}));
        ASSERT_TRUE(gl.trace(picture.receivers(), sky));
        EXPECT_LE(relativeRmse(cpu.light(), gl.light()), groups == gpu::GroupThreads::serial ? 1e-3 : 5e-3)
            << "stages " << stages << " frame " << f;
        const std::vector<std::uint8_t> edges = gl.edges();
        EXPECT_TRUE(std::equal(edges.begin(), edges.end(), cpu.edges().begin(), cpu.edges().end()));
        const std::vector<float> frames = gl.frames();
        std::size_t off = 0;
        for (std::size_t i = 0; i < frames.size(); ++i) off += std::abs(frames[i] - cpu.frames()[i]) > 1e-3f ? 1 : 0;
        EXPECT_LE(off, frames.size() / 500) << "frame " << f;
      }
    }
  }
}

TEST_F(ConesOnGl, lobesAreTheirTwins) {
  const Level level;
  const std::vector<glm::vec3> map = skyMap(16);
  const LiveSky sky{{}, map, 16};
  const ConeTracer tracer(level.volume, level.mips, sky);
  ConesGl gl = onGl({});
  ASSERT_TRUE(gl.fill(level.volume));
  const Picture& picture = view();
  for (const float exponent : {0.0f, 4.0f, 64.0f, 650.0f, 1e4f}) {
    std::vector<glm::vec4> mirrored;
    std::vector<glm::vec3> expected;
    for (std::size_t i = 0; i < picture.depth.size(); ++i) {
      const glm::vec3 ray = glm::normalize(picture.position[i] - glm::vec3(-3, -1, 3.2f));
      mirrored.emplace_back(glm::reflect(ray, picture.normal[i]), i % 7 == 0 ? -1.0f : exponent);
      expected.push_back(
          i % 7 == 0 ? glm::vec3(0.0f)
                     : tracer.glossy(picture.position[i], picture.normal[i], glm::vec3(mirrored.back()), exponent));
    }
    ASSERT_TRUE(gl.trace(picture.receivers(), sky, mirrored));
    EXPECT_LE(relativeRmse<glm::vec3>(expected, gl.glossy()), 1e-3) << exponent;
    EXPECT_NE(gl.glossyTexture(), 0u);
  }
  ASSERT_TRUE(gl.trace(picture.receivers(), sky));
  EXPECT_TRUE(gl.glossy().empty()) << "none is asked for";
}

// Light that caches found on the GPU is read there.
TEST_F(ConesOnGl, readTheRadianceOfTheCaches) {
  Level level;
  std::vector<Light> lights(1);
  lights[0].intensity = {40, 30, 20};
  lights[0].positionWorld = {2, 1, 2};
  LightSetup setup;
  setup.lights = lights;
  auto caches = LiveCachesGl::create({{32}, EglContext::getProcAddress, "", {}});
  ASSERT_TRUE(caches);
  ConesGl gl = onGl({});
  EXPECT_FALSE(gl.fill(level.volume, caches->sides())) << "which have no frame yet";
  for (int f = 0; f < 3; ++f) {
    glm::mat4x3 to(1.0f);
    to[3] = {-2.5f + 0.5f * static_cast<float>(f), -2.0f, 1.0f};
    ASSERT_TRUE(level.volume.move(std::vector<glm::mat4x3>{to}));
    const Status stale = gl.fill(level.volume, caches->sides());
    ASSERT_FALSE(stale) << "of before the move";
    EXPECT_EQ(stale.error().code, ErrorCode::usage);
    ASSERT_TRUE(caches->lightDirectly(level.volume, setup));
    ASSERT_TRUE(caches->update(level.volume, {}));
    ASSERT_TRUE(gl.fill(level.volume, caches->sides()));
    const std::vector<glm::vec3> radiance = caches->radiance();
    for (std::uint32_t s = 0; s < level.volume.sideCount(); ++s) level.volume.setRadiance(s, radiance[s]);
    ASSERT_TRUE(level.mips.update(level.volume));
    for (std::uint32_t l = 1; l <= gl.levels(); ++l)
      EXPECT_LE(relativeRmse(level.mips.texels(l), gl.texels(l)), 1e-4) << "frame " << f << ", level " << l;
    const ConeTracer tracer(level.volume, level.mips, {});
    const PixelConeOptions options{.keep = false};
    PixelCones cpu = conesOf(options);
    ConesGl once = onGl(options);
    ASSERT_TRUE(once.fill(level.volume, caches->sides()));
    ASSERT_TRUE(cpu.update(tracer, view().receivers(), {}));
    ASSERT_TRUE(once.trace(view().receivers(), {}));
    EXPECT_LE(relativeRmse(cpu.light(), once.light()), 1e-3);
  }
}

// What the host draws, row 0 at the bottom: as the CPU has it of rows and clip space upside down.
TEST_F(ConesOnGl, takeTheHostsTextures) {
  const Level level;
  const ConeTracer tracer(level.volume, level.mips, {});
  PixelCones cpu = conesOf({});
  ConesGl gl = onGl({});
  ASSERT_TRUE(gl.fill(level.volume));
  for (int f = 0; f < 3; ++f) {
    Picture picture = upsideDown(Picture(48, 33, {-3, -1, 3.2f}, {1.0f + 0.1f * static_cast<float>(f), -2, 0}));
    std::vector<glm::vec4> places, normals;
    for (std::size_t i = 0; i < picture.depth.size(); ++i) {
      places.emplace_back(picture.position[i], picture.depth[i]);
      normals.emplace_back(picture.normal[i], 0.0f);
    }
    // Nonsense is not seen.
    places[77].y = std::numeric_limits<float>::quiet_NaN();
    places[78].w = -1.0f;
    places[79].x = std::numeric_limits<float>::infinity();
    normals[80].z = std::numeric_limits<float>::quiet_NaN();
    for (const std::size_t i : {77u, 78u, 79u, 80u}) picture.depth[i] = 0.0f;
    const GLuint place = textureOf(48, 33, places), normal = textureOf(48, 33, normals);
    PixelTextures textures{48, 33, place, normal, normal, 0, picture.clipFromWorld};
    ASSERT_TRUE(gl.trace(textures, {}));
    PixelReceivers receivers = picture.receivers();
    for (int c = 0; c < 4; ++c) receivers.clipFromWorld[c][1] *= -1.0f;
    ASSERT_TRUE(cpu.update(tracer, receivers, {}));
    EXPECT_LE(relativeRmse(cpu.light(), gl.light()), 1e-3);
    EXPECT_EQ(gl.light()[78], glm::vec4(0.0f));

    const std::vector<glm::vec4> before = gl.light();
    PixelTextures wrong = textures;
    wrong.height = 32;
    const Status other = gl.trace(wrong, {});
    ASSERT_FALSE(other);
    EXPECT_NE(other.error().message.find("expected 48 x 32"), std::string::npos) << other.error().message;
    wrong = textures;
    wrong.planes = 0;
    EXPECT_FALSE(gl.trace(wrong, {}));
    wrong = textures;
    wrong.mirrored = 999999;
    EXPECT_FALSE(gl.trace(wrong, {}));
    EXPECT_TRUE(gl.light() == before);
    glDeleteTextures(1, &place);
    glDeleteTextures(1, &normal);
  }
}

// Of one level by the parameters that textures begin with, which ask for mip levels.
GLuint plainTexture(std::uint32_t width, std::uint32_t height, const std::vector<glm::vec4>& texels) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(GL_TEXTURE_2D, name);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, static_cast<GLsizei>(width), static_cast<GLsizei>(height), 0, GL_RGBA,
               GL_FLOAT, texels.data());
  glBindTexture(GL_TEXTURE_2D, 0);
  return name;
}

TEST_F(ConesOnGl, parametersOfTheHostsTexturesAreNoMatter) {
  Level level;
  LitPlate plate(64);
  plate.place({2.5f, -4, 2}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0});
  const RsmImage image = plate.image();
  const Picture& picture = view();
  std::vector<glm::vec4> places, normals, mirrored, mapPlaces, mapNormals, flux;
  for (std::size_t i = 0; i < picture.depth.size(); ++i) {
    places.emplace_back(picture.position[i], picture.depth[i]);
    normals.emplace_back(picture.normal[i], 0.0f);
    mirrored.emplace_back(picture.normal[i], 8.0f);
  }
  for (const RsmTexel& texel : image.texel) {
    mapPlaces.emplace_back(texel.positionWorld, texel.area);
    mapNormals.emplace_back(texel.normal, 0.0f);
    flux.emplace_back(texel.flux, 0.0f);
  }
  std::vector<std::vector<glm::vec4>> light;
  std::vector<std::vector<glm::vec3>> glossy, sides;
  ConesGl gl = onGl({.interleaved = false, .keep = false});
  for (const auto make : {&textureOf, &plainTexture}) {
    const GLuint names[] = {make(picture.width, picture.height, places),
                            make(picture.width, picture.height, normals),
                            make(picture.width, picture.height, mirrored),
                            make(image.side, image.side * image.faces, mapPlaces),
                            make(image.side, image.side * image.faces, mapNormals),
                            make(image.side, image.side * image.faces, flux)};
    const RsmTextures map{image.side, image.faces, names[3], names[4], names[5]};
    ASSERT_TRUE(gl.fill(level.volume, std::span(&map, 1), 1e4f, glm::vec3(0.0f)));
    sides.push_back(gl.sideRadiance());
    ASSERT_TRUE(gl.trace(
        PixelTextures{picture.width, picture.height, names[0], names[1], names[1], names[2], picture.clipFromWorld},
        {{0.3f, 0.4f, 0.5f}, {}, 0}));
    light.push_back(gl.light());
    glossy.push_back(gl.glossy());
    glDeleteTextures(6, names);
  }
  EXPECT_TRUE(std::any_of(light[0].begin(), light[0].end(), [](const glm::vec4& l) { return l.x > 0.0f; }));
  EXPECT_TRUE(std::any_of(glossy[0].begin(), glossy[0].end(), [](const glm::vec3& l) { return l.x > 0.0f; }));
  EXPECT_TRUE(std::any_of(sides[0].begin(), sides[0].end(), [](const glm::vec3& l) { return l.x > 0.0f; }));
  EXPECT_TRUE(light[1] == light[0]);
  EXPECT_TRUE(glossy[1] == glossy[0]);
  EXPECT_TRUE(sides[1] == sides[0]);
}

TEST_F(ConesOnGl, framesMakeNoObject) {
  Level level;
  auto gl = ConesGl::create({{}, Directions::six, true, countingLoader(0)});
  ASSERT_TRUE(gl);
  const LitPlate plate(64);
  const std::vector<RsmImage> maps{plate.image()};
  ASSERT_TRUE(gl->fill(level.volume, maps, glm::vec3(1.0f)));
  std::vector<glm::vec4> mirrored(view().depth.size(), glm::vec4(0, 1, 0, 16));
  ASSERT_TRUE(gl->trace(view().receivers(), {}, mirrored));
  forgetCalls(0);
  for (int f = 0; f < 4; ++f) {
    glm::mat4x3 to(1.0f);
    to[3] = {-2.5f, -2.0f + 0.05f * static_cast<float>(f), 1.0f};
    ASSERT_TRUE(level.volume.move(std::vector<glm::mat4x3>{to}));
    ASSERT_TRUE(f % 2 == 0 ? gl->fill(level.volume) : gl->fill(level.volume, maps, glm::vec3(1.0f)));
    ASSERT_TRUE(gl->trace(view().receivers(), {}, mirrored));
  }
  EXPECT_GT(calls(0, "glDispatchCompute"), 40);
  EXPECT_EQ(objectsMade(0), 0);
  EXPECT_EQ(objectsDeleted(0), 0);
}

TEST_F(ConesOnGl, whatIsRefusedLeavesTheLight) {
  EXPECT_FALSE(ConesGl::create({{.mostFrames = 0}, Directions::six, true, EglContext::getProcAddress}));
  EXPECT_FALSE(ConesGl::create({{}, Directions::six, true, {}}));
  Level level;
  ConesGl gl = onGl({});
  const Status early = gl.trace(view().receivers(), {});
  ASSERT_FALSE(early);
  EXPECT_NE(early.error().message.find("fill()"), std::string::npos);
  EXPECT_TRUE(gl.light().empty());
  ASSERT_TRUE(gl.fill(level.volume));
  ASSERT_TRUE(gl.trace(view().receivers(), {}));
  const std::vector<glm::vec4> before = gl.light();
  Picture nan = view();
  nan.position[5].y = std::numeric_limits<float>::quiet_NaN();
  const Status refused = gl.trace(nan.receivers(), {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("pixel 5"), std::string::npos);
  EXPECT_FALSE(gl.trace(view().receivers(), {{-1.0f, 0, 0}, {}, 0}));
  EXPECT_FALSE(gl.trace(view().receivers(), {}, std::vector<glm::vec4>(3)));
  EXPECT_TRUE(gl.light() == before);
}

// A driver with small textures, and one without a function.
GLint most2D = 0, most3D = 0;
void APIENTRY fewTexels(GLenum what, GLint* value) {
  glGetIntegerv(what, value);
  if (what == GL_MAX_TEXTURE_SIZE && most2D > 0) *value = most2D;
  if (what == GL_MAX_3D_TEXTURE_SIZE && most3D > 0) *value = most3D;
}

TEST_F(ConesOnGl, limitsAndMissingFunctionsAreNamed) {
  const auto without = ConesGl::create({{}, Directions::six, true, [](const char* name) -> GlProc {
                                          if (std::string(name) == "glCopyImageSubData") return nullptr;
                                          return EglContext::getProcAddress(name);
                                        }});
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().code, ErrorCode::unsupported);
  EXPECT_NE(without.error().message.find("glCopyImageSubData"), std::string::npos) << without.error().message;

  auto gl = ConesGl::create({{}, Directions::six, true, [](const char* name) -> GlProc {
                               if (std::string(name) == "glGetIntegerv") return reinterpret_cast<GlProc>(&fewTexels);
                               return EglContext::getProcAddress(name);
                             }});
  ASSERT_TRUE(gl) << gl.error().message;
  const Level level(Directions::six, 8), larger;
  ASSERT_TRUE(gl->fill(level.volume));
  ASSERT_TRUE(gl->trace(view().receivers(), {}));
  const std::vector<glm::vec4> before = gl->light();
  most3D = 128;
  const Status volume = gl->fill(larger.volume);
  most3D = 0;
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().code, ErrorCode::unsupported);
  EXPECT_NE(volume.error().message.find("192 are needed"), std::string::npos) << volume.error().message;
  most2D = 40;
  const Picture wide(44, 20, {-3, -1, 3.2f}, {1, -2, 0});
  const Status picture = gl->trace(wide.receivers(), {});
  most2D = 0;
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().code, ErrorCode::unsupported);
  EXPECT_NE(picture.error().message.find("44 x 20"), std::string::npos) << picture.error().message;
  const LitPlate plate(64);
  const std::vector<RsmImage> maps{plate.image()};
  most2D = 40;
  const Status map = gl->fill(level.volume, maps, glm::vec3(0.0f));
  most2D = 0;
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::unsupported);
  EXPECT_NE(map.error().message.find("map 0 has 1 faces of 64 texels"), std::string::npos) << map.error().message;
  EXPECT_TRUE(gl->light() == before);
  EXPECT_TRUE(gl->trace(view().receivers(), {})) << "the volume of before is still there";
}

TEST_F(ConesOnGl, bindingsOfTheHostAreAsTheyWere) {
  const Level level(Directions::six, 8);
  ConesGl gl = onGl({});
  GLuint buffer = 0, texture = 0, volume = 0;
  glGenBuffers(1, &buffer);
  glGenTextures(1, &texture);
  glGenTextures(1, &volume);
  for (GLuint slot = 0; slot < 6; ++slot) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, slot, buffer);
  for (GLuint unit = 0; unit < 16; ++unit) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, texture);
    glBindTexture(GL_TEXTURE_3D, volume);
  }
  glActiveTexture(GL_TEXTURE0 + 5);
  const LitPlate plate(16);
  const std::vector<RsmImage> maps{plate.image()};
  ASSERT_TRUE(gl.fill(level.volume, maps, glm::vec3(1.0f)));
  ASSERT_TRUE(gl.trace(view().receivers(), {}));
  gl.light();
  gl.sideRadiance();
  gl.edges();
  gl.texels(2);
  GLint found = 0;
  for (GLuint slot = 0; slot < 6; ++slot) {
    glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, slot, &found);
    EXPECT_EQ(static_cast<GLuint>(found), buffer);
  }
  for (GLuint unit = 0; unit < 3; ++unit) {
    glGetIntegeri_v(GL_IMAGE_BINDING_NAME, unit, &found);
    EXPECT_EQ(found, 0);
  }
  glGetIntegerv(GL_ACTIVE_TEXTURE, &found);
  EXPECT_EQ(found, GL_TEXTURE0 + 5);
  for (GLuint unit = 0; unit < 16; ++unit) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &found);
    EXPECT_EQ(static_cast<GLuint>(found), texture) << unit;
    glGetIntegerv(GL_TEXTURE_BINDING_3D, &found);
    EXPECT_EQ(static_cast<GLuint>(found), volume) << unit;
  }
  glGetIntegerv(GL_CURRENT_PROGRAM, &found);
  EXPECT_EQ(found, 0);
  glDeleteBuffers(1, &buffer);
  glDeleteTextures(1, &texture);
  glDeleteTextures(1, &volume);
}

}  // namespace
}  // namespace relume
