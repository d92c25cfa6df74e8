// SPDX-License-Identifier: MIT
// Where the surfels of emitters lie on images that drive their materials (relume/emitters.h), and what the rest of the
// bake is to reckon with where such a material is dark.
#pragma once

#include "bake/surfels/surface_sampler.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/context.h"
#include "relume/emitters.h"

#include <span>
#include <vector>

namespace relume {

// Taps of all surfels that stand for sides which emit or whose material is marked. sampler: of the surfels; spacing
// [m]: of the densest packing of the surfels at density 1. Texture coordinates are those of the emissive texture, or
// TEXCOORD_0, repeated, where a material has none. Same result at any thread count.
Emitters findEmitterFootprints(const Scene& scene, const SurfelMap& map, std::span<const SurfaceSample> surfels,
                               const SurfaceSampler& sampler, float spacing, std::uint64_t seed, Context& context);

// Let the surfels of marked materials shine evenly, each material with as much light as the strongest of all and no
// brighter than the brightest, or with 1 W/m²/sr where nothing emits: none gets all rays that are aimed at emitters.
// returns what `emission` was before, or nothing where no material is marked. [Size n_S each]
std::vector<glm::vec3> shineMarked(const Scene& scene, std::span<const SurfaceSample> surfels,
                                   std::vector<glm::vec3>& emission);

}  // namespace relume
