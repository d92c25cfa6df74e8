// SPDX-License-Identifier: MIT
// Light by reflective shadow maps against what is known exactly: furnaces, uniform fields, walls, bands; threads, and
// what is refused.
#include "runtime/live/rsm_light.h"
#include "formats/color.h"
#include "runtime/live/rsm_bounces.h"
#include "tests/live/lit_maps.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kY0 = 0.28209479f;

RsmLight lightBy(const RsmOptions& options) {
  auto made = RsmLight::create(options);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

// Radiance 1 from everywhere, in Y, in all cells.
CellField uniformField(const Bands& bands, const VolumeGrid& grid) {
  CellField field;
  clearField(bands, grid.cellCount(), field);
  for (std::uint32_t c = 0; c < grid.cellCount(); ++c) {
    field.at(c)[0] = 1.0f / kY0;
    field.at(c)[field.count()] = 1.0f;
  }
  return field;
}

std::vector<std::uint32_t> allCells(const VolumeGrid& grid) {
  std::vector<std::uint32_t> cells(grid.cellCount());
  for (std::uint32_t c = 0; c < cells.size(); ++c) cells[c] = c;
  return cells;
}

// Cells whose voxels are none of them outside of a closed room's walls.
VoxelVolume closedRoom() {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {3.8f, 3.8f, 3.8f}, true);
  return volumeOf(level, coarse(8));
}

TEST(RsmNextBounce, aUniformFieldIsReflectedByTheAlbedo) {
  const VoxelVolume volume = closedRoom();
  const VolumeGrid& grid = volume.grid();
  const std::vector<std::uint32_t> cells = allCells(grid);
  for (const CellVisibility mode : {CellVisibility::exact, CellVisibility::sampled}) {
    // Every ray ends at a wall: exactly, and by samples where they are many.
    const CellOcclusion occlusion{grid, volume.bits(), mode, 64};
    SecondaryRays rays{64, 64.0f, 0.3f, 0};
    CellField first = uniformField({3, 3}, grid), in = first, out = first;
    std::fill(first.numbers.begin(), first.numbers.end(), 0.0f);
    gatherNextBounce(first, in, rays, occlusion, cells, {}, out);
    int counted = 0;
    double sum = 0.0;
    for (int z = 2; z < 6; ++z) {
      for (int x = 2; x < 6; ++x) {
        const double radiance = out.at(grid.cellIndex({x, 4, z}))[0] * kY0;
        if (mode == CellVisibility::exact) {
          EXPECT_NEAR(radiance, 0.3, 1e-5) << "Eq. (4) in a uniform field is rho L";
        }
        sum += radiance;
        ++counted;
      }
    }
    EXPECT_NEAR(sum / counted, 0.3, mode == CellVisibility::exact ? 1e-5 : 0.03);
  }
}

TEST(RsmNextBounce, twoBouncesOfAFurnaceAreNotCountedTwice) {
  const VoxelVolume volume = closedRoom();
  const VolumeGrid& grid = volume.grid();
  const std::vector<std::uint32_t> cells = allCells(grid);
  const CellOcclusion occlusion{grid, volume.bits(), CellVisibility::exact, 1};
  const SecondaryRays rays{64, 64.0f, 0.5f, 0};
  const CellField first = uniformField({3, 1}, grid);
  // Erratum: the print adds T L to L itself, 1 -> 1.5 -> 2.25.
  CellField now = first, next = first, printed = first, printedNext = first;
  for (int pass = 0; pass < 2; ++pass) {
    gatherNextBounce(first, now, rays, occlusion, cells, {}, next);
    std::swap(now, next);
    gatherNextBounce(printed, printed, rays, occlusion, cells, {}, printedNext);
    std::swap(printed, printedNext);
  }
  // In the room's middle, from where all rays meet walls; the walls' cells see out of the room as well.
  const std::uint32_t middle = grid.cellIndex({4, 4, 4});
  EXPECT_NEAR(now.at(middle)[0] * kY0, 1.75f, 0.02f);
  EXPECT_NEAR(printed.at(middle)[0] * kY0, 2.25f, 0.03f);
}

// Two rooms, and a lit plate in the first: the floor there, or the side of the wall that faces it.
struct TwoRooms {
  VoxelLevel level;
  std::vector<LitPlate> plates;
  std::vector<RsmImage> images;

