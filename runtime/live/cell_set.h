// SPDX-License-Identifier: MIT
// The cells of a volume that hold a cache, where in its cell each one stands, and which caches a receiver reads.
#pragma once

#include "runtime/live/cell_changes.h"
#include "runtime/voxels/voxel_volume.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kInactive = 0xFFFFFFFFu;

// Active cells: those with an occupied voxel and their 26 neighbours (CRC Section 5, dilation), unless they are full.
struct CellSet {
  VolumeGrid grid;
  std::vector<std::uint32_t> active;  // cell of each cache
  std::vector<std::uint32_t> slot;    // [Size cells] cache of each cell, kInactive = none
  std::vector<std::uint8_t> place;    // [Size active] brickBit() of the free voxel in whose middle it stands
  // What stands: what hides a cache from a receiver. Null: no cells.
  std::shared_ptr<const VoxelLayer> standing;
  // Along its axis, of the plane of each standing voxel. [Size voxels that are kept, 1/64 voxel from the middle]
  std::vector<std::int8_t> height;
  // What of each cell tells where caches stand and what they see, in one number; of what stands, and of all.
  std::vector<std::uint64_t> standingContent, content;  // [Size cells]
  std::uint64_t standingVersion = 0;                    // VoxelVolume::standingVersion()

  // Where the cache of a cell stands, of a cell that has that one; of any.
  glm::ivec3 voxelIn(const glm::ivec3& cell, std::uint32_t cache) const {
    return kBrickSide * cell + voxelOfBit(place[cache]);
  }
  glm::ivec3 voxelOf(std::uint32_t cache) const { return voxelIn(grid.cellAt(active[cache]), cache); }
  glm::vec3 positionOf(std::uint32_t cache) const { return glm::vec3(voxelOf(cache)) + 0.5f; }  // [voxels]
  // 127 times the unit normal of a standing voxel's plane, and its height; of any voxel of the grid, 0 = it has none.
  std::array<std::int8_t, 4> planeAt(const glm::ivec3& v) const {
    const std::uint32_t cell = grid.cellOf(v);
    const std::uint64_t bits = standing->bits[cell];
    if ((bits >> brickBit(v) & 1u) == 0) return {};
    const std::uint32_t number = standing->first[cell] + countBefore(bits, v);
    if (number >= standing->kept) return {};
    const glm::i8vec3& axis = standing->axis[number];
    return {axis.x, axis.y, axis.z, height[number]};
  }
};

// Deviation: CRC takes places anywhere in a cell. Here the cache stands in the free voxel from which its rays meet the
// fewest backs of surfaces, of these the one nearest to the cell's middle: not behind the wall that the cell lights.
CellSet findCells(const VoxelVolume& volume);

inline constexpr int kPlaceReach = 4;  // cells whose voxels tell where a cell's cache stands
// And where those stand that a receiver in a cell reads.
inline constexpr int kStencilReach = kFarthestChange;

// The same of a volume of which `before` was found: caches far from all that has changed stand where they stood.
struct ChangedCells {
  CellSet cells;
  CellChanges changes;
};
ChangedCells findChangedCells(const VoxelVolume& volume, const CellSet& before);

// Where light of a cell's cache comes from, kInactive = nowhere: the cache of the cell in `before`, of the same volume;
// or in `around`, of the volume that it lies in, of the cell that holds it. [cell: within cells.grid]
std::uint32_t slotBefore(const CellSet& before, const CellSet& cells, const glm::ivec3& cell);
std::uint32_t slotAround(const CellSet& around, const CellSet& cells, const glm::ivec3& cell);

// Caches and weights, which sum to 1, or are 0 where there is no cache.
struct CellStencil {
  std::array<std::uint32_t, 8> slot{};
  std::array<float, 8> weight{};
};

// The eight caches around a place a voxel before the receiver (CRC Section 3: half a cell), trilinear by where they
// stand, of those that it sees. Where it sees none it reads all that lie before it. position [voxels]; normal is unit.
CellStencil stencilAt(const CellSet& cells, const glm::vec3& position, const glm::vec3& normal);

// What takes time to find of it, kept of each side as long as what is seen of its cells lasts: a bit for each of the
// eight that the receiver sees. The rest is found anew, to the bit wherever the grid has been moved to.
using SeenCaches = std::uint8_t;
SeenCaches seenCaches(const CellSet& cells, const glm::vec3& position, const glm::vec3& normal);
CellStencil stencilOf(const CellSet& cells, const glm::vec3& position, const glm::vec3& normal, SeenCaches seen);

}  // namespace relume
