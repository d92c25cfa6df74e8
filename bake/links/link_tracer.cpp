// SPDX-License-Identifier: MIT
// See link_tracer.h. Nothing of size n_C x n_S is stored: a thread keeps what one cache sees, and O(nodes) sums for the
// pull weights.
#include "bake/links/link_tracer.h"

#include "bake/base/parallel.h"
#include "bake/base/place_number.h"
#include "bake/links/join_rows.h"
#include "bake/links/project.h"
#include "bake/links/visible_subtree.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <mutex>
#include <string>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kGrain = 16;          // caches per chunk
constexpr std::size_t kAskedCaches = 1024;  // at least so many caches, or all, decide how links are shared out
constexpr double kOverTotal = 1.05;         // a total that is exceeded by more than this factor gets a warning

}  // namespace

// What one thread needs for one cache, and its own sums over caches.
struct LinkTracer::Worker {
  Worker(const Hierarchy& hierarchy, const LeafOrder& order, const LinkOptions& options)
      : tree(order), sums(hierarchy, options.pull) {}

  Gatherer::Scratch gather;
  std::vector<Arrival> arrivals;
  VisibleSubtree tree;
  CutKeys keys;
  std::vector<CutCandidate> queue;
  std::vector<CutLink> cut;
  ProjectScratch project;
  PullSums sums;
  KeyCounts keyCounts;
  RayCount count;
  std::uint64_t visibleLeaves = 0;
};

// Lends workers to chunks. It makes as many as there are chunks that run at the same time.
class LinkTracer::WorkerPool {
 public:
  WorkerPool(const Hierarchy& hierarchy, const LeafOrder& order, const LinkOptions& options)
      : hierarchy_(hierarchy), order_(order), options_(options) {}

  std::unique_ptr<Worker> take() {
    {
      const std::scoped_lock lock(mutex_);
      if (!idle_.empty()) {
        auto worker = std::move(idle_.back());
        idle_.pop_back();
        return worker;
      }
    }
    return std::make_unique<Worker>(hierarchy_, order_, options_);
  }
  void giveBack(std::unique_ptr<Worker> worker) {
    const std::scoped_lock lock(mutex_);
    idle_.push_back(std::move(worker));
  }
  std::span<const std::unique_ptr<Worker>> all() const { return idle_; }
  // All workers with what they have summed up. The next ones begin at zero.
  std::vector<std::unique_ptr<Worker>> takeAll() { return std::exchange(idle_, {}); }

 private:
  const Hierarchy& hierarchy_;
  const LeafOrder& order_;
  const LinkOptions& options_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Worker>> idle_;
};

LinkTracer::LinkTracer(const RayTracer& tracer, const Surfels& surfels, const SurfelMap& map,
                       const Hierarchy& hierarchy, const Caches& caches, const LinkOptions& options, std::uint64_t seed)
    : hierarchy_(hierarchy),
      caches_(caches),
      options_(options),
      order_(hierarchy),
      geometry_(nodeGeometry(hierarchy, surfels)),
      cutNode_(cutNodes(hierarchy, geometry_, options.key, surfels.emission)),
      gatherer_(tracer, surfels, map, hierarchy, options.raysPerCache, options.emitterRays, seed),
      budget_(options, caches.count(), hierarchy.groupRoot.size()),
      pool_(std::make_unique<WorkerPool>(hierarchy_, order_, options_)) {}

LinkTracer::~LinkTracer() = default;

Status LinkTracer::check(const Surfels& surfels, const Hierarchy& hierarchy, const Caches& caches,
                         const LinkOptions& options) {
  if (hierarchy.nodeCount() == 0 || hierarchy.senderCount() != surfels.count() + hierarchy.skyDirection.size()) {
    return Error{ErrorCode::failed, "links: the hierarchy has " + std::to_string(hierarchy.senderCount()) +
                                        " senders, expected " + std::to_string(surfels.count()) + " surfels and " +
                                        std::to_string(hierarchy.skyDirection.size()) + " sky patches"};
  }
  if (caches.normal.size() != caches.positionWorld.size()) {
    return Error{ErrorCode::failed, "links: caches have different numbers of positions and normals"};
  }
  if (linkHasHead(options.kind) && hierarchy.nodeCount() > kMaxCompactNodes) {
    return Error{ErrorCode::usage, "links: compact kinds reach " + std::to_string(kMaxCompactNodes) +
                                       " nodes, the hierarchy has " + std::to_string(hierarchy.nodeCount()) +
                                       "; use fewer surfels, or cone or SH links"};
  }
  const std::uint32_t max = options.maxLinksPerCache > 0 ? options.maxLinksPerCache : options.linksPerCache;
  if (max < hierarchy.groupRoot.size()) {
    return Error{ErrorCode::usage,
                 "links per cache: at least " + std::to_string(hierarchy.groupRoot.size()) +
                     " are needed here (reflecting surfaces, emitters and sky are linked apart), found " +
                     std::to_string(max)};
  }
  return done();
}

bool LinkTracer::onSurface(std::uint32_t cache) const {
  return glm::dot(caches_.normal[cache], caches_.normal[cache]) > 0.0f;
}

