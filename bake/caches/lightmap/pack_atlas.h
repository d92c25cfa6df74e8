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
  std::uint32_t side = 0;             // [texel]
  std::vector<glm::uvec2> rectangle;  // [texel] origin of each rectangle
  std::vector<glm::uvec2> single;     // [texel] place of each single texel: runs along rows of what is left
  double used = 0.0;                  // share of all texels that rectangles without their gutter, and singles, take
};

// Pack on a square of `side` texels, or on the smallest that is found when side = 0 (a multiple of 8). Each rectangle
// keeps `gutter` texels free at its right and top. Nothing when it does not fit.
// context: nothing fits once it is cancelled; may be null.
std::optional<AtlasPlan> packAtlas(std::span<const glm::uvec2> sizes, std::uint32_t singles, std::uint32_t gutter,
                                   std::uint32_t side, const Context* context = nullptr);

// The largest light map this project writes. [texel]
inline constexpr std::uint32_t kMaxAtlasSide = 16384;

}  // namespace relume
