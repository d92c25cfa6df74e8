// SPDX-License-Identifier: MIT
// See footprint.h. A surfel's footprint is the surface that the surfel map gives to it. So the radiance that rays find,
// averaged over a surface, is the surface's own average: power is kept, whatever the shapes of the footprints.
#include "bake/surfels/footprint.h"

#include "bake/base/parallel.h"

#include <glm/common.hpp>

#include <cmath>

namespace relume {
namespace {

constexpr std::size_t kChunk = 16384;

struct Values {
  glm::vec3 albedo{0.0f}, emission{0.0f};
};

Values valuesAt(const Scene& scene, const SurfaceSample& sample, float width) {
  Values values;
  const float footprint = width / std::sqrt(sample.density);
  values.albedo = glm::clamp(albedoAt(scene, sample.point, footprint), 0.0f, 1.0f);
  if (sample.emitter != kReflector) values.emission = glm::max(emissionAt(scene, sample.point, footprint), 0.0f);
  return values;
}

}  // namespace

Footprints integrateFootprints(const Scene& scene, const SurfelMap& map, std::span<const SurfaceSample> surfels,
                               std::span<const SurfaceSample> samples, float sampleWidth, Context& context) {
  // Look up the materials in parallel, then add in the order of the samples.
  std::vector<Values> values(samples.size());
  std::vector<std::uint32_t> surfel(samples.size());
  parallelChunks(context, "", samples.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      values[i] = valuesAt(scene, samples[i], sampleWidth);
      surfel[i] = map.at(samples[i].side, samples[i].point.barycentric);
    }
  });
  std::vector<Values> sums(surfels.size());
  std::vector<std::uint32_t> count(surfels.size(), 0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (surfel[i] == kNone) continue;
    sums[surfel[i]].albedo += values[i].albedo;
    sums[surfel[i]].emission += values[i].emission;
    ++count[surfel[i]];
  }

  Footprints footprints;
  footprints.albedo.resize(surfels.size());
  footprints.emission.resize(surfels.size());
  for (std::size_t s = 0; s < surfels.size(); ++s) {
    const Values mean = count[s] > 0 ? sums[s] : valuesAt(scene, surfels[s], sampleWidth);
    const float scale = 1.0f / static_cast<float>(std::max(count[s], 1u));
    footprints.albedo[s] = glm::min(scale * mean.albedo, 1.0f);
    footprints.emission[s] = scale * mean.emission;
  }
  return footprints;
}

}  // namespace relume
