// SPDX-License-Identifier: MIT
// Voxels that reflective shadow maps light, in OpenGL against the CPU's.
#include "runtime/cones/rsm_voxels.h"

#include "tests/cones/cones_gl_room.h"
#include "tests/live/lit_maps.h"

#include <limits>
#include <string>

namespace relume {
namespace {

using namespace test;

class RsmVoxelsOnGl : public GlTest {};

// Texels of a light of its own in the room: on walls, slanted squares and what moves, and some in the air or outside.
std::vector<RsmTexel> texelsIn(const VoxelVolume& volume, std::uint32_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> share(0.0f, 1.0f);
  std::vector<RsmTexel> texels(count);
  for (RsmTexel& texel : texels) {
    const float kind = share(random);
    const std::uint32_t side = std::min(
        static_cast<std::uint32_t>(share(random) * static_cast<float>(volume.sideCount())), volume.sideCount() - 1);
    texel.positionWorld = kind < 0.1f
                              ? 6.0f * unit(random)
                              : volume.positionOfSide(side) + 0.7f * volume.grid().voxel * share(random) * unit(random);
    texel.normal = kind < 0.6f ? volume.side(side).normal : unit(random);
    texel.area = kind > 0.95f ? 0.0f : 0.01f;
    const float bright = std::exp2(-30.0f * share(random));
    texel.flux = bright * glm::vec3(share(random), share(random), kind > 0.5f ? 0.0f : share(random));
  }
  // Corners of voxels, and axes of equal length
  for (std::uint32_t i = 0; i < count / 8; ++i) {
    const glm::ivec3 v = volume.voxelOfSide(i % volume.sideCount());
    texels[i].positionWorld = volume.grid().toWorld(glm::vec3(v) + glm::vec3(i & 1, i >> 1 & 1, i >> 2 & 1));
    if (i % 3 == 0) texels[i].normal = glm::normalize(glm::vec3(1, i & 1 ? -1 : 1, i & 2 ? -1 : 1));
  }
  return texels;
}

void expectSameSides(const VoxelVolume& volume, const RsmVoxels& cpu, const std::vector<glm::vec3>& found) {
  ASSERT_EQ(found.size(), volume.sideCount());
  std::uint32_t lit = 0;
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) {
    if (cpu.targets().perFlux[s] == 0.0f) continue;
    const glm::vec3 expected = volume.radianceOf(s);
    ASSERT_EQ(PackedLight(found[s]).value(), expected) << "side " << s;
    if (expected != glm::vec3(0.0f)) ++lit;
  }
  EXPECT_GT(lit, 100u);
}

TEST_F(RsmVoxelsOnGl, mapsLightTheSameBits) {
  for (const std::uint32_t cells : {8u, 16u}) {
    Level level(Directions::six, cells);
    level.volume.useParallelFor([](std::uint32_t tasks, const auto& body) { onThreads(3, tasks, body); });
    ConesGl gl = onGl({});
    RsmVoxels cpu;
    for (unsigned f = 0; f < 3; ++f) {
      glm::mat4x3 to(1.0f);
      to[3] = {-2.5f + 0.6f * static_cast<float>(f), -3.8f, 1.0f};
      ASSERT_TRUE(level.volume.move(std::vector<glm::mat4x3>{to}));
      const std::uint32_t side = f == 2 ? 100 : 64;
      const auto point = texelsIn(level.volume, 6 * side * side, f), spot = texelsIn(level.volume, 33 * 33, f + 9);
      const std::vector<RsmImage> maps{{point, side, 6}, {spot, 33, 1}};
      ASSERT_TRUE(cpu.light(level.volume, maps, glm::vec3(0.5f)));
      ASSERT_TRUE(level.mips.update(level.volume));
      const Status ok = gl.fill(level.volume, maps, glm::vec3(0.5f));
      ASSERT_TRUE(ok) << ok.error().message;
      expectSameSides(level.volume, cpu, gl.sideRadiance());
      for (std::uint32_t l = 1; l <= gl.levels(); ++l)
        EXPECT_LE(relativeRmse(level.mips.texels(l), gl.texels(l)), 1e-4) << "frame " << f << ", level " << l;
    }
    // No light, then from the CPU again
    ASSERT_TRUE(gl.fill(level.volume, std::span<const RsmImage>(), glm::vec3(0.0f)));
    for (const glm::vec3& sent : gl.sideRadiance()) EXPECT_EQ(sent, glm::vec3(0.0f));
    ASSERT_TRUE(gl.fill(level.volume));
    expectSameSides(level.volume, cpu, gl.sideRadiance());
  }
}

// Many texels in one voxel: sums carry from word to word, and what is too bright is cut.
TEST_F(RsmVoxelsOnGl, mapsOfManyBrightTexelsCarry) {
  Level level(Directions::six, 8);
  ConesGl gl = onGl({});
  for (const float flux : {1.9999f, 3e25f, 1e30f, 1e-25f}) {
    LitPlate plate(300);
    for (std::size_t i = 0; i < plate.texel.size(); ++i) {
      plate.texel[i].positionWorld = {i % 2 == 0 ? 3.99f : -3.99f, 0.3f * static_cast<float>(i % 5), -0.1f};
      plate.texel[i].normal = {i % 2 == 0 ? -1.0f : 1.0f, 0, 0};
      plate.texel[i].flux = flux * glm::vec3(1.0f, 0.5f, i % 3 == 0 ? 1e-9f : 0.0f);
    }
    const std::vector<RsmImage> maps{plate.image(), plate.image()};
    RsmVoxels cpu;
    ASSERT_TRUE(cpu.light(level.volume, maps, glm::vec3(0.0f)));
    ASSERT_TRUE(gl.fill(level.volume, maps, glm::vec3(0.0f)));
    const std::vector<glm::vec3> found = gl.sideRadiance();
    float most = 0.0f;
    for (std::uint32_t s = 0; s < level.volume.sideCount(); ++s) {
      if (cpu.targets().perFlux[s] == 0.0f) continue;
      ASSERT_EQ(PackedLight(found[s]).value(), level.volume.radianceOf(s)) << flux << " side " << s;
      most = std::max(most, found[s].x);
    }
    EXPECT_GT(most, 0.0f);
    EXPECT_LE(most, 1e9f);
  }
}

// The same from textures of the host's; what is no number there reflects nothing.
TEST_F(RsmVoxelsOnGl, takeTheHostsMaps) {
  Level level(Directions::six, 8);
  ConesGl gl = onGl({});
  std::vector<RsmTexel> texels = texelsIn(level.volume, 6 * 32 * 32, 4);
  std::vector<glm::vec4> places, normals, flux;
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < texels.size(); ++i) {
    places.emplace_back(texels[i].positionWorld, texels[i].area);
    normals.emplace_back(texels[i].normal, 0.0f);
    flux.emplace_back(texels[i].flux, 0.0f);
    if (i % 50 >= 6) continue;
    texels[i].area = 0.0f;
    const std::size_t fault = i % 50;
    if (fault == 0) places[i].w = nan;
    if (fault == 1) places[i].x = inf;
    if (fault == 2) places[i].y = nan;
    if (fault == 3) normals[i].z = nan;
    if (fault == 4) flux[i].x = inf;
    if (fault == 5) flux[i].y = nan;
  }
  const std::vector<RsmImage> images{{texels, 32, 6}};
  const float largest = largestFlux(images);
  const GLuint place = textureOf(32, 192, places), normal = textureOf(32, 192, normals),
               reflected = textureOf(32, 192, flux);
  const RsmTextures map{32, 6, place, normal, reflected};
  RsmVoxels cpu;
  ASSERT_TRUE(cpu.light(level.volume, images, glm::vec3(0.0f)));
  const std::vector<RsmTextures> maps{map};
  const Status ok = gl.fill(level.volume, maps, largest, glm::vec3(0.0f));
  ASSERT_TRUE(ok) << ok.error().message;
  expectSameSides(level.volume, cpu, gl.sideRadiance());

