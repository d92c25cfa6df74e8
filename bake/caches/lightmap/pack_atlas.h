// SPDX-License-Identifier: MIT
// Places rectangles and single texels on the light map, by stb_rect_pack.
#pragma once

#include "relume/bake/context.h"

#include <glm/vec2.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relume {

struct AtlasPlan {
  glm::uvec2 size{0};                 // [texel]
  std::vector<glm::uvec2> rectangle;  // [texel] origin of each rectangle
  std::vector<glm::uvec2> single;     // [texel] coordinates of each single texel; they fill rows of what is left
  double used = 0.0;                  // share of all texels in rectangles, without their gutters, and in single texels
};

// Pack into a square of `side` texels or, with side = 0, into the smallest square found whose side is a multiple of 8.
// Where a long rectangle makes that square more than half empty, its empty rows at the end are cut off. Each rectangle
// keeps `gutter` texels free at its right and its top. Nothing when it does not fit, or once `context` (may be null) is
// cancelled.
std::optional<AtlasPlan> packAtlas(std::span<const glm::uvec2> sizes, std::uint32_t singles, std::uint32_t gutter,
                                   std::uint32_t side, const Context* context = nullptr);

// The largest light map this project writes. [texel]
inline constexpr std::uint32_t kMaxAtlasSide = 16384;

}  // namespace relume
