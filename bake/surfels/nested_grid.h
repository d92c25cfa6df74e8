// SPDX-License-Identifier: MIT
// Grids within grids over a large side of which little is seen: as fine as the surfels need where something is seen,
// and nothing elsewhere.
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
  // width [m]: of the finest cells; margin [m]: how far around what is seen cells are so fine.
  NestedGrid(const PlaySpace& playSpace, std::uint32_t side, const std::array<glm::vec3, 3>& corner, float width,
             float margin);

  // A finest cell, and the barycentric coordinates of its middle.
  struct Leaf {
    std::uint32_t cell;
    glm::vec2 middle;
  };
  std::span<const Leaf> leaves() const { return leaf_; }
  void set(std::uint32_t cell, std::uint32_t surfel) { cell_[cell] = surfel; }

  // Hand the cells over to a map, behind those it has.
  void append(SurfelMap& map, SurfelMap::Side& side) const;

 private:
  bool wanted(const glm::dvec2& at, double width) const;
  void divide(std::uint32_t cell, const glm::dvec2& at, double width, int depth);

  const PlaySpace& playSpace_;
  const std::uint32_t side_;
  const std::array<glm::vec3, 3> corner_;
  const float margin_;                // [m]
  const bool isNeedle_;               // surface_parts.h
  std::uint32_t root_ = 1;            // cells along an edge of the outermost grid
  std::vector<std::uint32_t> cell_;   // surfel, kNone, or the first cell of a finer grid
  std::vector<std::uint32_t> inner_;  // the cells that hold a finer grid
  std::vector<Leaf> leaf_;
};

}  // namespace relume
