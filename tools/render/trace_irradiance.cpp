// SPDX-License-Identifier: MIT
// See trace_irradiance.h.
#include "tools/render/trace_irradiance.h"

#include "bake/rays/ray_tracer.h"
#include "bake/reference/path_tracer.h"

namespace relume {

Result<std::vector<glm::vec3>> traceIrradiance(const Scene& scene, const Camera& camera,
                                               std::span<const SceneLight> lights, const TraceOptions& options,
                                               Context& context) {
  const auto fixed = RayTracer::create(scene, "", context);
  if (!fixed) return fixed.error();
  const auto drawn = RayTracer::create(scene, "", context, RayStructure::thorough, RayGeometry::drawn);
  if (!drawn) return drawn.error();
  ReferenceOptions reference;
  reference.width = options.width;
  reference.height = options.height;
  reference.samplesPerPixel = options.samplesPerPixel;
  reference.maxBounces = options.maxBounces;
  reference.emissive = true;
  reference.sky = options.sky;
  auto image = renderReference(*fixed, camera, lights, reference, context, &*drawn);
  if (!image) return image.error();
  std::vector<glm::vec3> sum = std::move(image->direct);
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += image->indirect[i];
  return sum;
}

}  // namespace relume
