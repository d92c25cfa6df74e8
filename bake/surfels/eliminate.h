// SPDX-License-Identifier: MIT
// Weighted sample elimination: a blue-noise subset of candidates, in progressive order.
#pragma once

#include "bake/surfels/surface_sampler.h"
#include "relume/bake/context.h"
#include "relume/result.h"

#include <span>
#include <vector>

namespace relume {

// Choose `count` of the candidates, well spread, each region getting its share of them. Returns their indices in an
// order of which any prefix is well spread. spacing [m]: of the densest packing of `count` discs on the candidates'
// area (at density 1). [count <= candidates] failed: cancelled.
Result<std::vector<std::uint32_t>> eliminateSamples(std::span<const SurfaceSample> candidates, std::uint32_t count,
                                                    float spacing, Context& context);

}  // namespace relume
