// SPDX-License-Identifier: MIT
// Cells: the texels of patches before anyone knows which of them gets a cache of its own (PIC 4.4). Texel centres lie
// on the triangles themselves.
//
// Deviation: texel centres span a patch from border to border, so that bilinear reads inside it touch its own texels
// only, and light is interpolated, not held constant, up to its edges. A patch narrower than a texel has one texel
// across, and all its corners read the middle of it. Every texel of a patch's rectangle is filled in the end: what no
// cache covers is dilated from its neighbours.
#pragma once

#include "bake/caches/charts/patches.h"

#include <cstdint>
#include <vector>

namespace relume {

struct Cell {
  std::uint32_t patch = 0;
  std::uint32_t x = 0, y = 0;    // texel of the patch
  float area = 0.0f;             // [m²] of seen surface that the texel stands for; 0 = nothing there
  std::uint32_t firstPoint = 0;  // places for its cache, best first: points[firstPoint] ..
  std::uint32_t pointCount = 0;  // .. + pointCount - 1
};

struct CellSet {
  float texelSize = 0.0f;                // [m] at density 1
  std::vector<glm::uvec2> resolution;    // [Size patches] texels of each patch
  std::vector<Cell> cells;               // of all patches in order, those with surface only
  std::vector<std::uint32_t> firstCell;  // [Size patches + 1]
  std::vector<ChartPoint> points;
};

// Texels of a patch along u and v.
glm::uvec2 resolutionOf(const Scene& scene, const PatchSet& set, const Patch& patch, float texelSize);

// Lay texels of the given size over all patches.
CellSet layCells(const Scene& scene, const PlaySpace& playSpace, const PatchSet& set, float texelSize,
                 Context& context);

// Texel coordinates (centres at integers) within a patch of a point in chart uv.
glm::vec2 texelOf(const glm::vec2& uv, const glm::vec2& chartSize, const glm::uvec2& resolution);

}  // namespace relume
