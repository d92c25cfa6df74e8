// SPDX-License-Identifier: MIT
// See stored_bake.h.
#include "bake/shards/stored_bake.h"

#include "bake/rays/ray_tracer_name.h"
#include "bake/shards/said.h"
#include "bake/shards/shard.h"
#include "bake/stage_memory.h"
#include "bake/stages.h"
#include "formats/chunks.h"
#include "relume/bake/bake.h"
#include "relume/bake/provenance.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kBlockCaches = 512;  // about 0.7 MB of links at 128 links a cache

// Processors of different makers may differ in where a ray at an edge ends (docs/notes/determinism.md).
const char* processorMaker() {
#if defined(__x86_64__) && defined(__GNUC__)
  __builtin_cpu_init();
  if (__builtin_cpu_is("amd")) return "amd";
  if (__builtin_cpu_is("intel")) return "intel";
#endif
  return "other";
}

// The names of what is made of this level with these options by this program.
class Names {
 public:
  Names(const Scene& scene, const BakeOptions& options) {
    const Provenance p = describeProvenance(scene, describeInstances(scene), options, rayTracerName(options.embreeIsa));
    base_ = std::string("relume store 1\nprocessor ") + processorMaker() + "\ntool " + p.toolVersion + "\nalgorithm " +
            std::to_string(p.algorithmVersion) + "\nfiles " + std::to_string(kPlanFileType.version) + " " +
            std::to_string(kShardFileType.version) + " " + std::to_string(kBakeFormatVersion) + "\ntracer " +
            p.rayTracer + "\nlevel " + std::to_string(p.sceneHash) + " " + std::to_string(p.viewHash) + " " +
            std::to_string(p.cameraHash) + "\nbands " + std::to_string(p.lumaBands) + " " +
            std::to_string(p.chromaBands) + "\nseed " + std::to_string(p.seed) + "\noptions " + p.optionsJson + "\n";
  }
  EntryName plan() const { return name("plan"); }
  // A plan's identity is the hash of all that the links are traced with.
  EntryName block(std::uint64_t plan, const ShardNumber& number) const {
    return name("links " + std::to_string(plan) + " " + toString(number));
  }

 private:
  EntryName name(const std::string& what) const {
    const std::string text = base_ + what;
    return nameEntry(std::as_bytes(std::span(text)));
  }
  std::string base_;
};

std::optional<BakePlan> findPlan(const Names& names, const Scene& scene, EntryCache& store, Context& context) {
  const std::optional<EntryBytes> entry = store.find(names.plan(), context);
  if (!entry) return std::nullopt;
  const auto unpacked = unpackSaid(entry->bytes);
  Result<BakePlan> plan = unpacked ? parsePlan(unpacked->behind, entry->owner)
                                   : Error{ErrorCode::invalidFile, "its messages do not fit into it"};
  Status taken = plan ? checkPlanVersion(*plan) : Status(plan.error());
  if (taken) taken = checkPlanTracer(*plan);
  if (taken) taken = checkPlanLevel(*plan, scene);
  if (taken && plan->map.sides.size() != 2 * std::size_t{scene.triangleCount()})
    taken = Error{ErrorCode::invalidFile, "the plan in it is of another level"};
  if (!taken) {
    store.reject(names.plan(), taken.error().message, context);
    return std::nullopt;
  }
  for (const Said& said : unpacked->said) context.message(said.severity, said.text);
  return std::move(*plan);
}

// Of a plan just made: its identity is that of its file.
Status keepPlan(const Names& names, BakePlan& plan, const std::vector<Said>& said, EntryCache& store,
                Context& context) {
  const Result<std::vector<std::byte>> bytes = serializePlan(plan);
  if (!bytes) return bytes.error();
  plan.identity = identityOf(*bytes);
  store.keep(names.plan(), packSaid(said, *bytes), context);
  return done();
}

