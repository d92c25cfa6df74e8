// SPDX-License-Identifier: MIT
// See relight_by_rays.h.
#include "tools/render/relight_by_rays.h"

#include "bake/base/parallel.h"
#include "tools/render/ray_shadows.h"

#include <vector>

namespace relume {

ParallelFor contextParallelFor(Context& context) {
  return [&context](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    parallelChunks(context, "", tasks, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(static_cast<std::uint32_t>(i));
    });
  };
}

Result<Relit> relightByRays(const RayTracer& tracer, const RenderRequest& request, Context& context) {
  RelightOptions options;
  options.lumaBands = request.bands.luma;
  options.chromaBands = request.bands.chroma;
  options.glossy = request.drawsGlossy();
  options.gridTexture = request.gridLookup != GridLookup::stencil;
  options.parallelFor = contextParallelFor(context);
  const std::vector<Light> lights = toRuntimeLights(request.lights);
  return relightRequest(request, options, rayVisibility(tracer, lights, context), {});
}

}  // namespace relume
