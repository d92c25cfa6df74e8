// SPDX-License-Identifier: MIT
// What is kept of a volume's caches when a part of it changes: as if all had been found anew.
#include "runtime/live/cell_set.h"

#include "runtime/live/live_caches.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <vector>

namespace relume {
namespace {

using test::VoxelLevel;

VoxelOptions longHall() {
  VoxelOptions options;
  options.boxMin = {-16, -3, -3};
  options.boxMax = {16, 3, 3};
  options.cells = 32;
  return options;
}

// Boxes in a hall of 32 m, the last four of which move.
VoxelLevel cratesInAHall() {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> along(-15.0f, 14.0f), across(-2.9f, 2.0f), size(0.1f, 0.9f);
  VoxelLevel level;
  level.surfaces.resize(2);
  level.surfaces[1].emission = {2.0f, 1.0f, 0.5f};
  level.addBox({-16, -3, -3}, {16, 3, 3}, true);
  for (std::uint32_t i = 0; i < 30; ++i) {
    const glm::vec3 low(along(random), across(random), across(random));
    level.addBox(low, low + glm::vec3(size(random), size(random), size(random)), false, i % 5 == 0 ? 1 : 0);
    level.parts.back().moves = i >= 26;
  }
  return level;
}

// Light of one frame whose caches all gather anew. Bits of light by what was found before, and by what is found now.
void expectTheSameLight(const LiveCaches& followed, const VoxelVolume& volume) {
  std::array<std::vector<float>, 2> light;
  for (std::size_t i = 0; i < 2; ++i) {
    LiveCaches caches = followed;
    if (i == 1) {
      caches = *LiveCaches::create({16});
    } else {
      caches.reset();
    }
    VoxelVolume copy = volume;
    LiveFrame frame;
    for (; frame.raySet < 2; ++frame.raySet) ASSERT_TRUE(caches.update(copy, frame));
    light[i].assign(caches.coefficients().begin(), caches.coefficients().end());
  }
  ASSERT_EQ(light[0].size(), light[1].size());
  EXPECT_EQ(std::memcmp(light[0].data(), light[1].data(), light[0].size() * sizeof(float)), 0);
}

void expectFoundAnew(const CellSet& kept, const VoxelVolume& volume) {
  const CellSet found = findCells(volume);
  EXPECT_EQ(kept.active, found.active);
  EXPECT_EQ(kept.slot, found.slot);
  EXPECT_EQ(kept.place, found.place);
  EXPECT_EQ(kept.standing, found.standing);
  EXPECT_EQ(kept.height, found.height);
  EXPECT_EQ(kept.content, found.content);
}

TEST(CellChanges, editsAndMovesLeaveTheRestAsItStands) {
  VoxelLevel level = cratesInAHall();
  auto volume = VoxelVolume::create(level.geometry(), longHall());
  ASSERT_TRUE(volume) << volume.error().message;
  LiveCaches caches = *LiveCaches::create({16});
  ASSERT_TRUE(caches.update(*volume, {}));
  std::mt19937 random(12);
  std::uniform_real_distribution<float> step(-0.7f, 0.7f);
  const auto somewhere = [&] {
    glm::mat4x3 to(1.0f);
    to[3] = glm::vec3(step(random), step(random), step(random));
    return to;
  };
  for (int frame = 0; frame < 10; ++frame) {
    const CellSet before = caches.cells();
    const PartEdit edit{1 + static_cast<std::uint32_t>(random() % 26), somewhere(), frame % 4 != 3};
    const std::array<glm::mat4x3, 4> moved{somewhere(), somewhere(), somewhere(), somewhere()};
    // Both at once, one, the other.
    if (frame % 3 != 1) {
      ASSERT_TRUE(volume->edit({&edit, 1}));
    }
    if (frame % 3 != 0) {
      ASSERT_TRUE(volume->move(moved));
    }
    const ChangedCells found = findChangedCells(*volume, before);
    expectFoundAnew(found.cells, *volume);
    std::size_t same = 0;
    for (std::uint32_t c = 0; c < found.cells.slot.size(); ++c)
      same += found.changes.seesTheSame(volume->grid(), volume->grid().cellAt(c), kStencilReach) ? 1 : 0;
    EXPECT_LT(same, found.cells.slot.size());
    if (frame % 3 == 0) {
      EXPECT_GT(2 * same, found.cells.slot.size()) << "an edit within 32 m";
    }
    ASSERT_TRUE(caches.update(*volume, {}));
    expectFoundAnew(caches.cells(), *volume);
    expectTheSameLight(caches, *volume);
  }
}

// The distance to what has changed is the largest of those along the axes, and no more than is asked for.
TEST(CellChanges, areSoManyCellsAway) {
  VoxelLevel level = cratesInAHall();
  auto volume = VoxelVolume::create(level.geometry(), longHall());
  ASSERT_TRUE(volume);
  const CellSet now = findCells(*volume);
  CellSet before = now;
  const glm::ivec3 at(9, 2, 4);
  ++before.content[now.grid.cellIndex(at)];
  const ChangedCells found = findChangedCells(*volume, before);
  for (std::uint32_t c = 0; c < found.changes.distance.size(); ++c) {
    const glm::ivec3 d = glm::abs(now.grid.cellAt(c) - at);
    EXPECT_EQ(found.changes.distance[c], std::min(std::max({d.x, d.y, d.z}), kFarthestChange + 1)) << c;
  }
}

// A wall that is turned over has the same voxels, and others see its back.
TEST(CellChanges, aWallThatIsTurnedOverIsAChange) {
  VoxelLevel level;
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  level.addQuad({-1, -1, 0.1f}, {1, -1, 0.1f}, {1, 1, 0.1f}, {-1, 1, 0.1f});
  VoxelOptions options;
  options.cells = 16;
  auto volume = VoxelVolume::create(level.geometry(), options);
  ASSERT_TRUE(volume);
  const CellSet before = findCells(*volume);
  const std::vector<std::uint64_t> bits(volume->bits().begin(), volume->bits().end());
  PartEdit turn{1, glm::mat4x3(1.0f), true};
  turn.toWorld[1].y = turn.toWorld[2].z = -1.0f;
  turn.toWorld[3].z = 0.2f;
  ASSERT_TRUE(volume->edit({&turn, 1}));
  ASSERT_TRUE(std::equal(bits.begin(), bits.end(), volume->bits().begin()));
  const ChangedCells found = findChangedCells(*volume, before);
  EXPECT_EQ(*std::min_element(found.changes.distance.begin(), found.changes.distance.end()), 0);
  expectFoundAnew(found.cells, *volume);
}

}  // namespace
}  // namespace relume
