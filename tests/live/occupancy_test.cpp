// SPDX-License-Identifier: MIT
// Which cells hold light: by voxels, by what a camera sees, and their neighbours.
#include "runtime/live/occupancy.h"
#include "runtime/live/rsm_light.h"
#include "tests/live/lit_maps.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace relume {
namespace {

using namespace test;

// A room with a box in it, 16 cells along it.
VoxelVolume room() {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {4, 3, 5}, true);
  level.addBox({1, 0, 1}, {2, 1.5f, 2}, false);
  return volumeOf(level, coarse(16));
}

// What an eye in the room sees, by the room's faces, as depths along -z; and where each pixel's ray ends.
struct RoomView {
  static constexpr std::uint32_t kWidth = 160, kHeight = 120;
  std::vector<float> depth;
  std::vector<glm::vec3> position, normal;
  DepthView view;

  explicit RoomView(std::uint32_t stride) {
    const glm::vec3 eye(3.3f, 2.2f, 4.6f);
    view.worldFromPixel =
        glm::mat4x3(glm::vec3(0.01f, 0, 0), glm::vec3(0, -0.01f, 0), glm::vec3(-0.9f, 0.4f, -1.0f), eye);
    for (std::uint32_t i = 0; i < kWidth * kHeight; ++i) {
      const glm::vec3 way(0.01f * static_cast<float>(i % kWidth) - 0.9f, 0.4f - 0.01f * static_cast<float>(i / kWidth),
                          -1.0f);
      float nearest = std::numeric_limits<float>::infinity();
      glm::vec3 n(0.0f);
      for (int a = 0; a < 3; ++a) {
        // Out through the room's faces, in through the box's.
        const float wall = way[a] > 0.0f ? glm::vec3(4, 3, 5)[a] : 0.0f;
        const float t = way[a] != 0.0f ? (wall - eye[a]) / way[a] : nearest;
        if (t < nearest) {
          nearest = t;
          n = glm::vec3(0.0f);
          n[a] = way[a] > 0.0f ? -1.0f : 1.0f;
        }
        const float side = way[a] > 0.0f ? glm::vec3(1, 0, 1)[a] : glm::vec3(2, 1.5f, 2)[a];
        const float b = way[a] != 0.0f ? (side - eye[a]) / way[a] : nearest;
        const glm::vec3 at = eye + b * way;
        bool isOn = b > 0.0f && b < nearest;
        for (int o = 0; o < 3; ++o)
          isOn = isOn && (o == a || (at[o] >= glm::vec3(1, 0, 1)[o] && at[o] <= glm::vec3(2, 1.5f, 2)[o]));
        if (!isOn) continue;
        nearest = b;
        n = glm::vec3(0.0f);
        n[a] = way[a] > 0.0f ? -1.0f : 1.0f;
      }
      depth.push_back(nearest);
      position.push_back(eye + nearest * way);
      normal.push_back(n);
    }
    view.depth = depth;
    view.width = kWidth;
    view.height = kHeight;
    view.stride = stride;
  }
};

TEST(Occupancy, dilationAddsAllNeighboursAndNothingElse) {
  VolumeGrid grid;
  grid.cells = {9, 8, 7};
  std::mt19937 random(1);
  std::vector<std::uint8_t> cells(grid.cellCount(), 0);
  for (int i = 0; i < 12; ++i) cells[random() % cells.size()] = 1;
  const std::vector<std::uint8_t> wide = dilate(grid, cells);
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    bool expected = false;
    for (int k = 0; k < 27; ++k) {
      const glm::ivec3 at = grid.cellAt(c) + glm::ivec3(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
      const bool isIn = glm::clamp(at, glm::ivec3(0), grid.cells - 1) == at;
      expected = expected || (isIn && cells[grid.cellIndex(at)] != 0);
    }
    EXPECT_EQ(wide[c] != 0, expected) << c;
  }
}

TEST(Occupancy, cellsThatAreSeenAreAmongThoseWithVoxels) {
  const VoxelVolume volume = room();
  const RoomView seen(10);
  const std::vector<std::uint8_t> byVoxels = dilate(volume.grid(), occupiedCells(volume.bits())),
                                  byDepth = dilate(volume.grid(), seenCells(volume.grid(), seen.view));
  std::size_t some = 0;
  for (std::size_t c = 0; c < byDepth.size(); ++c) {
    EXPECT_LE(byDepth[c], byVoxels[c]) << c;
    some += byDepth[c];
  }
  EXPECT_GT(some, byDepth.size() / 10);
  EXPECT_LT(some, static_cast<std::size_t>(std::count(byVoxels.begin(), byVoxels.end(), 1)));
}

TEST(Occupancy, everyCellThatAPixelReadsIsActive) {
  const VoxelVolume volume = room();
  const RoomView seen(10);
  const LitPlate plate(8);
  for (const CellOccupancy occupancy : {CellOccupancy::voxels, CellOccupancy::depth}) {
    RsmOptions options;
    options.occupancy = occupancy;
    options.bounces = 1;
    auto light = RsmLight::create(options);
    ASSERT_TRUE(light);
    RsmFrame frame;
    const RsmImage image = plate.image();
    frame.images = {&image, 1};
    RoomView all(1);  // every pixel has set its cell
    frame.depth = &all.view;
    ASSERT_TRUE(light->update(volume, frame));
    float lit = 0.0f;
    for (std::size_t i = 0; i < seen.position.size(); i += 3) {
      EXPECT_EQ(light->missedReads(seen.position[i], seen.normal[i]), 0) << i;
      lit += light->irradiance(seen.position[i], seen.normal[i]).x;
    }
    EXPECT_GT(lit, 0.0f);
  }
}

TEST(Occupancy, whatADepthViewRefuses) {
  RoomView good(10);
  EXPECT_TRUE(checkDepthView(good.view));
  const auto refused = [&](auto change) {
    RoomView bad(10);
    change(bad);
    const Status ok = checkDepthView(bad.view);
    return ok ? std::string() : ok.error().message;
  };
  EXPECT_NE(refused([](RoomView& v) { v.view.width = 161; }).find("depths, expected"), std::string::npos);
  EXPECT_NE(refused([](RoomView& v) { v.view.width = 0; }).find("pixels, expected"), std::string::npos);
  EXPECT_NE(refused([](RoomView& v) { v.view.stride = 0; }).find("stride"), std::string::npos);
  EXPECT_NE(refused([](RoomView& v) { v.depth[33] = std::numeric_limits<float>::quiet_NaN(); }).find("pixel 33"),
            std::string::npos);
  EXPECT_NE(refused([](RoomView& v) {
              v.view.worldFromPixel[1].z = std::numeric_limits<float>::infinity();
            }).find("worldFromPixel"),
            std::string::npos);
  // Depths at infinity and below 0 see nothing.
  RoomView empty(10);
  for (std::size_t i = 0; i < empty.depth.size(); ++i)
    empty.depth[i] = i % 2 == 0 ? std::numeric_limits<float>::infinity() : -1.0f;
  const std::vector<std::uint8_t> cells = seenCells(room().grid(), empty.view);
  EXPECT_EQ(std::count(cells.begin(), cells.end(), 1), 0);
}

}  // namespace
}  // namespace relume
