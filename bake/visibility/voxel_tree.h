// SPDX-License-Identifier: MIT
// Answers whether a box of space is free of voxels. Searching a large triangle for the voxels it touches then costs as
// much as there are voxels, however large the triangle is.
#pragma once

#include "bake/visibility/seen_voxels.h"

#include <glm/vec3.hpp>

#include <span>
#include <utility>
#include <vector>

namespace relume {

// Level k holds, of cubes 2^(k+1) times as wide as the grid's, those that have a voxel in them, told apart by the axis
// of its facing. Immutable, thread-safe.
class VoxelTree {
 public:
  VoxelTree() = default;
  // reach [cubes]: a box also counts as met when a voxel is no farther from it than this.
  VoxelTree(const VoxelGrid& grid, std::span<const VoxelHits> voxels, int reach);
  // One that was made before, of the same grid and without a reach.
  VoxelTree(const VoxelGrid& grid, std::vector<VoxelIndex> levels) : grid_(grid), level_(std::move(levels)) {}
  std::span<const VoxelIndex> levels() const { return level_; }

  bool empty() const { return level_.empty(); }
  // Whether a box [m] may hold a voxel of that instance whose side looks along `normal` or against it. May say yes
  // where none is, never no where one is. True for a tree without levels. The points that the box stands for may lie
  // `rounding` [m] outside of it; without one, as far as those of pointOf().
  bool meets(std::uint32_t instance, const glm::vec3& normal, const glm::vec3& low, const glm::vec3& high) const;
  bool meets(std::uint32_t instance, const glm::vec3& normal, const glm::vec3& low, const glm::vec3& high,
             const glm::vec3& rounding) const;

 private:
  bool holds(std::size_t level, std::uint32_t axis, const glm::ivec3& low, const glm::ivec3& high) const;

  VoxelGrid grid_;
  int reach_ = 0;
  std::vector<VoxelIndex> level_;  // keys of the occupied cubes
};

}  // namespace relume
