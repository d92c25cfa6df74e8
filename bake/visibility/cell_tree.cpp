// SPDX-License-Identifier: MIT
// See cell_tree.h.
#include "bake/visibility/cell_tree.h"

#include <glm/common.hpp>

#include <algorithm>
#include <utility>

namespace relume {
namespace {

constexpr int kMaxLevels = 30;  // voxels are numbered within ±1e9

struct Place {
  std::uint64_t key;
  glm::ivec3 voxel;
  std::uint32_t axis;  // facing, either way
};

}  // namespace

CellTree::CellTree(const CellGrid& grid, std::span<const CellHits> cells, int reach) : grid_(grid), reach_(reach) {
  std::vector<Place> places;
  places.reserve(cells.size());
  for (const CellHits& c : cells) places.push_back({c.key, c.voxel, c.facing >> 1});
  for (int level = 0; level < kMaxLevels; ++level) {
    for (Place& p : places) {
      for (int a = 0; a < 3; ++a) p.voxel[a] >>= 1;
      p.key = cellKey(p.axis, p.voxel);
    }
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.key < b.key; });
    const auto same = [](const Place& a, const Place& b) { return a.key == b.key; };
    places.erase(std::unique(places.begin(), places.end(), same), places.end());
    std::vector<std::uint64_t> keys;
    keys.reserve(places.size());
    for (const Place& p : places) keys.push_back(p.key);
    level_.emplace_back(std::move(keys));
  }
}

bool CellTree::holds(std::size_t level, std::uint32_t axis, const glm::ivec3& low, const glm::ivec3& high) const {
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) {
        if (level_[level].contains(cellKey(axis, {x, y, z}))) return true;
      }
    }
  }
  return false;
}

bool CellTree::meets(std::uint32_t instance, const glm::vec3& normal, const glm::vec3& low,
                     const glm::vec3& high) const {
  if (level_.empty()) return true;
  // A little more for what rounding moves over a border.
  const glm::vec3 rounding = 1e-6f * (glm::abs(low) + glm::abs(high) + glm::abs(grid_.origin));
  const glm::ivec3 around(reach_);
  const glm::ivec3 first = grid_.voxelOf(low - rounding) - around, last = grid_.voxelOf(high + rounding) + around;
  // The level at which the box meets no more than two cells along each axis.
  std::size_t level = 0;
  const auto at = [&](const glm::ivec3& voxel) {
    const int shift = static_cast<int>(level) + 1;
    return glm::ivec3(voxel.x >> shift, voxel.y >> shift, voxel.z >> shift);
  };
  const auto wide = [&] {
    const glm::ivec3 extent = at(last) - at(first);
    return extent.x > 1 || extent.y > 1 || extent.z > 1;
  };
  while (level + 1 < level_.size() && wide()) ++level;
  return holds(level, CellGrid::facingOf(instance, normal) >> 1, at(first), at(last));
}

}  // namespace relume