  // The wall's thickness in voxels of a volume of so many cells.
  explicit TwoRooms(float thickness, float cells = 32) {
    const float half = 4.0f / (4.0f * cells - 1.0f) * thickness;
    level.addBox({0, 0, 0}, {8, 3, 4}, true);
    level.addBox({4 - half, 0, 0}, {4 + half, 3, 4}, false);
    plates.resize(2, LitPlate(32));
    plates[0].place({2, 0, 2}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0});
    plates[1].place({0, 1.5f, 2}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0});
    for (const LitPlate& plate : plates) images.push_back(plate.image());
  }
};

// Mean irradiance of floor and ceiling of the second room over that of the first, from two cells off the wall on.
double leak(const RsmLight& light) {
  const float near = 4.0f - 2.0f * light.grid().cell();
  double lit = 0.0, dark = 0.0;
  for (float z = 0.2f; z < 3.9f; z += 0.2f) {
    for (float x = 0.1f; x < near; x += 0.1f) {
      lit += light.irradiance({x, 0, z}, {0, 1, 0}).x + light.irradiance({x, 3, z}, {0, -1, 0}).x;
      dark += light.irradiance({8 - x, 0, z}, {0, 1, 0}).x + light.irradiance({8 - x, 3, z}, {0, -1, 0}).x;
    }
  }
  return dark / lit;
}

TEST(RsmLight, aWallKeepsTheNextRoomDark) {
  for (const std::uint32_t cells : {8u, 32u}) {
    for (const float thickness : {0.25f, 1.75f, 3.0f}) {
      TwoRooms rooms(thickness, static_cast<float>(cells));
      const VoxelVolume volume = volumeOf(rooms.level, coarse(cells));
      RsmFrame frame;
      frame.images = rooms.images;
      RsmOptions options;
      options.bounces = 1;
      options.visibility = CellVisibility::none;
      RsmLight open = lightBy(options);
      ASSERT_TRUE(open.update(volume, frame));
      EXPECT_GT(leak(open), 0.05) << "nothing hides anything";
      options.visibility = CellVisibility::exact;
      RsmLight exact = lightBy(options);
      ASSERT_TRUE(exact.update(volume, frame));
      EXPECT_LE(leak(exact), 1e-3) << cells << " " << thickness;
      // As printed, where the wall is as thick as a voxel's diagonal: nothing passes where the samples of a way are no
      // farther apart, and of longer ways a part does.
      options.visibility = CellVisibility::sampled;
      RsmLight sampled = lightBy(options);
      ASSERT_TRUE(sampled.update(volume, frame));
      if (thickness > 1.74f) {
        EXPECT_LE(leak(sampled), cells == 8 ? 0.05 : 0.12) << cells << " " << thickness;
      }
      EXPECT_GT(sampled.irradiance({1, 3, 2}, {0, -1, 0}).x, 0.0f);
    }
  }
}

TEST(RsmLight, bandsAreTheFirstOfMore) {
  TwoRooms rooms(2.0f);
  for (RsmTexel& t : rooms.plates[0].texel) t.flux *= glm::vec3(1, 0.1f, 0.02f);
  for (RsmTexel& t : rooms.plates[1].texel) t.flux *= glm::vec3(0.05f, 0.2f, 1);
  const VoxelVolume volume = volumeOf(rooms.level, coarse(16));
  RsmFrame frame;
  frame.images = rooms.images;
  RsmOptions options;
  options.bands = {3, 3};
  RsmLight full = lightBy(options);
  ASSERT_TRUE(full.update(volume, frame));
  for (const Bands bands : {Bands{3, 2}, Bands{3, 1}, Bands{2, 2}}) {
    options.bands = bands;
    options.bounces = 1;
    RsmLight few = lightBy(options), all = lightBy([&] {
                                       RsmOptions o = options;
                                       o.bands = {3, 3};
                                       return o;
                                     }());
    ASSERT_TRUE(few.update(volume, frame));
    ASSERT_TRUE(all.update(volume, frame));
    const auto luma = static_cast<std::size_t>(bands.luma * bands.luma),
               chroma = static_cast<std::size_t>(bands.chroma * bands.chroma);
    for (const std::uint32_t c : few.activeCells()) {
      const float *a = few.field().at(c), *b = all.field().at(c);
      for (std::size_t i = 0; i < luma; ++i) EXPECT_FLOAT_EQ(a[i], b[i]);
      for (std::size_t i = 0; i < chroma; ++i) {
        EXPECT_FLOAT_EQ(a[luma + i], b[9 + i]);
        EXPECT_FLOAT_EQ(a[luma + chroma + i], b[18 + i]);
      }
    }
    // Irradiance as the house's bands have it.
    const std::uint32_t cell = few.activeCells()[few.activeCells().size() / 2];
    FieldNumbers numbers{};
    std::copy_n(few.field().at(cell), few.field().count(), numbers.begin());
    const std::span<const float> n(numbers);
    for (const glm::vec3& normal : {glm::vec3(0, 1, 0), glm::normalize(glm::vec3(1, -2, 0.5f))}) {
      const glm::vec3 e = irradianceOf(few.field(), numbers, clampedLobe(normal));
      EXPECT_NEAR(e.x, irradianceClamped(bands.luma, n.first(luma), normal), 1e-5f);
      EXPECT_NEAR(e.y, irradianceClamped(bands.chroma, n.subspan(luma, chroma), normal), 1e-5f);
      EXPECT_NEAR(e.z, irradianceClamped(bands.chroma, n.subspan(luma + chroma, chroma), normal), 1e-5f);
    }
  }
  EXPECT_EQ(fieldTextures({3, 3}), 7u);
  EXPECT_EQ(fieldTextures({3, 2}), 5u);
  EXPECT_EQ(fieldTextures({3, 1}), 3u);
}

