// SPDX-License-Identifier: MIT
// Transport, cache by cache (PIC 4.5): gather, sum up, cut, project; see links.h. Nothing of size n_C x n_S is stored:
// a thread keeps what one cache sees, and O(nodes) sums for the pull weights.
#include "bake/base/parallel.h"
#include "bake/links/gather.h"
#include "bake/links/links.h"
#include "bake/links/project.h"
#include "bake/links/pull_weights.h"
#include "bake/links/select_cut.h"
#include "bake/links/share_links.h"
#include "bake/links/visible_subtree.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <memory>
#include <mutex>

namespace relume {
namespace {

constexpr std::size_t kGrain = 16;          // caches per chunk
constexpr double kOverTotal = 1.05;         // a total that is exceeded by more than this factor gets a warning
constexpr std::size_t kAskedCaches = 1024;  // at least so many caches, or all, decide how links are shared out

// What one thread needs for one cache, and its own sums over caches.
struct Worker {
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
class WorkerPool {
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

 private:
  const Hierarchy& hierarchy_;
  const LeafOrder& order_;
  const LinkOptions& options_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Worker>> idle_;
};

Status checkInput(const Hierarchy& hierarchy, const Surfels& surfels, const Caches& caches,
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

bool onSurface(const Caches& caches, std::size_t cache) {
  return glm::dot(caches.normal[cache], caches.normal[cache]) > 0.0f;
}

// Join the chunks' rows, freeing each as it is copied.
Result<Links> joinRows(std::vector<LinkRowBuilder>& chunks, const LinkOptions& options) {
  std::uint64_t total = 0;
  for (const LinkRowBuilder& rows : chunks) total += rows.shNode.size() + rows.cone.size() + rows.compact.head.size();
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    return Error{ErrorCode::failed,
                 "links: " + std::to_string(total) + " links are more than 2^32 - 1; use fewer caches or links"};
  }
  std::vector<std::uint32_t> rowBegin{0}, shNode, head, shape8;
  std::vector<std::uint16_t> shCoefficients, shape6;
  std::vector<ConeLink> cone;
  if (options.kind == LinkKind::sh) {
    shNode.reserve(total);
    shCoefficients.reserve(total * options.bands * options.bands);
  } else if (options.kind == LinkKind::cone) {
    cone.reserve(total);
  } else {
    head.reserve(total);
    shape6.reserve(options.kind == LinkKind::oct6 ? total : 0);
  }
  const auto append = [](auto& all, const auto& part) { all.insert(all.end(), part.begin(), part.end()); };
  for (LinkRowBuilder& rows : chunks) {
    for (const std::uint32_t length : rows.length) rowBegin.push_back(rowBegin.back() + length);
    append(shNode, rows.shNode);
    append(shCoefficients, rows.shCoefficients);
    append(cone, rows.cone);
    append(head, rows.compact.head);
    append(shape8, rows.compact.shape8);
    append(shape6, rows.compact.shape6);
    rows = LinkRowBuilder(options.kind);
  }
  Links links;
  links.kind = options.kind;
  links.bands = options.kind == LinkKind::sh ? options.bands : 0;
  links.rowBegin = std::move(rowBegin);
  links.shNode = std::move(shNode);
  links.shCoefficients = std::move(shCoefficients);
  links.cone = std::move(cone);
  links.head = std::move(head);
  links.shape = options.kind == LinkKind::oct6 ? joinHalves(shape6) : std::move(shape8);
  return links;
}

}  // namespace

Result<TracedLinks> traceLinks(const RayTracer& tracer, const Surfels& surfels, const SurfelMap& map,
                               const Hierarchy& hierarchy, const Caches& caches, const LinkOptions& options,
                               std::uint64_t seed, Context& context) {
  if (Status status = checkInput(hierarchy, surfels, caches, options); !status) return status.error();

  // 1. Data that all caches use
  const LeafOrder order(hierarchy);
  const NodeGeometry geometry = nodeGeometry(hierarchy, surfels);
  const std::vector<CutNode> cutNode = cutNodes(hierarchy, geometry, options.key, surfels.emission);
  const Gatherer gatherer(tracer, surfels, map, hierarchy, options.raysPerCache, options.emitterRays, seed);
  WorkerPool pool(hierarchy, order, options);
  const auto look = [&](std::size_t c, Worker& w) {
    gatherer.gather(static_cast<std::uint32_t>(c), caches.positionWorld[c], caches.normal[c], w.gather, w.arrivals,
                    w.count);
    w.tree.build(w.arrivals, onSurface(caches, c) ? 1.0f : 0.25f);
    cutKeys(w.tree, cutNode, options.key, w.keys);
  };

  // 2. How far caches refine. If links are shared out: find what every n-th cache would refine
  const LinkBudget budget(options, caches.count(), hierarchy.groupRoot.size());
  CutLimit limit{budget.maxPerCache};
  limit.maxKeySum = keySumOf(options.maxError, levelRadius(hierarchy, geometry));
  if (budget.isShared) {
    const std::size_t step = std::max<std::size_t>(1, caches.count() / kAskedCaches);
    parallelChunks(
        context, "links: shares", (caches.count() + step - 1) / step, kGrain, [&](std::size_t begin, std::size_t end) {
          std::unique_ptr<Worker> worker = pool.take();
          for (std::size_t i = begin; i < end; ++i) {
            look(i * step, *worker);
            selectCut(worker->tree, worker->keys, limit, worker->queue, worker->cut);
            worker->keyCounts.add(worker->tree, worker->keys.key, static_cast<std::uint32_t>(worker->cut.size()));
          }
          pool.giveBack(std::move(worker));
        });
    if (context.cancelled()) return cancelledError();
    KeyCounts counts;
    for (const auto& worker : pool.all()) counts.merge(worker->keyCounts);
    limit.minKey =
        counts.keyFor(budget.total * static_cast<double>(counts.caches()) / static_cast<double>(caches.count()));
  }

  // 3. Link the caches
  std::vector<LinkRowBuilder> chunks((caches.count() + kGrain - 1) / kGrain, LinkRowBuilder(options.kind));
  parallelChunks(context, "links", caches.count(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::unique_ptr<Worker> worker = pool.take();
    Worker& w = *worker;
    LinkRowBuilder& rows = chunks[begin / kGrain];
    for (std::size_t c = begin; c < end; ++c) {
      look(c, w);
      selectCut(w.tree, w.keys, limit, w.queue, w.cut);
      appendRow(w.tree, w.cut, w.arrivals, onSurface(caches, c), options.kind, options.bands, w.project, rows);
      w.sums.add(w.tree, w.cut);
      w.visibleLeaves += w.tree.leaves().size();
    }
    pool.giveBack(std::move(worker));
  });
  if (context.cancelled()) return cancelledError();

  // 4. Join rows and sums
  Result<Links> links = joinRows(chunks, options);
  if (!links) return links.error();
  TracedLinks traced;
  traced.links = std::move(*links);
  if (options.linksTotal > 0 && traced.links.count() > kOverTotal * options.linksTotal) {
    context.message(Severity::warning,
                    "links: " + std::to_string(traced.links.count()) + " links where " +
                        std::to_string(options.linksTotal) +
                        " were asked for in all: every cache needs one for each of the reflecting "
                        "surfaces, emitters and sky that it sees; ask for more links, or for fewer caches");
  }
  PullSums sums(hierarchy, options.pull);
  RayCount count;
  std::uint64_t visibleLeaves = 0;
  for (const auto& worker : pool.all()) {
    sums.merge(worker->sums);
    count += worker->count;
    visibleLeaves += worker->visibleLeaves;
  }
  traced.firstWeight = sums.weights(hierarchy);

  // 5. Statistics
  const auto share = [](std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
  };
  traced.statistics = {count.rays, share(count.backFaces, count.rays), share(count.misses, count.rays),
                       share(count.unmapped, count.rays), share(visibleLeaves, caches.count())};
  context.figure("links", traced.links.count());
  context.figure("rays", static_cast<double>(count.rays));
  context.figure("rays_aimed", static_cast<double>(count.aimed));
  context.figure("rays_back_face_share", traced.statistics.backFaceShare);
  context.figure("rays_missed_share", traced.statistics.missShare);
  context.figure("rays_unmapped_share", traced.statistics.unmappedShare);
  context.figure("visible_leaves_mean", traced.statistics.visibleLeavesMean);
  return traced;
}

}  // namespace relume
