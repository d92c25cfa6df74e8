// SPDX-License-Identifier: MIT
// Transport, cache by cache (PIC 4.5): gather, sum up, cut, project; see links.h and link_tracer.h.
#include "bake/links/link_tracer.h"
#include "bake/links/links.h"

#include <utility>

namespace relume {
Result<TracedLinks> traceLinks(const RayTracer& tracer, const Surfels& surfels, const SurfelMap& map,
                               const Hierarchy& hierarchy, const Caches& caches, const LinkOptions& options,
                               std::uint64_t seed, Context& context) {
  if (const Status status = LinkTracer::check(surfels, hierarchy, caches, options); !status) return status.error();

  // 1. Data that all caches use
  LinkTracer links(tracer, surfels, map, hierarchy, caches, options, seed);

  // 2. How far caches refine
  const Result<float> minKey = links.findMinKey(context);
  if (!minKey) return minKey.error();

  // 3. Link the caches
  Result<TracedRange> traced = links.trace({0, caches.count()}, *minKey, context);
  if (!traced) return traced.error();
  warnOfManyLinks(traced->links, options, context);

  // 4. What all caches together read of each node
  const TracedLinks::Statistics statistics = noteFigures(traced->figures, context);
  return TracedLinks{std::move(traced->links), traced->sums.weights(hierarchy), statistics};
}

}  // namespace relume
