// SPDX-License-Identifier: MIT
// See seen_surface.h.
#include "bake/rays/seen_surface.h"

#include "bake/scene/surface_normals.h"

namespace relume {

SeenSurface seenAt(const Scene& scene, const Ray& ray, const Hit& hit) {
  const SurfaceNormals normals = normalsAt(scene, hit.point());
  SeenSurface seen{hit.point(), ray.origin + hit.distance * ray.direction, normals.shading, normals.geometric,
                   hit.back};
  if (hit.back) {
    seen.normal = -seen.normal;
    seen.geometricNormal = -seen.geometricNormal;
  }
  return seen;
}

}  // namespace relume