TEST(RsmLight, oneBandOfChromaKeepsTheSaturation) {
  TwoRooms rooms(2.0f);
  for (RsmTexel& t : rooms.plates[0].texel) t.flux *= glm::vec3(1, 0.5f, 0.25f);
  const VoxelVolume volume = volumeOf(rooms.level, coarse(16));
  RsmOptions options;
  options.bands = {3, 1};
  options.bounces = 1;
  RsmLight light = lightBy(options);
  RsmFrame frame;
  frame.images = {rooms.images.data(), 1};
  ASSERT_TRUE(light.update(volume, frame));
  const glm::vec3 colour = rgbToYCoCg({1, 0.5f, 0.25f});
  int lit = 0;
  for (const glm::vec3& normal : {glm::vec3(0, -1, 0), glm::normalize(glm::vec3(1, -1, 0)), glm::vec3(0, 0, 1)}) {
    const glm::vec3 e = rgbToYCoCg(light.irradiance({2, 3, 2}, normal));
    if (e.x == 0.0f) continue;
    ++lit;
    EXPECT_NEAR(e.y / e.x, colour.y / colour.x, 1e-4f);
    EXPECT_NEAR(e.z / e.x, colour.z / colour.x, 1e-4f);
  }
  EXPECT_GE(lit, 2);
}

TEST(RsmLight, twoBandsOfAllAreTwoBandsOfRgb) {
  // Y2Co2Cg2 is R2G2B2: the transform is linear.
  TwoRooms rooms(2.0f);
  for (RsmTexel& t : rooms.plates[0].texel) t.flux *= glm::vec3(1, 0.1f, 0.4f);
  const std::vector<RsmSample> samples = drawSamples(rooms.images, 100, 0);
  std::array<float, 12> yCoCg{};
  std::array<std::array<float, 4>, 3> rgb{};
  const glm::vec3 place(1.0f, 1.2f, 2.5f);
  for (const RsmSample& sample : samples) {
    addSample(sample, place, nullptr, 0.0f, {2, 2}, yCoCg);
    const glm::vec3 power = yCoCgToRgb(sample.power);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      RsmSample grey = sample;
      grey.power = {power[static_cast<int>(channel)], 0, 0};
      std::array<float, 12> numbers{};
      addSample(grey, place, nullptr, 0.0f, {2, 2}, numbers);
      for (std::size_t i = 0; i < 4; ++i) rgb[channel][i] += numbers[i];
    }
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::vec3 c = yCoCgToRgb({yCoCg[i], yCoCg[4 + i], yCoCg[8 + i]});
    for (std::size_t channel = 0; channel < 3; ++channel)
      EXPECT_NEAR(c[static_cast<int>(channel)], rgb[channel][i], 1e-5f * std::abs(rgb[channel][0]));
  }
}