// The blocks of a plan's caches that the store has.
std::vector<NamedShard> findBlocks(const Names& names, const BakePlan& plan, std::vector<ShardNumber>& missing,
                                   EntryCache& store, Context& context) {
  std::vector<NamedShard> found;
  const std::uint32_t caches = plan.bake.caches.count();
  const std::uint32_t count = std::min(std::max(1u, (caches + kBlockCaches - 1) / kBlockCaches), kMaxShards);
  for (std::uint32_t i = 1; i <= count && !context.cancelled(); ++i) {
    const ShardNumber number{i, count};
    const EntryName name = names.block(plan.identity, number);
    const std::optional<EntryBytes> entry = store.find(name, context);
    if (!entry) {
      missing.push_back(number);
      continue;
    }
    Result<Shard> block = parseShard(entry->bytes, entry->owner);
    Status taken = block ? checkShard(*block, plan) : Status(block.error());
    if (taken && !(block->number == number))
      taken = Error{ErrorCode::invalidFile, "it is block " + toString(block->number) + ", not " + toString(number)};
    if (!taken) {
      store.reject(name, taken.error().message, context);
      missing.push_back(number);
      continue;
    }
    found.push_back({"block " + toString(number), std::move(block)});
  }
  return found;
}

// Trace the blocks that the store does not have, and keep each at once: a bake that is stopped goes on from there.
Status makeBlocks(const Names& names, const RayTracer& tracer, const BakePlan& plan,
                  const std::vector<ShardNumber>& missing, std::vector<NamedShard>& blocks, EntryCache& store,
                  Context& context) {
  const Bake& bake = plan.bake;
  const double share = static_cast<double>(missing.size()) / missing.front().count;
  return runStage(context, "links", [&]() -> Status {
    if (const Status granted = reserveLinks(bake.hierarchy, bake.caches, plan.options.links, context, share); !granted)
      return granted;
    ShardTracer links(tracer, plan);
    for (std::size_t i = 0; i < missing.size(); ++i) {
      Result<Shard> block = links.trace(missing[i], context, "");
      if (!block) return block.error();
      const Result<std::vector<std::byte>> bytes = serializeShard(*block);
      if (!bytes) return bytes.error();
      store.keep(names.block(plan.identity, missing[i]), *bytes, context);
      blocks.push_back({"block " + toString(missing[i]), std::move(block)});
      if (!context.progress("links", static_cast<double>(i + 1) / static_cast<double>(missing.size())))
        return cancelledError();
    }
    noteFigures(links.figures(), context);
    context.figure("caches_traced", static_cast<double>(links.figures().caches));
    return done();
  });
}

// A bake, or what is wrong with what the store has: then `ofStore` is set.
Result<Bake> bakeStored(const Scene& scene, const BakeOptions& options, EntryCache& store, Context& context,
                        bool& ofStore) {
  const Names names(scene, options);

  // 1. All but the links
  std::optional<BakePlan> plan;
  std::optional<RayTracer> tracer;
  {
    const Context::Stage stage(context, "find plan");
    plan = findPlan(names, scene, store, context);
  }
  ofStore = plan.has_value();
  if (context.cancelled()) return cancelledError();
  if (!plan) {
    const SaidRecorder recorder(context);
    Result<PlannedLevel> planned = planLevel(scene, options, context);
    if (!planned) return planned.error();
    plan = std::move(planned->plan);
    tracer = std::move(planned->tracer);
    const Context::Stage stage(context, "keep plan");
    if (const Status kept = keepPlan(names, *plan, recorder.said(), store, context); !kept) return kept.error();
  }

  // 2. The links that the store has, and those that it has not
  std::vector<ShardNumber> missing;
  std::vector<NamedShard> blocks;
  {
    const Context::Stage stage(context, "find links");
    blocks = findBlocks(names, *plan, missing, store, context);
  }
  ofStore = ofStore || !blocks.empty();
  if (context.cancelled()) return cancelledError();
  if (!missing.empty()) {
    if (!tracer) {
      Result<RayTracer> built = buildRays(scene, options, context);
      if (!built) return built.error();
      tracer = std::move(*built);
    }
    if (const Status made = makeBlocks(names, *tracer, *plan, missing, blocks, store, context); !made)
      return made.error();
  }
  tracer.reset();

  // 3. Join
  return mergeShards(std::move(*plan), std::move(blocks), context);
}

}  // namespace

Result<Bake> bakeWithStore(const Scene& scene, const BakeOptions& options, EntryCache& store, Context& context) {
  bool ofStore = false;
  Result<Bake> baked =
      guardBake(scene, options, context, [&] { return bakeStored(scene, options, store, context, ofStore); });
  if (!baked && ofStore && !context.cancelled()) {
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