  const std::vector<glm::vec3> before = gl.sideRadiance();
  const auto refused = [&](const RsmTextures& wrong, float most, const glm::vec3& scale) {
    const std::vector<RsmTextures> two{map, wrong};
    const Status status = gl.fill(level.volume, two, most, scale);
    EXPECT_FALSE(status);
    if (status) return std::string();
    EXPECT_EQ(status.error().code, ErrorCode::usage);
    return status.error().message;
  };
  const auto contains = [](const std::string& text, const char* what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  contains(refused({32, 5, place, normal, reflected}, largest, {}), "map 1: 5 faces");
  contains(refused({0, 6, place, normal, reflected}, largest, {}), "map 1: 0 texels");
  contains(refused({32, 1, place, normal, reflected}, largest, {}), "map 1, places: texture");
  contains(refused({32, 6, place, 0, reflected}, largest, {}), "map 1, normals: texture 0 is no GL_TEXTURE_2D");
  contains(refused({32, 6, place, normal, 99999}, largest, {}), "map 1, flux: texture 99999");
  contains(refused(map, nan, {}), "largestFlux");
  contains(refused(map, -1.0f, {}), "largestFlux");
  contains(refused(map, largest, {0, nan, 0}), "emissionScale");
  std::vector<RsmTexel> bad = texels;
  bad[70].area = 1.0f;
  bad[70].normal = glm::vec3(3.0f);
  const std::vector<RsmImage> badImages{{bad, 32, 6}};
  const Status status = gl.fill(level.volume, badImages, glm::vec3(0.0f));
  ASSERT_FALSE(status);
  contains(status.error().message, "map 0: texel 70: its normal");
  EXPECT_TRUE(gl.sideRadiance() == before);
  for (const GLuint texture : {place, normal, reflected}) glDeleteTextures(1, &texture);
}

}  // namespace
}  // namespace relume
