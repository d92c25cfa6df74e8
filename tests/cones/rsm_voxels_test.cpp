// SPDX-License-Identifier: MIT
// Voxels lit by reflective shadow maps.
#include "runtime/cones/rsm_voxels.h"
#include "runtime/cones/cone_light.h"
#include "tests/live/lit_maps.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

// A room of [-1.5, 1.5]³ and a floor in it, of [-1, 1]² at height 0, which a plate's map lies on.
VoxelVolume roomWithFloor(std::uint32_t cells = 16) {
  VoxelLevel level;
  level.addBox(glm::vec3(-1.5f), glm::vec3(1.5f), true);
  level.addQuad({-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1});
  return volumeOf(level, coarse(cells));
}

glm::vec3 radianceOf(const VoxelVolume& volume, std::uint32_t side) { return volume.radianceOf(side); }

// [W] Of all sides together, in the first channel.
double fluxOf(const VoxelVolume& volume) {
  double sum = 0.0;
  const std::vector<float> areas = volume.areas();
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) {
    const float area = areas[s] > 0.0f ? areas[s] : areas[s ^ 1u];
    sum += std::numbers::pi * static_cast<double>(radianceOf(volume, s).x) * static_cast<double>(area);
  }
  return sum;
}

RsmVoxels lit(VoxelVolume& volume, const std::vector<RsmImage>& images) {
  RsmVoxels maps;
  const Status ok = maps.light(volume, images, glm::vec3(0.0f));
  EXPECT_TRUE(ok) << ok.error().message;
  return maps;
}

TEST(RsmVoxels, allFluxIsInTheVoxels) {
  VoxelVolume volume = roomWithFloor();
  const LitPlate plate(256, {1.0f, 0.5f, 0.0f});
  const RsmVoxels maps = lit(volume, {plate.image()});
  EXPECT_EQ(maps.arrived(), 1.0f);
  const double expected = std::numbers::pi * static_cast<double>(plateArea());
  EXPECT_NEAR(fluxOf(volume), expected, 1e-4 * expected);
  double counted = 0.0;
  for (std::size_t i = 0; i < maps.sums().size(); i += 3)
    counted += static_cast<double>(maps.sums()[i]) * static_cast<double>(maps.unit());
  EXPECT_NEAR(counted, expected, 1e-5 * expected);
  // Where texels are much finer than voxels each of them sends out what the plate does, and nothing else shines.
  std::uint32_t floor = 0, off = 0;
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) {
    const VoxelSide& side = volume.side(s);
    const glm::vec3& sent = radianceOf(volume, s);
    const glm::vec3 at = glm::abs(volume.positionOfSide(s));
    const bool isFloor = at.y < 0.1f && side.normal.y > 0.9f && at.x < 1.1f && at.z < 1.1f;
    EXPECT_EQ(sent.z, 0.0f);
    if (!isFloor) {
      EXPECT_EQ(sent, glm::vec3(0.0f)) << s;
      continue;
    }
    ++floor;
    EXPECT_NEAR(sent.y, 0.5f * sent.x, 0x1p-13f * sent.x);
    EXPECT_LT(sent.x, 1.5f) << "no side with little area is bright";
    if (std::abs(sent.x - 1.0f) > 0.3f) ++off;
  }
  EXPECT_GT(floor, 1500u);
  EXPECT_LE(off, floor / 20);
}

// A slanted plate passes through the edges of many voxels.
TEST(RsmVoxels, slantedPlatesHaveNoBrightVoxels) {
  std::mt19937 random(7);
  for (int i = 0; i < 20; ++i) {
    const glm::vec3 normal = unit(random), right = glm::normalize(glm::cross(normal, unit(random))),
                    up = glm::cross(normal, right);
    VoxelLevel level;
    level.addBox(glm::vec3(-1.8f), glm::vec3(1.8f), true);
    level.addQuad(-right - up, right - up, right + up, up - right);
    VoxelVolume volume = volumeOf(level, coarse(16));
    LitPlate plate(512);
    plate.place(glm::vec3(0.0f), right, up, normal);
    const RsmVoxels maps = lit(volume, {plate.image()});
    const double expected = std::numbers::pi * static_cast<double>(plateArea());
    EXPECT_GT(maps.arrived(), 0.995f) << i << ", of which the rest is beyond the plate's own voxels at its edges";
    EXPECT_NEAR(fluxOf(volume), static_cast<double>(maps.arrived()) * expected, 1e-3 * expected) << i;
    float most = 0.0f;
    for (std::uint32_t s = 0; s < volume.sideCount(); ++s) most = std::max(most, radianceOf(volume, s).x);
    EXPECT_LT(most, 2.7f) << i;
  }
}

