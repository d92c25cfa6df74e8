// SPDX-License-Identifier: MIT
// A box of space cut into cubic cells, and each cell into a brick of 4 x 4 x 4 voxels (CRC Section 5). Positions inside
// are counted in steps of 1/64 voxel from the box's corner, in integers, so that every backend finds the same voxels.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

inline constexpr int kBrickSide = 4;   // voxels
inline constexpr int kVoxelShift = 6;  // bits of a position below a voxel
inline constexpr int kVoxelSteps = 1 << kVoxelShift;
inline constexpr int kSubShift = kVoxelShift - 2;  // the same below a sub-voxel, of which a voxel has 4 x 4 x 4
inline constexpr std::uint32_t kMinCells = 8, kMaxCells = 64;  // on the longest side

struct VolumeGrid {
  glm::vec3 originWorld{0.0f};  // [m] the corner of voxel (0, 0, 0)
  float voxel = 1.0f;           // [m] edge
  glm::ivec3 cells{1};          // [1..kMaxCells]
  // Where the grid has been moved to, in whole cells from a corner that stays: what is found of a place is then the
  // same, to the bit, wherever the grid is (shifted()).
  glm::ivec3 shift{0};
  glm::vec3 anchorWorld{0.0f};  // [m] that corner, unless shift is 0
  bool roams = false;  // it is moved, or the level goes on past it: what reaches across its border counts as if there
                       // were none, and beyond it is the sky

  const glm::vec3& anchor() const { return shift == glm::ivec3(0) ? originWorld : anchorWorld; }
  // Whether their cells are the same ones, but for how many of them each begins from the corner that stays.
  bool sharesCells(const VolumeGrid& other) const {
    return voxel == other.voxel && cells == other.cells && anchor() == other.anchor();
  }
  glm::ivec3 voxels() const { return kBrickSide * cells; }
  std::size_t cellCount() const {
    return static_cast<std::size_t>(cells.x) * static_cast<std::size_t>(cells.y) * static_cast<std::size_t>(cells.z);
  }
  float cell() const { return static_cast<float>(kBrickSide) * voxel; }
  bool holds(const glm::ivec3& v) const {
    return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < 4 * cells.x && v.y < 4 * cells.y && v.z < 4 * cells.z;
  }
  bool holdsCell(const glm::ivec3& c) const {
    return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < cells.x && c.y < cells.y && c.z < cells.z;
  }
  // x fastest. [within cells]
  std::uint32_t cellIndex(const glm::ivec3& c) const {
    return static_cast<std::uint32_t>((c.z * cells.y + c.y) * cells.x + c.x);
  }
  std::uint32_t cellOf(const glm::ivec3& v) const { return cellIndex({v.x >> 2, v.y >> 2, v.z >> 2}); }
  glm::ivec3 cellAt(std::uint32_t index) const {
    const auto i = static_cast<int>(index);
    return {i % cells.x, i / cells.x % cells.y, i / (cells.x * cells.y)};
  }
  // [voxels]
  glm::vec3 toGrid(const glm::vec3& positionWorld) const { return (positionWorld - originWorld) / voxel; }
  bool holdsPlace(const glm::vec3& positionWorld) const {
    const glm::vec3 p = toGrid(positionWorld), size(voxels());
    return p.x >= 0.0f && p.y >= 0.0f && p.z >= 0.0f && p.x < size.x && p.y < size.y && p.z < size.z;
  }
  glm::vec3 toWorld(const glm::vec3& positionGrid) const { return originWorld + voxel * positionGrid; }
  // The same of a place in a voxel, from the corner that stays. [voxels, from the voxel's middle]
  glm::vec3 placeInVoxel(const glm::ivec3& v, const glm::dvec3& place) const {
    return anchor() + voxel * glm::vec3(glm::dvec3(v + kBrickSide * shift) + 0.5 + place);
  }
};

// Where a volume that lies in another is read, by receivers and by cones: from these faces on, and wholly from
// kBlendCells within them on. They end within the volume, or lie far out where nothing takes over. [voxels of the
// volume]
inline constexpr float kBlendCells = 2.0f;
struct VolumeReach {
  glm::vec3 low{-1e9f}, high{1e9f};

