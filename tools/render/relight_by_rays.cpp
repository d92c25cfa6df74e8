// SPDX-License-Identifier: MIT
// See relight_by_rays.h.
#include "tools/render/relight_by_rays.h"

#include "bake/base/parallel.h"

#include <glm/geometric.hpp>

#include <vector>

namespace relume {
namespace {

// Share of a light that reaches a point: one shadow ray, started off the surface. None once the work is cancelled.
Visibility rayVisibility(const RayTracer& tracer, const std::vector<SceneLight>& lights, const Context& context) {
  return [&tracer, &lights, &context](std::uint32_t index, const glm::vec3& position, const glm::vec3& normal) {
    if (context.cancelled()) return 0.0f;
    const SceneLight& light = lights[index];
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

ParallelFor parallelFor(Context& context) {
  return [&context](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    parallelChunks(context, "", tasks, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(static_cast<std::uint32_t>(i));
    });
  };
}

}  // namespace

Result<Relit> relightByRays(const RayTracer& tracer, const RenderRequest& request, Context& context) {
  RelightOptions options;
  options.lumaBands = request.bands.luma;
  options.chromaBands = request.bands.chroma;
  options.glossy = request.exponent.has_value();
  options.parallelFor = parallelFor(context);
  return relightRequest(request, options, rayVisibility(tracer, request.lights, context), {});
}

}  // namespace relume
