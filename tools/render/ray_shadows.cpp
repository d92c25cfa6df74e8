// SPDX-License-Identifier: MIT
// See ray_shadows.h.
#include "tools/render/ray_shadows.h"

#include <glm/geometric.hpp>

namespace relume {

Visibility rayVisibility(const RayTracer& tracer, std::span<const Light> lights, const Context& context) {
  return [&tracer, lights, &context](std::uint32_t index, const glm::vec3& position, const glm::vec3& normal) {
    if (context.cancelled()) return 0.0f;
    const Light& light = lights[index];
    const float epsilon = tracer.epsilonAt(position);
    Ray ray;
    ray.origin = position + normal * epsilon;
    if (light.kind == LightKind::directional) {
      ray.direction = -light.direction;
    } else {
      const glm::vec3 toLight = light.positionWorld - ray.origin;
      const float distance = glm::length(toLight);
      if (!(distance > 0.0f)) return 1.0f;
      ray.direction = toLight / distance;
      ray.tMax = distance;
    }
    return tracer.occluded(ray) ? 0.0f : 1.0f;
  };
}

Result<RayShadows> RayShadows::create(const Scene& scene) {
  auto context = std::make_unique<Context>();
  auto tracer = RayTracer::create(scene, "", *context, RayStructure::thorough, RayGeometry::drawn);
  if (!tracer) return tracer.error();
  return RayShadows(std::make_unique<RayTracer>(std::move(*tracer)), std::move(context));
}

}  // namespace relume