  // The share of the volume for what reaches so far about a place: 0 from the faces on, 1 well within. [voxels]
  float share(const glm::vec3& place, float about) const {
    const glm::vec3 within = glm::min(place - low, high - place);
    constexpr float kBlend = kBlendCells * float{kBrickSide};
    return std::clamp((std::min({within.x, within.y, within.z}) - about) / kBlend, 0.0f, 1.0f);
  }
};

// The grid where it begins so many cells from the corner that stays.
inline VolumeGrid shifted(const VolumeGrid& grid, const glm::ivec3& shift) {
  VolumeGrid moved = grid;
  moved.anchorWorld = grid.anchor();
  moved.shift = shift;
  moved.originWorld = moved.anchorWorld;
  if (shift != glm::ivec3(0))
    moved.originWorld = glm::vec3(glm::dvec3(moved.anchorWorld) + double{grid.cell()} * glm::dvec3(shift));
  return moved;
}

// The bit of a voxel in its brick, or of a sub-voxel in its voxel: x fastest.
inline unsigned brickBit(const glm::ivec3& v) {
  return static_cast<unsigned>((v.x & 3) | (v.y & 3) << 2 | (v.z & 3) << 4);
}

// The voxel of a bit, from the brick's corner; or the sub-voxel, from its voxel's.
inline glm::ivec3 voxelOfBit(int bit) { return {bit & 3, bit >> 2 & 3, bit >> 4}; }
// How many voxels of a brick come before one.
inline std::uint32_t countBefore(std::uint64_t brick, const glm::ivec3& v) {
  return static_cast<std::uint32_t>(std::popcount(brick & ((std::uint64_t{1} << brickBit(v)) - 1)));
}

// How many voxels have a bit, and each cell's first of them counted through.
inline std::uint32_t numberBits(const std::vector<std::uint64_t>& bits, std::vector<std::uint32_t>& first) {
  first.resize(bits.size());
  std::uint32_t count = 0;
  for (std::size_t c = 0; c < bits.size(); ++c) {
    first[c] = count;
    count += static_cast<std::uint32_t>(std::popcount(bits[c]));
  }
  return count;
}

// Bits in a grid that begins so many cells farther on: of the cells that both grids have, others are empty.
inline std::vector<std::uint64_t> movedBits(const std::vector<std::uint64_t>& bits, const VolumeGrid& to,
                                            const glm::ivec3& by) {
  std::vector<std::uint64_t> moved(bits.size(), 0);
  for (std::uint32_t c = 0; c < bits.size(); ++c) {
    const glm::ivec3 from = to.cellAt(c) + by;
    if (to.holdsCell(from)) moved[c] = bits[to.cellIndex(from)];
  }
  return moved;
}

// Of volumes that have light: walls at a box's faces may be seen from outside of it, by caches in a voxel before them.
inline constexpr float kLitMargin = 1.5f;  // [voxel]

// The grid over a box with so many cells on its longest side. The box is widened by a margin all around, of half a
// voxel at least, so that walls at its faces lie within a voxel and not between two. A box too small for floats to cut
// gets a metre.
inline VolumeGrid fitGrid(const glm::vec3& boxMin, const glm::vec3& boxMax, std::uint32_t cells, float margin = 0.5f) {
  VolumeGrid grid;
  const glm::vec3 size = glm::max(boxMax - boxMin, glm::vec3(0.0f));
  constexpr float kLeastSize = 1e-9f;  // [m]
  const float longest = std::max({size.x, size.y, size.z}),
              count = static_cast<float>(kBrickSide) * static_cast<float>(cells);
  // Coordinates keep three bits below a voxel.
  const glm::vec3 far = glm::max(glm::abs(boxMin), glm::abs(boxMax));
  const float finest = std::max({far.x, far.y, far.z}) * 0x1p-20f;
  grid.voxel = std::max(longest > kLeastSize ? longest / (count - 2.0f * margin) : 1.0f / count, finest);
  grid.originWorld = boxMin - margin * grid.voxel;
  const auto most = static_cast<int>(cells);
  for (int k = 0; k < 3; ++k) {
    const float needed = std::ceil((size[k] / grid.voxel + 2.0f * margin) / static_cast<float>(kBrickSide) - 1e-4f);
    grid.cells[k] = std::clamp(static_cast<int>(needed), 1, most);
  }
  return grid;
}

}  // namespace relume
