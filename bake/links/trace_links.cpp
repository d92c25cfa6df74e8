// SPDX-License-Identifier: MIT
// Transport, cache by cache (PIC 4.5): gather, sum up, cut, project; see links.h and link_tracer.h.
#include "bake/links/link_tracer.h"
#include "bake/links/links.h"

#include <string>
#include <utility>

namespace relume {
namespace {

constexpr double kOverTotal = 1.05;  // a total that is exceeded by more than this factor gets a warning

}  // namespace

void warnOfManyLinks(const Links& links, const LinkOptions& options, Context& context) {
  if (options.linksTotal == 0 || links.count() <= kOverTotal * options.linksTotal) return;
  context.message(Severity::warning,
                  "links: " + std::to_string(links.count()) + " links where " + std::to_string(options.linksTotal) +
                      " were asked for in all: every cache needs one for each of the reflecting "
                      "surfaces, emitters and sky that it sees; ask for more links, or for fewer caches");
}

TracedLinks::Statistics noteFigures(const TracedRange& range, Context& context) {
  const RayCount& count = range.rays;
  const auto share = [](std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
  };
  const TracedLinks::Statistics statistics{count.rays, share(count.backFaces, count.rays),
                                           share(count.misses, count.rays), share(count.unmapped, count.rays),
                                           share(range.visibleLeaves, range.links.cacheCount())};
  context.figure("links", range.links.count());
  context.figure("rays", static_cast<double>(count.rays));
  context.figure("rays_aimed", static_cast<double>(count.aimed));
  context.figure("rays_back_face_share", statistics.backFaceShare);
  context.figure("rays_missed_share", statistics.missShare);
  context.figure("rays_unmapped_share", statistics.unmappedShare);
  context.figure("visible_leaves_mean", statistics.visibleLeavesMean);
  return statistics;
}

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
  const TracedLinks::Statistics statistics = noteFigures(*traced, context);
  return TracedLinks{std::move(traced->links), traced->sums.weights(hierarchy), statistics};
}

}  // namespace relume
