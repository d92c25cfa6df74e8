// SPDX-License-Identifier: MIT
// See seen_surface.h.
#include "bake/rays/seen_surface.h"

namespace relume {

SeenSurface seenAt(const Scene& scene, const Ray& ray, const Hit& hit) {
  SeenSurface seen{hit.point(), ray.origin + hit.distance * ray.direction, shadingNormal(scene, hit.point()),
                   geometricNormal(scene, hit.point()), hit.back};
  if (hit.back) {
    seen.normal = -seen.normal;
    seen.geometricNormal = -seen.geometricNormal;
  }
  return seen;
}

}  // namespace relume
