// SPDX-License-Identifier: MIT
// See relight_by_rays.h.
#include "tools/render/relight_by_rays.h"

#include "tools/render/context_threads.h"
#include "tools/render/ray_shadows.h"

#include <vector>

namespace relume {

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