TEST(RsmVoxels, aWallIsLitOnTheSideThatTexelsFace) {
  VoxelLevel level;
  level.addBox(glm::vec3(-1.5f), glm::vec3(1.5f), true);
  level.addBox({-1, -0.02f, -1}, {1, 0, 1}, false);
  VoxelVolume volume = volumeOf(level, coarse(16));
  const LitPlate plate(256);
  lit(volume, {plate.image()});
  double above = 0.0, below = 0.0;
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) {
    const VoxelSide& side = volume.side(s);
    if (side.normal.y > 0.9f) above += static_cast<double>(radianceOf(volume, s).x);
    if (side.normal.y < -0.9f) below += static_cast<double>(radianceOf(volume, s).x);
  }
  EXPECT_GT(above, 1000.0);
  EXPECT_EQ(below, 0.0);
}

TEST(RsmVoxels, emptyMapsAndPlacesOutsideLightNothing) {
  VoxelVolume volume = roomWithFloor(8);
  LitPlate dark(16, glm::vec3(0.0f)), nothing(16), far(16), nearby(16);
  for (RsmTexel& t : nothing.texel) t.area = 0.0f;
  far.place({0, 100, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0});
  nearby.place({0, 0.7f, 0}, {0.1f, 0, 0}, {0, 0, 0.1f}, {0, 1, 0});
  for (const LitPlate* plate : {&dark, &nothing, &far, &nearby}) {
    const RsmVoxels maps = lit(volume, {plate->image()});
    EXPECT_EQ(fluxOf(volume), 0.0);
    EXPECT_EQ(maps.arrived(), plate == &far || plate == &nearby ? 0.0f : 1.0f);
  }
  lit(volume, {});
  EXPECT_EQ(fluxOf(volume), 0.0);
  // Far beyond what integers hold
  LitPlate beyond(2);
  for (RsmTexel& t : beyond.texel) t.positionWorld = glm::vec3(1e9f, -1e9f, 1e9f);
  EXPECT_EQ(lit(volume, {beyond.image()}).arrived(), 0.0f);
}

// 2^30 units a texel at least: a few of them overflow 32 bits, and 64 bits hold the most that maps can have.
TEST(RsmVoxels, sumsDoNotOverflow) {
  VoxelVolume volume = roomWithFloor(8);
  LitPlate plate(512, glm::vec3(1.0f));
  for (RsmTexel& t : plate.texel) {
    t.positionWorld = {0.01f, 0.0f, 0.01f};
    t.flux = {1.9999f, 1.0f, 1e-9f};
  }
  const RsmVoxels maps = lit(volume, {plate.image(), plate.image(), plate.image()});
  const auto most = std::max_element(maps.sums().begin(), maps.sums().end());
  const std::size_t at = static_cast<std::size_t>(most - maps.sums().begin()) / 3 * 3;
  const std::uint64_t count = 3ull * 512 * 512;
  EXPECT_EQ(maps.unit(), 0x1p-30f);
  EXPECT_EQ(maps.sums()[at], count * static_cast<std::uint64_t>(1.9999f * 0x1p30f));
  EXPECT_EQ(maps.sums()[at + 1], count << 30);
  EXPECT_EQ(maps.sums()[at + 2], count) << "texels a 2^31st as bright have a unit";

  for (RsmTexel& t : plate.texel) t.flux = glm::vec3(1e30f);
  lit(volume, {plate.image()});
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) EXPECT_LE(radianceOf(volume, s).x, 1e9f);
  for (RsmTexel& t : plate.texel) t.flux = glm::vec3(1e-38f);
  lit(volume, {plate.image()});
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) EXPECT_LE(radianceOf(volume, s).x, 1e-20f);
  EXPECT_EQ(rsmUnit(0.0f), 1.0f);
  EXPECT_EQ(rsmUnit(1.0f), 0x1p-30f);
  EXPECT_EQ(rsmUnit(std::nextafter(1.0f, 0.0f)), 0x1p-31f);
}

TEST(RsmVoxels, threadsChangeNothing) {
  VoxelVolume one = roomWithFloor(), many = one;
  many.useParallelFor([](std::uint32_t tasks, const auto& body) { onThreads(4, tasks, body); });
  LitPlate plate(200, {0.3f, 1.7f, 2.9f}), wall(150, {5, 0, 1});
  wall.place({1.5f, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0});
  const std::vector<RsmImage> images{plate.image(), wall.image()};
  const RsmVoxels a = lit(one, images), b = lit(many, images);
  EXPECT_TRUE(std::equal(a.sums().begin(), a.sums().end(), b.sums().begin(), b.sums().end()));
  for (std::uint32_t s = 0; s < one.sideCount(); ++s) EXPECT_EQ(radianceOf(one, s), radianceOf(many, s));
}

