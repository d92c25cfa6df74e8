// SPDX-License-Identifier: MIT
// See stored_bake.h.
#include "bake/shards/stored_bake.h"

#include "bake/budget/bake_to_error.h"
#include "bake/budget/choose_sizes.h"
#include "bake/shards/entry_names.h"
#include "bake/shards/said.h"
#include "bake/shards/shard.h"
#include "bake/shards/stored_stages.h"
#include "bake/stage_memory.h"
#include "bake/stages.h"
#include "relume/bake/bake.h"
#include "relume/bake/provenance.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kBlockCaches = 512;  // about 0.7 MB of links at 128 links a cache

// What a found plan says of options and names is that of the bake which kept it.
Status adopt(BakePlan& plan, const Scene& scene, const BakeOptions& options) {
  plan.options = options;
  plan.bake.provenance = describeProvenance(scene, describeInstances(scene), options, plan.bake.provenance.rayTracer);
  const Result<BakeOptions> chosen = chooseLinks(options, plan.bake.surfels, plan.bake.hierarchy, plan.bake.caches);
  if (!chosen) return chosen.error();
  plan.chosen = *chosen;
  plan.bake.links = noLinks(plan.bake.caches, plan.chosen.links);
  return LinkTracer::check(plan.bake.surfels, plan.bake.hierarchy, plan.bake.caches, plan.chosen.links);
}

std::optional<BakePlan> findPlan(const EntryName& name, const Scene& scene, const BakeOptions& options,
                                 EntryCache& store, Context& context) {
  const std::optional<EntryBytes> entry = store.find(name, context);
  if (!entry) return std::nullopt;
  const auto unpacked = unpackSaid(entry->bytes);
  Result<BakePlan> plan = unpacked ? parsePlan(unpacked->behind, entry->owner)
                                   : Error{ErrorCode::invalidFile, "its messages do not fit into it"};
  Status taken = plan ? checkPlanVersion(*plan) : Status(plan.error());
  if (taken) taken = checkPlanTracer(*plan);
  if (taken) taken = checkPlanLevel(*plan, scene);
  if (taken && plan->map.sides.size() != 2 * std::size_t{scene.triangleCount()})
    taken = Error{ErrorCode::invalidFile, "the plan in it is of another level"};
  if (taken) taken = adopt(*plan, scene, options);
  if (!taken) {
    store.reject(name, taken.error().message);
    return std::nullopt;
  }
  for (const Said& said : unpacked->said) context.message(said.severity, said.text);
  return std::move(*plan);
}

Status keepPlan(const EntryName& name, const BakePlan& plan, const std::vector<Said>& said, EntryCache& store,
                Context& context) {
  const Result<std::vector<std::byte>> bytes = serializePlan(plan);
  if (!bytes) return bytes.error();
  store.keep(name, packSaid(said, *bytes), context);
  return done();
}

// A ray tracer, built when it is first needed.
class Tracer {
 public:
  Tracer(const Scene& scene, const BakeOptions& options) : scene_(scene), options_(options) {}
  void take(RayTracer tracer) { tracer_ = std::move(tracer); }
  void drop() { tracer_.reset(); }
  Result<const RayTracer*> get(Context& context) {
    if (!tracer_) {
      Result<RayTracer> built = buildRays(scene_, options_, context);
      if (!built) return built.error();
      tracer_ = std::move(*built);
    }
    return &*tracer_;
  }

 private:
  const Scene& scene_;
  const BakeOptions& options_;
  std::optional<RayTracer> tracer_;
};

std::optional<float> findKeptThreshold(const EntryName& name, EntryCache& store, Context& context) {
  const std::optional<EntryBytes> entry = store.find(name, context);
  if (!entry) return std::nullopt;
  float minKey = 0.0f;
  if (entry->bytes.size() == sizeof(minKey)) std::memcpy(&minKey, entry->bytes.data(), sizeof(minKey));
  if (entry->bytes.size() == sizeof(minKey) && std::isfinite(minKey)) return minKey;
  store.reject(name, "expected one number");
  return std::nullopt;
}

// How far links are refined.
Status setThreshold(const EntryName& name, Tracer& tracer, BakePlan& plan, EntryCache& store, Context& context) {
  if (const auto found = findKeptThreshold(name, store, context)) {
    plan.minKey = *found;
    return done();
  }
  const Result<const RayTracer*> rays = tracer.get(context);
  if (!rays) return rays.error();
  const Result<float> minKey = findThreshold(**rays, plan, context);
  if (!minKey) return minKey.error();
  plan.minKey = *minKey;
  store.keep(name, std::as_bytes(std::span(&plan.minKey, 1)), context);
  return done();
}

