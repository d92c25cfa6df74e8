// SPDX-License-Identifier: MIT
// Moves the light-map coordinates of corners by a fraction of a texel, so that a corner reads light from where it is.
#pragma once

#include "bake/caches/lightmap/patch_texels.h"
#include "bake/caches/lightmap/share_caches.h"

#include <span>

namespace relume {

// The atlas, and the filled rectangle of a patch in it.
struct SnapTexels {
  glm::uvec2 atlas{0};                   // [texel] its size
  std::span<const std::uint32_t> cache;  // [Size width * height of the atlas]
  glm::uvec2 origin{0}, size{1};         // [texel] of the rectangle
};

// Move the texel coordinates (centres at integers) of a chart's corners, three per triangle in the order of the chart.
// They stay within [low, high] of the atlas. Equal corners move alike.
void snapCorners(const Scene& scene, const Patch& patch, const Chart& chart, const SharedCaches& shared,
                 float texelSize, const SnapTexels& texels, const glm::vec2& low, const glm::vec2& high,
                 std::span<glm::vec2> corner);

}  // namespace relume
