// SPDX-License-Identifier: MIT
// Which caches a receiver reads, and how much of each: around a point of the light map, or of the grid.
#pragma once

#include "formats/caches.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
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

// The caches of a point of the map, texels without one left out. Empty without a map.
inline Stencil lightmapStencil(const Caches& caches, const glm::vec2& uv) {
  Stencil stencil;
  if (caches.lightmap.cache.empty()) return stencil;
  const TexelQuad quad = texelsAround(caches.lightmap, uv);
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint32_t cache = caches.lightmap.cache[quad.texel[k]];
    if (cache != kNoCache && quad.weight[k] > 0.0f) stencil.add(cache, quad.weight[k]);
  }
  return stencil;
}

// Their common normal: unit, or zero when they have none.
inline glm::vec3 stencilNormal(const Caches& caches, const Stencil& stencil) {
  glm::vec3 sum(0.0f);
  for (std::size_t k = 0; k < static_cast<std::size_t>(stencil.count); ++k) {
    sum += stencil.weight[k] * caches.normal[stencil.cache[k]];
  }
  const float length = glm::length(sum);
  return length > 0.0f ? sum / length : glm::vec3(0.0f);
}

// The points of the grid around a receiver with unit normal, trilinear times the wrap weight: a point behind the
// receiver's plane sees what the receiver does not. Points without a cache are left out; the position is clamped.
inline Stencil gridStencil(const CacheGrid& grid, const glm::vec3& positionWorld, const glm::vec3& normal) {
  Stencil stencil;
  if (grid.cache.empty()) return stencil;
  const glm::uvec3 r = grid.resolution;
  const glm::vec3 safeSpacing = glm::max(grid.spacing, glm::vec3(1e-20f));
  const glm::vec3 p = glm::min(glm::max(glm::vec3(0.0f), (positionWorld - grid.originWorld) / safeSpacing), glm::vec3(r - 1u));
  const glm::uvec3 base = glm::uvec3(p);
  const glm::vec3 f = p - glm::vec3(base);
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const glm::uvec3 offset(corner & 1u, (corner >> 1) & 1u, corner >> 2);
    const glm::uvec3 at = glm::min(base + offset, r - 1u);
    const glm::vec3 share = glm::mix(1.0f - f, f, glm::vec3(offset));
    const float w = share.x * share.y * share.z;
    const std::uint32_t cache = grid.cache[(std::size_t{at.z} * r.y + at.y) * r.x + at.x];
    if (cache == kNoCache || w <= 0.0f) continue;
    const glm::vec3 toward = grid.originWorld + glm::vec3(at) * grid.spacing - positionWorld;
    const float distance = glm::length(toward);
    const float cosine = distance > 0.0f ? glm::dot(toward, normal) / distance : 1.0f;
    const float wrap = std::max(0.05f, 0.5f + 0.5f * cosine);
    stencil.add(cache, w * wrap * wrap);
  }
  return stencil;
}

}  // namespace relume::cpu
