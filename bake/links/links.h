// SPDX-License-Identifier: MIT
// Traces how much light each node sends to each cache (PIC 3.1, 4.5, 4.6): rays to leaf transfers, sums up the
// hierarchy, a cut of n_L nodes, a link for each.
#pragma once

#include "bake/hierarchy/hierarchy.h"
#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/caches.h"
#include "relume/hierarchy.h"
#include "relume/links.h"
#include "relume/result.h"

#include <cstdint>
#include <vector>

namespace relume {

struct TracedLinks {
  Links links;
  std::vector<float> firstWeight;  // [Size nodes] pull weights by LinkOptions::pull; replaces Hierarchy::firstWeight
  struct Statistics {
    std::uint64_t rays = 0;
    double backFaceShare = 0, missShare = 0, unmappedShare = 0;  // of all rays
    double visibleLeavesMean = 0;                                // per cache
  } statistics;
};

// Memory: O(K + nodes) a thread; nothing of size n_C x n_S. failed: cancelled.
Result<TracedLinks> traceLinks(const RayTracer& tracer, const Surfels& surfels, const SurfelMap& map,
                               const Hierarchy& hierarchy, const Caches& caches, const LinkOptions& options,
                               std::uint64_t seed, Context& context);

}  // namespace relume
