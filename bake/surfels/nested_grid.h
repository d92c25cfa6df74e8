// SPDX-License-Identifier: MIT
// The tiles of a large side of which little is seen: grids within grids, as fine as the surfels need where something is
// seen, and coarse elsewhere.
#pragma once

#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class NestedGrid {
 public:
  // width [m]: of the finest tiles. margin [m]: tiles are as fine up to this far around what is seen.
  NestedGrid(const PlaySpace& playSpace, std::uint32_t side, const std::array<glm::vec3, 3>& corner, float width,
             float margin);

  // One of the finest tiles, and the barycentric coordinates of its middle.
  struct Leaf {
    std::uint32_t tile;
    glm::vec2 middle;
  };
  std::span<const Leaf> leaves() const { return leaf_; }
  void set(std::uint32_t tile, std::uint32_t surfel) { tile_[tile] = surfel; }

  // Append the tiles to a map's, as those of `side`.
  void append(SurfelMap& map, SurfelMap::Side& side) const;

 private:
  bool wanted(const glm::dvec2& at, double width) const;
  void divide(std::uint32_t tile, const glm::dvec2& at, double width, int depth);

  const PlaySpace& playSpace_;
  const std::uint32_t side_;
  const std::array<glm::vec3, 3> corner_;
  const float margin_;                // [m]
  const bool isNeedle_;               // surface_parts.h
  std::uint32_t root_ = 1;            // tiles along an edge of the outermost grid
  std::vector<std::uint32_t> tile_;   // surfel, kNone, or index of the first tile of a finer grid
  std::vector<std::uint32_t> inner_;  // the tiles that hold a finer grid
  std::vector<Leaf> leaf_;
};

}  // namespace relume
