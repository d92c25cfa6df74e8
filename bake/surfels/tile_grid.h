// SPDX-License-Identifier: MIT
// The tiles of one side in the map from hits to surfels: how many there are, and where their middles lie.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstdint>

namespace relume {

inline constexpr float kTileSpacings = 0.5f;                     // wanted width of a tile
inline constexpr float kUnseenTileSpacings = 2.0f;               // the same, on sides that the play space does not see
inline constexpr std::uint32_t kMaxTilesAlong = (1u << 14) - 1;  // an edge: SurfelMap::Side

struct TileGrid {
  std::uint32_t corner = 0;             // where both edges start
  std::uint32_t columns = 1, rows = 1;  // along the edges from there
  bool nested = false;                  // so little of the side is seen that tiles of one size would be too coarse

  std::uint32_t tileCount() const { return columns * rows; }
  // Whether any of a tile lies within the triangle.
  bool isWithin(std::uint32_t column, std::uint32_t row) const {
    return std::uint64_t{column} * rows + std::uint64_t{row} * columns <= tileCount();
  }
  // Barycentric coordinates of the point for which a tile's surfel is looked for.
  glm::vec2 middleOf(std::uint32_t column, std::uint32_t row) const;
};

// Lay tiles about `size` [m] wide over a triangle, from the corner that needs the fewest. They are coarser where the
// areas do not justify so many.
TileGrid tileGridOf(const std::array<glm::vec3, 3>& corner, double size, double seenArea);

// The tile along an edge in which a coordinate lies. [0..1, or a rounding beyond]
inline std::uint32_t tileAlong(float x, std::uint32_t tiles) {
  return std::min(static_cast<std::uint32_t>(std::max(x * static_cast<float>(tiles), 0.0f)), tiles - 1);
}

// Barycentric coordinates as those of the grid that starts at a corner, weights of the two corners after it; and back.
inline glm::vec2 toTileGrid(const glm::vec2& b, std::uint32_t corner) {
  const float first = 1.0f - b.x - b.y;
  return corner == 0 ? b : (corner == 1 ? glm::vec2(b.y, first) : glm::vec2(first, b.x));
}
inline glm::vec2 fromTileGrid(const glm::vec2& g, std::uint32_t corner) {
  const float first = 1.0f - g.x - g.y;
  return corner == 0 ? g : (corner == 1 ? glm::vec2(first, g.x) : glm::vec2(g.y, first));
}

}  // namespace relume