TEST(RsmLight, presenceScalesAllAndBleedingTheColour) {
  TwoRooms rooms(2.0f);
  for (RsmTexel& t : rooms.plates[0].texel) t.flux *= glm::vec3(1, 0.5f, 0.25f);
  const VoxelVolume volume = volumeOf(rooms.level, coarse(16));
  RsmOptions options;
  RsmFrame frame;
  frame.images = {rooms.images.data(), 1};
  const auto read = [&] {
    RsmLight light = lightBy(options);
    EXPECT_TRUE(light.update(volume, frame));
    return rgbToYCoCg(light.irradiance({2, 3, 2}, {0, -1, 0}));
  };
  const glm::vec3 plain = read();
  frame.presence = 2.0f;
  EXPECT_NEAR(glm::distance(read(), 2.0f * plain), 0.0f, 1e-5f);
  frame.bleeding = 0.25f;
  EXPECT_NEAR(glm::distance(read(), 2.0f * plain * glm::vec3(1, 0.25f, 0.25f)), 0.0f, 1e-5f);
  // Of an area, which holds the receiver or does not.
  RsmArea area{{0, 0, 0}, {4, 4, 4}, 0.5f, 4.0f};
  frame.areas = {&area, 1};
  EXPECT_NEAR(glm::distance(read(), plain), 0.0f, 1e-5f);
  area.boxMin.x = area.boxMax.x = 7.0f;
  EXPECT_NEAR(glm::distance(read(), 2.0f * plain * glm::vec3(1, 0.25f, 0.25f)), 0.0f, 1e-5f);
}

TEST(RsmLight, blendingIsTheMeanOverFrames) {
  TwoRooms rooms(2.0f);
  const VoxelVolume volume = volumeOf(rooms.level, coarse(8));
  RsmFrame frame;
  frame.images = rooms.images;
  RsmLight light = lightBy({}), once = lightBy({});
  std::vector<double> mean;
  for (std::uint32_t f = 0; f < 4; ++f) {
    frame.sampleSet = f;
    frame.keep = 0.0f;
    ASSERT_TRUE(once.update(volume, frame));
    frame.keep = static_cast<float>(f) / static_cast<float>(f + 1);
    ASSERT_TRUE(light.update(volume, frame));
    mean.resize(once.field().numbers.size());
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += once.field().numbers[i] / 4.0;
  }
  double largest = 0.0;
  for (const double m : mean) largest = std::max(largest, m);
  for (std::size_t i = 0; i < mean.size(); ++i) EXPECT_NEAR(light.field().numbers[i], mean[i], 1e-5 * largest);
}

TEST(RsmLight, sameBytesOnOneTwoAndSevenThreads) {
  TwoRooms rooms(2.0f);
  for (const CellVisibility mode : {CellVisibility::sampled, CellVisibility::exact}) {
    std::vector<float> bytes;
    for (const std::uint32_t threads : {1u, 2u, 7u}) {
      VoxelOptions coarser = coarse(16);
      coarser.parallelFor = [threads](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
        onThreads(threads, tasks, body);
      };
      const VoxelVolume volume = volumeOf(rooms.level, coarser);
      RsmOptions options;
      options.visibility = mode;
      RsmLight light = lightBy(options);
      RsmFrame frame;
      frame.images = rooms.images;
      for (frame.sampleSet = 0; frame.sampleSet < 3; ++frame.sampleSet) {
        frame.keep = 0.5f;
        ASSERT_TRUE(light.update(volume, frame));
      }
      const std::vector<float>& numbers = light.field().numbers;
      if (bytes.empty()) bytes = numbers;
      ASSERT_EQ(bytes.size(), numbers.size());
      EXPECT_EQ(std::memcmp(bytes.data(), numbers.data(), bytes.size() * sizeof(float)), 0) << threads;
    }
  }
}

TEST(RsmLight, extremesStayFinite) {
  TwoRooms rooms(2.0f);
  const VoxelVolume volume = volumeOf(rooms.level, coarse(8));
  std::mt19937 random(7);
  const auto any = [&](float most) {
    return std::exp(std::log(1e-20f) +
                    (std::log(most) - std::log(1e-20f)) * static_cast<float>(random() % 1000) / 999.0f);
  };
  for (const CellVisibility mode : {CellVisibility::none, CellVisibility::sampled, CellVisibility::exact}) {
    LitPlate plate(16);
    for (RsmTexel& t : plate.texel) {
      t.flux = {any(9e29f), any(9e29f), any(9e29f)};
      t.area = any(1e20f);
      if (random() % 2 == 0) t.positionWorld = {any(9e8f), -any(9e8f), any(9e8f)};
    }
    const RsmImage image = plate.image();
    RsmOptions options;
    options.visibility = mode;
    options.bounces = 64;
    RsmFrame frame;
    frame.images = {&image, 1};
    frame.averageAlbedo = 1.0f;
    frame.averagedFrames = 1e6f;
    const std::vector<RsmArea> areas(8, {{-1, -1, -1}, {9, 9, 9}, 100.0f, 100.0f});
    frame.areas = areas;
    RsmLight light = lightBy(options);
    ASSERT_TRUE(light.update(volume, frame));
    for (const float number : light.field().numbers) ASSERT_TRUE(std::isfinite(number));
    for (float x = 0.0f; x < 8.0f; x += 0.5f) {
      const glm::vec3 e = light.irradiance({x, 0, 2}, {0, 1, 0});
      EXPECT_TRUE(e.x >= 0.0f && e.y >= 0.0f && e.z >= 0.0f && std::isfinite(e.x + e.y + e.z));
    }
  }
}

