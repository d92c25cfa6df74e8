// SPDX-License-Identifier: MIT
// Albedo and emission of surfels, integrated over the part of the surfaces that each stands for.
#pragma once

#include "bake/surfels/surface_sampler.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/context.h"

#include <span>
#include <vector>

namespace relume {

struct Footprints {
  std::vector<glm::vec3> albedo;    // [0..1] [Size n_S]
  std::vector<glm::vec3> emission;  // [W/m²/sr] [Size n_S]
};

// Means over the samples that the map assigns to each surfel; the surfel's own point where it gets none. Samples stand
// for equal areas (at density 1); sampleWidth [m] is the width of that area and selects the textures' mip level.
Footprints integrateFootprints(const Scene& scene, const SurfelMap& map, std::span<const SurfaceSample> surfels,
                               std::span<const SurfaceSample> samples, float sampleWidth, Context& context);

}  // namespace relume
