// SPDX-License-Identifier: MIT
// Lays texels over patches, before caches are chosen for them (PIC 4.4).
//
// Deviation: texel centres span a patch from border to border. So bilinear reads within a patch touch its own texels
// only, and light is interpolated up to the edges instead of being constant there. A patch narrower than a texel has
// one texel across, in whose middle all its corners read. In the end every texel of a patch's rectangle is filled:
// those without a cache are dilated from their neighbours.
#pragma once

#include "bake/caches/charts/patches.h"

#include <cstdint>
#include <vector>

namespace relume {

struct PatchTexel {
  std::uint32_t patch = 0;
  std::uint32_t x = 0, y = 0;    // texel of the patch
  float area = 0.0f;             // [m²] of seen surface that the texel stands for; 0 = nothing there
  std::uint32_t firstPoint = 0;  // spots for its cache, best first: points[firstPoint] ..
  std::uint32_t pointCount = 0;  // .. points[firstPoint + pointCount - 1]
};

struct PatchTexels {
  float texelSize = 0.0f;                 // [m] at density 1
  std::vector<glm::uvec2> resolution;     // [Size patches] texels of each patch
  std::vector<PatchTexel> texels;         // of all patches in order, those with surface only
  std::vector<std::uint32_t> firstTexel;  // [Size patches + 1]
  std::vector<ChartPoint> points;
};

// Texels of a patch along u and v.
glm::uvec2 resolutionOf(const Scene& scene, const PatchSet& set, const Patch& patch, float texelSize);

// Lay texels of the given size over all patches.
PatchTexels layTexels(const Scene& scene, const PlaySpace& playSpace, const PatchSet& set, float texelSize,
                      Context& context);

// Texel coordinates within a patch (centres at integers) of a point of its chart.
glm::vec2 texelOf(const glm::vec2& uv, const glm::vec2& chartSize, const glm::uvec2& resolution);

}  // namespace relume
