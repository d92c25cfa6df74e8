// SPDX-License-Identifier: MIT
// How well surfels are spread.
#pragma once

#include "bake/surfels/surface_sampler.h"
#include "relume/bake/context.h"

#include <span>

namespace relume {

struct Spacing {
  float min = 0.0f, mean = 0.0f;  // [m] distance to the nearest neighbour along the surface
  float cv = 0.0f;                // coefficient of variation: its standard deviation over its mean
};

// Over the surfels of density 1 that have a neighbour within two spacings. spacing [m]: of the densest packing.
Spacing measureSpacing(std::span<const SurfaceSample> surfels, float spacing, Context& context);

}  // namespace relume