// The blocks of a plan's caches that the store has.
std::vector<NamedShard> findBlocks(const EntryName& links, const BakePlan& plan, std::vector<ShardNumber>& missing,
                                   EntryCache& store, Context& context) {
  std::vector<NamedShard> found;
  const std::uint32_t caches = plan.bake.caches.count();
  const std::uint32_t count = std::min(std::max(1u, (caches + kBlockCaches - 1) / kBlockCaches), kMaxShards);
  for (std::uint32_t i = 1; i <= count; ++i) {
    if (!context.progress("find links", static_cast<double>(i - 1) / count)) break;
    const ShardNumber number{i, count};
    const EntryName name = EntryNames::block(links, number);
    const std::optional<EntryBytes> entry = store.find(name, context);
    if (!entry) {
      missing.push_back(number);
      continue;
    }
    Result<Shard> block = parseShard(entry->bytes, entry->owner);
    // It may have been made of a level that differs in colours, whose provenance it has.
    if (block) block->provenance = plan.bake.provenance;
    Status taken = block ? checkShard(*block, plan) : Status(block.error());
    if (taken && !(block->number == number))
      taken = Error{ErrorCode::invalidFile, "it is block " + toString(block->number) + ", not " + toString(number)};
    if (!taken) {
      store.reject(name, taken.error().message);
      missing.push_back(number);
      continue;
    }
    found.push_back({"block " + toString(number), std::move(block)});
  }
  context.progress("find links", 1.0);
  return found;
}

// Trace the blocks that the store does not have, and keep each at once: a bake that is stopped goes on from there.
Status makeBlocks(const EntryName& links, const RayTracer& tracer, const BakePlan& plan,
                  const std::vector<ShardNumber>& missing, std::vector<NamedShard>& blocks, EntryCache& store,
                  Context& context) {
  const Bake& bake = plan.bake;
  const double share = static_cast<double>(missing.size()) / missing.front().count;
  return runStage(context, "links", [&]() -> Status {
    if (const Status granted = reserveLinks(bake.hierarchy, bake.caches, plan.chosen.links, context, share); !granted)
      return granted;
    ShardTracer traced(tracer, plan);
    for (std::size_t i = 0; i < missing.size(); ++i) {
      Result<Shard> block = traced.trace(missing[i], context, "");
      if (!block) return block.error();
      const Result<std::vector<std::byte>> bytes = serializeShard(*block);
      if (!bytes) return bytes.error();
      store.keep(EntryNames::block(links, missing[i]), *bytes, context);
      blocks.push_back({"block " + toString(missing[i]), std::move(block)});
      if (!context.progress("links", static_cast<double>(i + 1) / static_cast<double>(missing.size())))
        return cancelledError();
    }
    noteFigures(traced.figures(), context);
    context.figure("caches_traced", static_cast<double>(traced.figures().caches));
    return done();
  });
}

Result<Bake> bakeStored(const Scene& scene, const BakeOptions& options, EntryCache& store, Context& context) {
  const BakeOptions sized = chooseSizes(options);
  const EntryNames names(scene, sized);
  Tracer tracer(scene, sized);

  // 1. All but the links, and how far they are refined
  std::optional<BakePlan> plan;
  {
    const Context::Stage stage(context, "find plan");
    context.progress("find plan", 0.0);
    plan = findPlan(names.plan(), scene, options, store, context);
    context.progress("find plan", 1.0);
  }
  if (context.cancelled()) return cancelledError();
  if (!plan) {
    const SaidRecorder recorder(context);
    Result<PlannedLevel> planned = planLevel(scene, options, storedStages(scene, sized, names, store), context);
    if (!planned) return planned.error();
    plan = std::move(planned->plan);
    tracer.take(std::move(planned->tracer));
    const Context::Stage stage(context, "keep plan");
    context.progress("keep plan", 0.0);
    if (const Status kept = keepPlan(names.plan(), *plan, recorder.said(), store, context); !kept) return kept.error();
    context.progress("keep plan", 1.0);
  }
  const EntryName threshold = names.threshold(*plan);
  if (const Status set = setThreshold(threshold, tracer, *plan, store, context); !set) return set.error();

  // 2. The links that the store has, and those that it has not. What they are made from is the identity of the plan
  const EntryName links = EntryNames::links(threshold, plan->minKey);
  plan->identity = links.low;
  std::vector<ShardNumber> missing;
  std::vector<NamedShard> blocks;
  {
    const Context::Stage stage(context, "find links");
    blocks = findBlocks(links, *plan, missing, store, context);
  }
  if (context.cancelled()) return cancelledError();
  if (!missing.empty()) {
    const Result<const RayTracer*> rays = tracer.get(context);
    if (!rays) return rays.error();
    if (const Status made = makeBlocks(links, **rays, *plan, missing, blocks, store, context); !made)
      return made.error();
  }

  // 3. Join
  tracer.drop();
  return mergeShards(std::move(*plan), std::move(blocks), context);
}

}  // namespace

Result<Bake> bakeWithStore(const Scene& scene, const BakeOptions& options, EntryCache& store, Context& context) {
  store.reportTo(context.onMessage);
  Result<Bake> baked = guardBake(scene, options, context, [&] {
    return bakeToError(options, context,
                       [&](const BakeOptions& trial) { return bakeStored(scene, trial, store, context); });
  });
  if (!baked && store.statistics().found > 0 && !context.cancelled()) {
    context.message(
        Severity::warning,
        "store " + store.name() + ": what it has gives no bake, which is made without: " + baked.error().message);
    baked = bake(scene, options, context);
  }
  const Context::Stage stage(context, "store");
  store.finish(context);
  return baked;
}

}  // namespace relume
