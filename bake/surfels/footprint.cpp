// SPDX-License-Identifier: MIT
// See footprint.h. A surfel's footprint is the surface that the surfel map gives to it. So the radiance that rays find,
// averaged over a surface, is the surface's own average: power is kept, whatever the shapes of the footprints.
#include "bake/surfels/footprint.h"

#include "bake/base/parallel.h"
#include "bake/surfels/by_surfel.h"

#include <glm/common.hpp>

#include <cmath>
#include <memory>

namespace relume {
namespace {

constexpr std::size_t kChunk = 16384;

struct Values {
  glm::vec3 albedo, emission;
};

Values valuesAt(const Scene& scene, const SurfaceSample& sample, float width) {
  Values values{glm::vec3(0.0f), glm::vec3(0.0f)};
  const float footprint = width / std::sqrt(sample.density);
  values.albedo = glm::clamp(albedoAt(scene, sample.point, footprint), 0.0f, 1.0f);
  if (sample.emitter != kReflector) values.emission = glm::max(emissionAt(scene, sample.point, footprint), 0.0f);
  return values;
}

}  // namespace

Footprints integrateFootprints(const Scene& scene, const SurfelMap& map, std::span<const SurfaceSample> surfels,
                               std::span<const SurfaceSample> samples, float sampleWidth, Context& context) {
  // Look up the materials in parallel, then add in the order of the samples.
  const auto values = std::make_unique_for_overwrite<Values[]>(samples.size());
  std::vector<std::uint32_t> surfel(samples.size(), kNone);
  parallelChunks(context, "", samples.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      values[i] = valuesAt(scene, samples[i], sampleWidth);
      surfel[i] = map.at(samples[i].side, samples[i].point.barycentric);
    }
  });
  Footprints footprints;
  footprints.albedo.assign(surfels.size(), glm::vec3(0.0f));
  footprints.emission.assign(surfels.size(), glm::vec3(0.0f));
  if (context.cancelled()) return footprints;
  std::vector<std::uint32_t> count(surfels.size(), 0);
  forEachSurfelRange(context, surfels.size(), [&](std::size_t first, std::size_t last) {
    forEachSampleOf(surfel, first, last, [&](std::size_t i) {
      footprints.albedo[surfel[i]] += values[i].albedo;
      footprints.emission[surfel[i]] += values[i].emission;
      ++count[surfel[i]];
    });
    for (std::size_t s = first; s < last; ++s) {
      const Values sum = count[s] > 0 ? Values{footprints.albedo[s], footprints.emission[s]}
                                      : valuesAt(scene, surfels[s], sampleWidth);
      const float scale = 1.0f / static_cast<float>(std::max(count[s], 1u));
      footprints.albedo[s] = glm::min(scale * sum.albedo, 1.0f);
      footprints.emission[s] = scale * sum.emission;
    }
  });
  return footprints;
}

}  // namespace relume
