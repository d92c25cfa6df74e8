// SPDX-License-Identifier: MIT
// See mirror_surface.h.
#include "bake/preview/mirror_surface.h"

#include "bake/base/parallel.h"
#include "relume/glossy.h"

#include <glm/geometric.hpp>

namespace relume {

MirrorSurface mirrorAt(const Scene& scene, const Ray& ray, const SeenSurface& seen) {
  MirrorSurface mirror;
  mirror.normal = (seen.back ? -1.0f : 1.0f) * mappedNormal(scene, seen.point);
  if (mirror.normal == glm::vec3(0.0f)) mirror.normal = seen.geometricNormal;
  const SurfaceGloss gloss = glossAt(scene, seen.point);
  const ReflectanceSplit split = splitReflectance(albedoAt(scene, seen.point), gloss.metalness, gloss.roughness,
                                                  -glm::dot(ray.direction, mirror.normal));
  mirror.diffuse = split.diffuse;
  mirror.specular = split.specular;
  mirror.axis = glm::reflect(ray.direction, mirror.normal);
  mirror.exponent = glossyExponent(gloss.roughness);
  return mirror;
}

std::vector<MirrorSurface> findMirrors(const RayTracer& drawn, const CameraRays& camera, Context& context) {
  const auto width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  std::vector<MirrorSurface> mirrors(width * height);
  parallelChunks(context, "", height, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * width; i < end * width; ++i) {
      Ray ray;
      camera.at(static_cast<float>(i % width) + 0.5f, static_cast<float>(i / width) + 0.5f, ray.origin, ray.direction);
      if (const Hit hit = drawn.trace(ray)) mirrors[i] = mirrorAt(drawn.scene(), ray, seenAt(drawn.scene(), ray, hit));
    }
  });
  return mirrors;
}

}  // namespace relume