// What a cache sees, and what its links would cost and read.
void LinkTracer::look(std::uint32_t cache, Worker& w) const {
  gatherer_.gather(caches_.positionWorld[cache], caches_.normal[cache], w.gather, w.arrivals, w.count);
  w.tree.build(w.arrivals, onSurface(cache) ? 1.0f : 0.25f);
  cutKeys(w.tree, cutNode_, options_.key, w.keys);
}

// Those that decide how links are shared out: chosen by where they are, so that few others are after an edit.
std::vector<std::uint32_t> LinkTracer::askedCaches() const {
  const std::uint64_t oneOf = std::bit_floor(std::max<std::size_t>(1, caches_.count() / kAskedCaches));
  std::vector<std::uint32_t> asked;
  for (std::uint32_t c = 0; c < caches_.count(); ++c) {
    if (placeNumber(caches_.positionWorld[c], caches_.normal[c]) % oneOf == 0) asked.push_back(c);
  }
  if (asked.empty() && caches_.count() > 0) asked.push_back(0);
  return asked;
}

Result<float> LinkTracer::findMinKey(Context& context) {
  if (!budget_.isShared) return CutLimit{}.minKey;
  CutLimit limit{budget_.maxPerCache};
  limit.maxKeySum = keySumOf(options_.maxError, levelRadius(hierarchy_, geometry_));
  const std::vector<std::uint32_t> asked = askedCaches();
  parallelChunks(context, "links: shares", asked.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<Worker> worker = pool_->take();
    for (std::size_t i = begin; i < end; ++i) {
      look(asked[i], *worker);
      selectCut(worker->tree, worker->keys, limit, worker->queue, worker->cut);
      worker->keyCounts.add(worker->tree, worker->keys.key, static_cast<std::uint32_t>(worker->cut.size()));
    }
    pool_->giveBack(std::move(worker));
  });
  if (context.cancelled()) return cancelledError();
  KeyCounts counts;
  for (const auto& worker : pool_->all()) counts.merge(std::exchange(worker->keyCounts, {}));
  return counts.keyFor(budget_.total * static_cast<double>(counts.caches()) / static_cast<double>(caches_.count()));
}

Result<TracedRange> LinkTracer::trace(CacheRange range, float minKey, Context& context, std::string_view stage) {
  CutLimit limit{budget_.maxPerCache};
  limit.minKey = minKey;
  limit.maxKeySum = keySumOf(options_.maxError, levelRadius(hierarchy_, geometry_));

  std::vector<LinkRowBuilder> chunks((range.count() + kGrain - 1) / kGrain, LinkRowBuilder(options_.kind));
  parallelChunks(context, stage, range.count(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<Worker> worker = pool_->take();
    Worker& w = *worker;
    LinkRowBuilder& rows = chunks[begin / kGrain];
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t c = range.begin + static_cast<std::uint32_t>(i);
      look(c, w);
      selectCut(w.tree, w.keys, limit, w.queue, w.cut);
      appendRow(w.tree, w.cut, w.arrivals, onSurface(c), options_.kind, options_.bands, w.project, rows);
      w.sums.add(w.tree, w.cut);
      w.visibleLeaves += w.tree.leaves().size();
    }
    pool_->giveBack(std::move(worker));
  });
  if (context.cancelled()) return cancelledError();

  Result<Links> links = joinRows(chunks, options_);
  if (!links) return links.error();
  TracedRange traced{std::move(*links), PullSums(hierarchy_, options_.pull), {}};
  traced.figures.caches = range.count();
  traced.figures.links = traced.links.count();
  for (const auto& worker : pool_->takeAll()) {
    traced.sums.merge(worker->sums);
    traced.figures.rays += worker->count;
    traced.figures.visibleLeaves += worker->visibleLeaves;
  }
  return traced;
}

LinkFigures& LinkFigures::operator+=(const LinkFigures& other) {
  caches += other.caches;
  links += other.links;
  visibleLeaves += other.visibleLeaves;
  rays += other.rays;
  return *this;
}

TracedLinks::Statistics noteFigures(const LinkFigures& figures, Context& context) {
  const RayCount& count = figures.rays;
  const auto share = [](std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
  };
  const TracedLinks::Statistics statistics{count.rays, share(count.backFaces, count.rays),
                                           share(count.misses, count.rays), share(count.unmapped, count.rays),
                                           share(figures.visibleLeaves, figures.caches)};
  context.figure("links", static_cast<double>(figures.links));
  context.figure("rays", static_cast<double>(count.rays));
  context.figure("rays_aimed", static_cast<double>(count.aimed));
  context.figure("rays_back_face_share", statistics.backFaceShare);
  context.figure("rays_missed_share", statistics.missShare);
  context.figure("rays_unmapped_share", statistics.unmappedShare);
  context.figure("visible_leaves_mean", statistics.visibleLeavesMean);
  return statistics;
}

void warnOfManyLinks(const Links& links, const LinkOptions& options, Context& context) {
  if (options.linksTotal == 0 || links.count() <= kOverTotal * options.linksTotal) return;
  context.message(Severity::warning,
                  "links: " + std::to_string(links.count()) + " links where " + std::to_string(options.linksTotal) +
                      " were asked for in all: every cache needs one for each of the reflecting "
                      "surfaces, emitters and sky that it sees; ask for more links, or for fewer caches");
}

}  // namespace relume
