// SPDX-License-Identifier: MIT
// See seen_surface.h.
#include "tools/render/seen_surface.h"

#include "formats/pack.h"

#include <glm/geometric.hpp>

namespace relume {

std::optional<glm::vec2> lightmapPoint(const Scene& scene, const Bake& bake, const SeenSurface& seen) {
  const Lightmap& map = bake.caches.lightmap;
  const Instance& instance = scene.instances[seen.point.instance];
  if (!instance.charted() || seen.point.instance >= map.parts.size()) return std::nullopt;
  const LightmapPart& part = map.parts[seen.point.instance];
  const Array<std::uint32_t>& corners = seen.back ? map.backCornerUv : map.cornerUv;
  const std::uint64_t corner = part.firstCorner + 3ull * seen.point.triangle;
  if (seen.point.triangle >= part.triangleCount || corner + 2 >= corners.size() || corners[corner] == kGridLit)
    return std::nullopt;
  // The light map has corners in glTF order; a mirrored instance's points count them the other way round.
  const bool mirrored = instance.flipped;
  const glm::vec2 a = unpackUnorm16x2(corners[corner]), b = unpackUnorm16x2(corners[corner + (mirrored ? 2 : 1)]),
                  c = unpackUnorm16x2(corners[corner + (mirrored ? 1 : 2)]);
  return a + (b - a) * seen.point.barycentric.x + (c - a) * seen.point.barycentric.y;
}

glm::vec3 linkIrradiance(const Scene& scene, const Bake& bake, const Relighter& relighter, const SeenSurface& seen,
                         GridLookup lookup) {
  if (const std::optional<glm::vec2> uv = lightmapPoint(scene, bake, seen))
    return relighter.irradianceOnLightmap(*uv, seen.normal, seen.geometricNormal);
  return relighter.irradianceInGrid(seen.positionWorld, seen.normal, lookup);
}

glm::vec3 linkGlossy(const Scene& scene, const Bake& bake, const Relighter& relighter, const SeenSurface& seen,
                     const Ray& ray, float exponent) {
  const glm::vec3 reflected = glm::reflect(ray.direction, seen.normal);
  if (const std::optional<glm::vec2> uv = lightmapPoint(scene, bake, seen))
    return relighter.glossyOnLightmap(*uv, reflected, exponent);
  return relighter.glossyInGrid(seen.positionWorld, seen.normal, reflected, exponent);
}

}  // namespace relume
