// SPDX-License-Identifier: MIT
// See voxel_tree.h.
#include "bake/visibility/voxel_tree.h"

#include <glm/common.hpp>

#include <algorithm>
#include <utility>

namespace relume {
namespace {

constexpr int kMaxLevels = 30;  // cubes are numbered within ±1e9

// A cube of some level with a voxel in it.
struct Coarse {
  std::uint64_t key;
  glm::ivec3 cube;
  std::uint32_t axis;  // of the facing, with the instance but without the sign
};

}  // namespace

VoxelTree::VoxelTree(const VoxelGrid& grid, std::span<const VoxelHits> voxels, int reach) : grid_(grid), reach_(reach) {
  std::vector<Coarse> coarse;
  coarse.reserve(voxels.size());
  for (const VoxelHits& c : voxels) coarse.push_back({c.key, c.cube, c.facing >> 1});
  for (int level = 0; level < kMaxLevels; ++level) {
    for (Coarse& p : coarse) {
      for (int a = 0; a < 3; ++a) p.cube[a] >>= 1;
      p.key = voxelKey(p.axis, p.cube);
    }
    std::sort(coarse.begin(), coarse.end(), [](const Coarse& a, const Coarse& b) { return a.key < b.key; });
    const auto same = [](const Coarse& a, const Coarse& b) { return a.key == b.key; };
    coarse.erase(std::unique(coarse.begin(), coarse.end(), same), coarse.end());
    std::vector<std::uint64_t> keys;
    keys.reserve(coarse.size());
    for (const Coarse& p : coarse) keys.push_back(p.key);
    level_.emplace_back(std::move(keys));
  }
}

bool VoxelTree::holds(std::size_t level, std::uint32_t axis, const glm::ivec3& low, const glm::ivec3& high) const {
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) {
        if (level_[level].contains(voxelKey(axis, {x, y, z}))) return true;
      }
    }
  }
  return false;
}

bool VoxelTree::meets(std::uint32_t instance, const glm::vec3& normal, const glm::vec3& low,
                      const glm::vec3& high) const {
  return meets(instance, normal, low, high, 1e-6f * (glm::abs(low) + glm::abs(high) + glm::abs(grid_.origin)));
}

bool VoxelTree::meets(std::uint32_t instance, const glm::vec3& normal, const glm::vec3& low, const glm::vec3& high,
                      const glm::vec3& rounding) const {
  if (level_.empty()) return true;
  const glm::ivec3 around(reach_);
  const glm::ivec3 first = grid_.cubeOf(low - rounding) - around, last = grid_.cubeOf(high + rounding) + around;
  // Go up to the level at which the box meets at most two cubes along each axis.
  std::size_t level = 0;
  const auto at = [&](const glm::ivec3& cube) {
    const int shift = static_cast<int>(level) + 1;
    return glm::ivec3(cube.x >> shift, cube.y >> shift, cube.z >> shift);
  };
  const auto wide = [&] {
    const glm::ivec3 extent = at(last) - at(first);
    return extent.x > 1 || extent.y > 1 || extent.z > 1;
  };
  while (level + 1 < level_.size() && wide()) ++level;
  return holds(level, VoxelGrid::facingOf(instance, normal) >> 1, at(first), at(last));
}

}  // namespace relume
