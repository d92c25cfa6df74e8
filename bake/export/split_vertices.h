// SPDX-License-Identifier: MIT
// Vertices where a chart ends: a vertex whose corners have different light-map coordinates becomes several.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Triangles of one primitive, and where each of their corners is on the light map. All [Size 3 * triangles].
struct ChartedCorners {
  std::vector<std::uint32_t> vertex;  // of the primitive
  std::vector<std::uint32_t> front;   // packUnorm16x2 or kGridLit
  std::vector<std::uint32_t> back;    // likewise, for the back side
  std::vector<std::uint8_t> unseen;   // [Size triangles] 1 = has no area: takes what its vertices have anyway
};

struct SplitVertices {
  std::vector<std::uint32_t> source;  // the primitive's vertex that each new one is a copy of
  std::vector<std::uint32_t> corner;  // [Size 3 * triangles] new vertex of each corner
  std::vector<std::uint32_t> front;   // [Size source] packUnorm16x2, or kGridLit where no corner is on the map
  std::vector<std::uint32_t> back;    // [Size source]
  std::uint32_t added = 0;            // copies beyond the first of their vertex
  bool kept = true;                   // source is 0, 1, 2 ..: the primitive's own vertices serve, in their order
};

// The primitive's vertices first, in their order (all of them, or with `compact` those that a triangle uses), then the
// copies in the order in which triangles ask for them: a vertex without copies keeps its number.
SplitVertices splitVertices(const ChartedCorners& corners, std::uint32_t vertexCount, bool compact);

}  // namespace relume
