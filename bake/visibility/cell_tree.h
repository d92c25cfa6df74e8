// SPDX-License-Identifier: MIT
// Tells where no cell is, box by box: what is to be found in a large triangle is found in the few boxes that hold any,
// whatever the size of the triangle.
#pragma once

#include "bake/visibility/seen_cells.h"

#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace relume {

// Level k has the cells of a grid 2^k times as coarse that hold a cell. Immutable, thread-safe.
class CellTree {
 public:
  CellTree() = default;
  // reach: boxes count as met where a cell is so many voxels away.
  CellTree(const CellGrid& grid, std::span<const CellHits> cells, int reach);

  bool empty() const { return level_.empty(); }
  // Whether one of the cells of that instance that look that way, or the opposite one, may be in a box [m]; never says
  // no where one is. True for a tree without levels.
  bool meets(std::uint32_t instance, const glm::vec3& normal, const glm::vec3& low, const glm::vec3& high) const;

 private:
  bool holds(std::size_t level, std::uint32_t axis, const glm::ivec3& low, const glm::ivec3& high) const;

  CellGrid grid_;
  int reach_ = 0;
  std::vector<CellIndex> level_;  // [0] is one of two voxels' width
};

}  // namespace relume
