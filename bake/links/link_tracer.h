// SPDX-License-Identifier: MIT
// Traces the links of a range of caches. What a cache is linked to depends on the cache alone once one threshold is
// known for all of them, and what caches leave behind in common are sums of whole numbers: so ranges may be traced in
// any order, by any number of processes, and joined to what one would have made (joinRows(), PullSums::merge()).
#pragma once

#include "bake/links/gather.h"
#include "bake/links/leaf_order.h"
#include "bake/links/links.h"
#include "bake/links/pull_weights.h"
#include "bake/links/select_cut.h"
#include "bake/links/share_links.h"

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace relume {

struct CacheRange {
  std::uint32_t begin = 0, end = 0;  // [0..n_C]
  std::uint32_t count() const { return end - begin; }
  bool operator==(const CacheRange&) const = default;
};

// What tracing took and gave, as sums over caches.
struct LinkFigures {
  std::uint64_t caches = 0, links = 0, visibleLeaves = 0;
  RayCount rays;
  LinkFigures& operator+=(const LinkFigures& other);
};

// What a range of caches gives.
struct TracedRange {
  Links links;  // rows of the range alone: rowBegin [Size count + 1] from 0
  PullSums sums;
  LinkFigures figures;
};

class LinkTracer {
 public:
  // Keeps references to all but the options. Inputs that check() has taken.
  LinkTracer(const RayTracer& tracer, const Surfels& surfels, const SurfelMap& map, const Hierarchy& hierarchy,
             const Caches& caches, const LinkOptions& options, std::uint64_t seed);
  ~LinkTracer();
  LinkTracer(const LinkTracer&) = delete;
  LinkTracer& operator=(const LinkTracer&) = delete;

  // failed: arrays whose sizes do not fit; usage: options that this hierarchy cannot be linked with.
  static Status check(const Surfels& surfels, const Hierarchy& hierarchy, const Caches& caches,
                      const LinkOptions& options);

  // CutLimit::minKey of all caches: where links are shared out, what every n-th cache would refine decides; -1 where
  // they are not. The rays it casts count to those of the next trace(). failed: cancelled.
  Result<float> findMinKey(Context& context);

  // The links of a range. Memory: O(K + nodes) a thread, and the links. stage: of the progress report; empty = none.
  // failed: cancelled.
  Result<TracedRange> trace(CacheRange range, float minKey, Context& context, std::string_view stage = "links");

 private:
  struct Worker;
  class WorkerPool;
  void look(std::uint32_t cache, Worker& worker) const;
  bool onSurface(std::uint32_t cache) const;
  std::vector<std::uint32_t> askedCaches() const;

  const Hierarchy& hierarchy_;
  const Caches& caches_;
  LinkOptions options_;
  LeafOrder order_;
  NodeGeometry geometry_;
  std::vector<CutNode> cutNode_;
  Gatherer gatherer_;
  LinkBudget budget_;
  std::unique_ptr<WorkerPool> pool_;
};

// Note them as figures of the stage that runs now.
TracedLinks::Statistics noteFigures(const LinkFigures& figures, Context& context);
// Of all caches: tells of more links than LinkOptions::linksTotal asks for.
void warnOfManyLinks(const Links& links, const LinkOptions& options, Context& context);

}  // namespace relume
