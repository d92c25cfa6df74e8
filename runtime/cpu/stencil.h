// SPDX-License-Identifier: MIT
// Which caches a point of the light map reads, and how much of each.
#pragma once

#include "formats/caches.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>

namespace relume::cpu {

// The four texels around a point and its place between them. Texel centres are at (i + 0.5) / size; beyond the outer
// ones the map is constant.
struct TexelQuad {
  std::array<std::size_t, 4> texel;
  std::array<float, 4> weight;
};

// The map must not be empty. Any uv will do: NaN counts as 0.
inline TexelQuad texelsAround(const Lightmap& map, const glm::vec2& uv) {
  const glm::vec2 size(static_cast<float>(map.width), static_cast<float>(map.height));
  const glm::vec2 p = glm::min(glm::max(glm::vec2(0.0f), uv * size - 0.5f), size - 1.0f);
  const auto x0 = static_cast<std::uint32_t>(p.x), y0 = static_cast<std::uint32_t>(p.y);
  const std::uint32_t x1 = std::min(x0 + 1, map.width - 1), y1 = std::min(y0 + 1, map.height - 1);
  const glm::vec2 f(p.x - static_cast<float>(x0), p.y - static_cast<float>(y0));
  const std::size_t row0 = std::size_t{y0} * map.width, row1 = std::size_t{y1} * map.width;
  return {{row0 + x0, row0 + x1, row1 + x0, row1 + x1},
          {(1 - f.x) * (1 - f.y), f.x * (1 - f.y), (1 - f.x) * f.y, f.x * f.y}};
}

// Up to eight caches and their weights.
struct Stencil {
  std::array<std::uint32_t, 8> cache;
  std::array<float, 8> weight;
  int count = 0;

  void add(std::uint32_t c, float w) {
    cache[static_cast<std::size_t>(count)] = c;
    weight[static_cast<std::size_t>(count++)] = w;
  }
  float total() const {
    float sum = 0.0f;
    for (int k = 0; k < count; ++k) sum += weight[static_cast<std::size_t>(k)];
    return sum;
  }
};

// The caches of a point of the map, texels without one left out, and the sum of their weighted normals.
inline Stencil lightmapStencil(const Caches& caches, const glm::vec2& uv, glm::vec3& normalSum) {
  const TexelQuad quad = texelsAround(caches.lightmap, uv);
  Stencil stencil;
  normalSum = glm::vec3(0.0f);
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint32_t cache = caches.lightmap.cache[quad.texel[k]];
    if (cache == kNoCache || quad.weight[k] <= 0.0f) continue;
    stencil.add(cache, quad.weight[k]);
    normalSum += quad.weight[k] * caches.normal[cache];
  }
  return stencil;
}

}  // namespace relume::cpu