TEST(RsmLight, whatIsRefusedKeepsLastFramesLight) {
  const auto refused = [](auto change) {
    RsmOptions options;
    change(options);
    const auto made = RsmLight::create(options);
    return made ? std::string() : made.error().message;
  };
  EXPECT_NE(refused([](RsmOptions& o) { o.samples = 0; }).find("0 samples"), std::string::npos);
  EXPECT_NE(refused([](RsmOptions& o) { o.samples = 4097; }).find("4097 samples"), std::string::npos);
  EXPECT_NE(refused([](RsmOptions& o) { o.secondaryRays = 0; }).find("secondary rays"), std::string::npos);
  EXPECT_NE(refused([](RsmOptions& o) { o.marchSamples = 65; }).find("samples of a way"), std::string::npos);
  EXPECT_NE(refused([](RsmOptions& o) { o.secondarySamples = 0; }).find("samples of a secondary"), std::string::npos);
  EXPECT_NE(refused([](RsmOptions& o) { o.bounces = 0; }).find("0 bounces"), std::string::npos);
  EXPECT_NE(refused([](RsmOptions& o) { o.occupancy = CellOccupancy::depth; }).find("depth"), std::string::npos);
  for (const Bands bands : {Bands{0, 0}, Bands{4, 1}, Bands{2, 3}, Bands{3, 0}, Bands{3, -1}})
    EXPECT_NE(refused([&](RsmOptions& o) { o.bands = bands; }).find("bands of luma"), std::string::npos);

  TwoRooms rooms(2.0f);
  const VoxelVolume volume = volumeOf(rooms.level, coarse(8));
  RsmLight light = lightBy({});
  RsmFrame good;
  good.images = rooms.images;
  ASSERT_TRUE(light.update(volume, good));
  const std::vector<float> before = light.field().numbers;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<RsmFrame> frames(7, good);
  frames[0].keep = 1.0f;
  frames[1].averageAlbedo = nan;
  frames[2].presence = -1.0f;
  frames[3].bleeding = nan;
  const RsmArea area{{0, 0, nan}, {1, 1, 1}};
  frames[4].areas = {&area, 1};
  const RsmImage image{rooms.plates[0].texel, 31, 1};
  frames[5].images = {&image, 1};
  frames[6].averagedFrames = 0.0f;
  for (const RsmFrame& frame : frames) EXPECT_FALSE(light.update(volume, frame));
  RsmOptions depth;
  depth.occupancy = CellOccupancy::depth;
  depth.bounces = 1;
  EXPECT_FALSE(lightBy(depth).update(volume, good)) << "no depth view";
  EXPECT_EQ(light.field().numbers, before);
  EXPECT_EQ(light.irradiance({nan, 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_EQ(light.irradiance({2, 0, 2}, glm::vec3(nan)), glm::vec3(0.0f));
  EXPECT_EQ(light.irradiance({1e9f, 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_GT(light.irradiance({2, 3, 2}, {0, -1, 0}).x, 0.0f);
  // No lights, and a level of nothing, are dark.
  good.images = {};
  ASSERT_TRUE(light.update(volume, good));
  EXPECT_EQ(light.irradiance({2, 3, 2}, {0, -1, 0}), glm::vec3(0.0f));
  VoxelLevel empty;
  VoxelVolume nothing = volumeOf(empty, coarse(8));
  good.images = rooms.images;
  ASSERT_TRUE(light.update(nothing, good));
  EXPECT_EQ(light.irradiance({2, 3, 2}, {0, -1, 0}), glm::vec3(0.0f));
  light.reset();
  EXPECT_EQ(light.occupancy(), 0.0f);
}

}  // namespace
}  // namespace relume
