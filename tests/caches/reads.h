// SPDX-License-Identifier: MIT
// Reads a light map at points of the scene as a game does: bilinear, texel centres at (i + 0.5) / size.
#pragma once

#include "bake/caches/caches.h"
#include "formats/pack.h"

#include <glm/common.hpp>

#include <cstdint>

namespace relume::test {

struct Read {
  bool gridLit = true;
  float unfilled = 0.0f;             // weight that fell on texels without a cache
  glm::vec3 position{0.0f};          // [m] interpolated from the caches
  glm::vec3 normal{0.0f};            // likewise, not unit
  std::uint32_t nearest = kNoCache;  // the cache of largest weight
};

// visit(cache, weight) of the four texels around a point of the map, kNoCache where one has none.
template <class Visit>
void forEachRead(const Lightmap& map, const glm::vec2& uv, const Visit& visit) {
  const glm::vec2 size(static_cast<float>(map.width), static_cast<float>(map.height));
  const glm::vec2 p = glm::clamp(uv * size - 0.5f, glm::vec2(0.0f), size - 1.0f);
  const glm::uvec2 base(p);
  const glm::vec2 f = p - glm::vec2(base);
  for (std::uint32_t k = 0; k < 4; ++k) {
    const float w = (k & 1 ? f.x : 1.0f - f.x) * (k & 2 ? f.y : 1.0f - f.y);
    if (!(w > 0.0f)) continue;
    const std::uint32_t x = std::min(base.x + (k & 1), map.width - 1), y = std::min(base.y + (k >> 1), map.height - 1);
    visit(map.cache[std::size_t{y} * map.width + x], w);
  }
}

// What a point of a side reads. barycentric weighs corners 1 and 2 in glTF order.
inline Read readLightmap(const Caches& caches, std::uint32_t instance, std::uint32_t triangle,
                         const glm::vec2& barycentric, bool back) {
  const Lightmap& map = caches.lightmap;
  Read read;
  const std::span<const std::uint32_t> corners = back ? map.backCornerUv : map.cornerUv;
  if (corners.empty()) return read;
  const std::uint64_t first = map.parts[instance].firstCorner + 3ull * triangle;
  if (corners[first] == kGridLit || corners[first + 1] == kGridLit || corners[first + 2] == kGridLit) return read;
  read.gridLit = false;
  const glm::vec2 uv = (1.0f - barycentric.x - barycentric.y) * unpackUnorm16x2(corners[first]) +
                       barycentric.x * unpackUnorm16x2(corners[first + 1]) +
                       barycentric.y * unpackUnorm16x2(corners[first + 2]);
  float largest = 0.0f;
  forEachRead(map, uv, [&](std::uint32_t cache, float w) {
    if (cache == kNoCache) {
      read.unfilled += w;
      return;
    }
    read.position += w * caches.positionWorld[cache];
    read.normal += w * caches.normal[cache];
    if (w > largest) {
      largest = w;
      read.nearest = cache;
    }
  });
  return read;
}

}  // namespace relume::test
