// SPDX-License-Identifier: MIT
// The visible centroid of a surfel: the middle of what it sees. Surfels side by side that see the same are lit alike; a
// wall between them, or a beam over one of them, moves their visible centroids apart. The metric of the clustering uses
// it (metric.h).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/surfels.h"

#include <glm/vec3.hpp>

#include <vector>

namespace relume {

// Where the light that a surfel sends goes to, on the mean: cosine-weighted mean of the nearest points in a few
// directions, at most kCentroidReach of the level's diagonal away. [m] [Size n_S] The directions are the same for all
// surfels: the noise of random ones would part neighbours. Same result at any thread count. Empty when cancelled.
inline constexpr float kCentroidReach = 0.25f;
std::vector<glm::vec3> visibleCentroids(const RayTracer& tracer, const Surfels& surfels, Context& context);

}  // namespace relume
