// SPDX-License-Identifier: MIT
// Irradiance of a relit bake where a ray hits its level.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "formats/pack.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"

#include <glm/vec3.hpp>

#include <cstdint>

namespace relume::test {

// [W/m²] position: of the hit; normal: the receiver's; plane: of the triangle.
inline glm::vec3 readAtHit(const Bake& bake, const Relighter& relighter, const Hit& hit, const glm::vec3& position,
                           const glm::vec3& normal, const glm::vec3& plane) {
  const Lightmap& map = bake.caches.lightmap;
  const std::uint64_t corner = map.parts[hit.instance].firstCorner + 3ull * hit.triangle;
  if (map.cornerUv[corner] == kGridLit) return relighter.irradianceInGrid(position, normal);
  const glm::vec2 a = unpackUnorm16x2(map.cornerUv[corner]), b = unpackUnorm16x2(map.cornerUv[corner + 1]),
                  c = unpackUnorm16x2(map.cornerUv[corner + 2]);
  return relighter.irradianceOnLightmap(a + (b - a) * hit.barycentric.x + (c - a) * hit.barycentric.y, normal, plane);
}

}  // namespace relume::test