TEST(RsmVoxels, whatMovesIsLitWhereItIs) {
  VoxelLevel level;
  level.addBox(glm::vec3(-1.5f), glm::vec3(1.5f), true);
  level.addQuad({-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1});
  level.parts[1].moves = true;
  VoxelVolume volume = volumeOf(level, coarse(16));
  const LitPlate plate(128);
  RsmVoxels maps = lit(volume, {plate.image()});
  const double expected = std::numbers::pi * static_cast<double>(plateArea());
  EXPECT_NEAR(fluxOf(volume), expected, 1e-4 * expected);
  glm::mat4x3 to(1.0f);
  to[3].y = 0.5f;
  ASSERT_TRUE(volume.move(std::vector<glm::mat4x3>{to}));
  ASSERT_TRUE(maps.light(volume, std::vector<RsmImage>{plate.image()}, glm::vec3(0.0f)));
  EXPECT_EQ(maps.arrived(), 0.0f) << "it is no longer where the map sees it";
  // And where what moves lies in what stands
  to[3].y = -1.5f;
  ASSERT_TRUE(volume.move(std::vector<glm::mat4x3>{to}));
  LitPlate below = plate;
  below.place({0, -1.5f, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0});
  ASSERT_TRUE(maps.light(volume, std::vector<RsmImage>{below.image()}, glm::vec3(0.0f)));
  EXPECT_EQ(maps.arrived(), 1.0f);
  EXPECT_NEAR(fluxOf(volume), expected, 1e-3 * expected);
}

// What a cone sees from above the plate.
TEST(RsmVoxels, conesFindTheLight) {
  VoxelVolume volume = roomWithFloor();
  const LitPlate plate(kRsmVoxelsSide);
  lit(volume, {plate.image()});
  RadianceMips mips;
  ASSERT_TRUE(mips.update(volume));
  const ConeTracer tracer(volume, mips, {});
  const glm::vec3 down = tracer.glossy({0, 1.5f, 0}, {0, -1, 0}, {0, -1, 0}, 64.0f);
  EXPECT_NEAR(down.x, 1.0f, 0.1f);
  const glm::vec3 across = tracer.glossy({0, -1.5f, 0}, {0, 1, 0}, {0, 1, 0}, 64.0f);
  EXPECT_LT(across.x, 0.01f) << "of the plate's back";
}

TEST(RsmVoxels, emissionIsAdded) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.5f)}, {glm::vec3(0.5f), glm::vec3(3.0f, 0.0f, 0.0f)}};
  level.addBox(glm::vec3(-1.5f), glm::vec3(1.5f), true);
  level.addQuad({-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, 1);
  VoxelVolume volume = volumeOf(level, coarse(8));
  RsmVoxels maps;
  ASSERT_TRUE(maps.light(volume, {}, glm::vec3(2.0f)));
  VoxelVolume other = volume;
  other.reflect({}, glm::vec3(2.0f));
  for (std::uint32_t s = 0; s < volume.sideCount(); ++s) EXPECT_EQ(radianceOf(volume, s), radianceOf(other, s));
}

TEST(RsmVoxels, whatIsRefusedLeavesTheLight) {
  VoxelVolume volume = roomWithFloor(8);
  const LitPlate plate(64);
  RsmVoxels maps = lit(volume, {plate.image()});
  const double before = fluxOf(volume);
  LitPlate bad(64);
  bad.texel[9].flux.y = std::numeric_limits<float>::quiet_NaN();
  const auto refused = [&](const RsmImage& image, const glm::vec3& scale) {
    const std::vector<RsmImage> images{plate.image(), image};
    const Status status = maps.light(volume, images, scale);
    EXPECT_FALSE(status);
    if (status) return std::string();
    EXPECT_EQ(status.error().code, ErrorCode::usage);
    return status.error().message;
  };
  EXPECT_NE(refused(bad.image(), glm::vec3(0.0f)).find("map 1: texel 9: its flux"), std::string::npos);
  RsmImage few = plate.image();
  few.side = 63;
  EXPECT_NE(refused(few, glm::vec3(0.0f)).find("4096 texels, expected"), std::string::npos);
  EXPECT_NE(refused(plate.image(), {1, -1, 1}).find("emissionScale"), std::string::npos);
  EXPECT_EQ(fluxOf(volume), before);
}

}  // namespace
}  // namespace relume
