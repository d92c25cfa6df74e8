// SPDX-License-Identifier: MIT
// Where the triangles' corners read the light map, while a bake is made. Levels of many instances have most coordinates
// many times over, for a small chart is one texel: they are kept once, and written out when the bake is handed over.
#pragma once

#include "bake/surfels/block_palette.h"
#include "relume/caches.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Of the corners of one side of a triangle: packUnorm16x2 or kGridLit each.
using TriangleCorners = std::array<std::uint32_t, 3>;
inline constexpr TriangleCorners kNoCorners{kGridLit, kGridLit, kGridLit};

// By Lightmap::parts, triangle after triangle. back: empty where none is on the light map.
struct MapCorners {
  // So few of the last values are searched that levels without instances do not pay for it.
  using Side = BlockPalette<TriangleCorners, 16>;
  Side front, back;
};

// Lightmap::cornerUv or backCornerUv, of which `side` gives up its memory.
inline Array<std::uint32_t> unpackCorners(MapCorners::Side side) {
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * side.size());
  for (std::size_t t = 0; t < side.size(); ++t) {
    const TriangleCorners& uv = side[t];
    corners.insert(corners.end(), uv.begin(), uv.end());
  }
  return corners;
}
inline MapCorners::Side packCorners(std::span<const std::uint32_t> corners) {
  std::vector<TriangleCorners> some;
  MapCorners::Side side;
  for (std::size_t first = 0; first < corners.size(); first += 3 * some.size()) {
    some.resize(std::min<std::size_t>((corners.size() - first) / 3, std::size_t{1} << 16));
    if (some.empty()) break;
    for (std::size_t i = 0; i < some.size(); ++i)
      some[i] = {corners[first + 3 * i], corners[first + 3 * i + 1], corners[first + 3 * i + 2]};
    side.append(some);
  }
  side.shrinkToFit();
  return side;
}

}  // namespace relume
