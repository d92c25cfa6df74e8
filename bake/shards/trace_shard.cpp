// SPDX-License-Identifier: MIT
// See shard.h.
#include "bake/shards/shard.h"
#include "bake/stage_memory.h"
#include "bake/stages.h"

#include <charconv>
#include <string>
#include <utility>

namespace relume {
namespace {

StoredSums storeSums(std::span<const std::uint64_t> sums) {
  std::vector<std::uint32_t> node, sum;
  for (std::uint32_t i = 0; i < sums.size(); ++i) {
    if (sums[i] == 0) continue;
    node.push_back(i);
    sum.push_back(static_cast<std::uint32_t>(sums[i]));
    sum.push_back(static_cast<std::uint32_t>(sums[i] >> 32));
  }
  return {std::move(node), std::move(sum)};
}

Result<Shard> shardStages(const Scene& scene, const BakePlan& plan, const ShardNumber& number, Context& context) {
  if (const Status status = checkPlanVersion(plan); !status) return status.error();
  if (const Status status = checkPlanTracer(plan); !status) return status.error();
  if (const Status status = checkPlanLevel(plan, scene); !status) return status.error();
  if (plan.map.sides.size() != 2 * std::size_t{scene.triangleCount()})
    return Error{ErrorCode::invalidFile, "the plan's map of surfels has " + std::to_string(plan.map.sides.size()) +
                                             " sides, expected two for each of " +
                                             std::to_string(scene.triangleCount()) + " triangles"};
  const Result<RayTracer> tracer = buildRays(scene, plan.chosen, context);
  if (!tracer) return tracer.error();
  if (context.cancelled()) return cancelledError();

  const Bake& bake = plan.bake;
  const double share =
      static_cast<double>(rangeOf(number, bake.caches.count()).count()) / std::max(1u, bake.caches.count());
  return runStage(context, "links", [&] {
    return needs(reserveLinks(bake.hierarchy, bake.caches, plan.chosen.links, context, share), [&] {
      ShardTracer links(*tracer, plan);
      Result<Shard> shard = links.trace(number, context, "links");
      if (shard) noteFigures(links.figures(), context);
      return shard;
    });
  });
}

// What links reckon with, which is not what the bake says where materials are drivable.
Surfels tracedSurfels(const BakePlan& plan) {
  Surfels surfels = plan.bake.surfels;
  if (!plan.tracedEmission.empty()) surfels.emission = plan.tracedEmission;
  return surfels;
}

}  // namespace

std::string toString(const ShardNumber& shard) {
  return std::to_string(shard.number) + "/" + std::to_string(shard.count);
}

Result<ShardNumber> parseShardNumber(const std::string& text) {
  ShardNumber shard{0, 0};
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.number);
  const bool divided = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
  const auto second = divided ? std::from_chars(first.ptr + 1, end, shard.count) : first;
  if (divided && second.ec == std::errc() && second.ptr == end && shard.number >= 1 && shard.number <= shard.count &&
      shard.count <= kMaxShards)
    return shard;
  return Error{ErrorCode::usage, "expected I/N with I from 1 to N, and N up to " + std::to_string(kMaxShards) +
                                     ", found \"" + text + "\""};
}

CacheRange rangeOf(const ShardNumber& shard, std::uint32_t caches) {
  const auto at = [&](std::uint64_t i) { return static_cast<std::uint32_t>(i * caches / shard.count); };
  return {at(shard.number - 1u), at(shard.number)};
}

ShardTracer::ShardTracer(const RayTracer& tracer, const BakePlan& plan)
    : plan_(plan),
      surfels_(tracedSurfels(plan)),
      links_(tracer, surfels_, plan.map, plan.bake.hierarchy, plan.bake.caches, plan.chosen.links, plan.chosen.seed) {}

Result<Shard> ShardTracer::trace(const ShardNumber& number, Context& context, std::string_view stage) {
  const CacheRange range = rangeOf(number, plan_.bake.caches.count());
  Result<TracedRange> traced = links_.trace(range, plan_.minKey, context, stage);
  if (!traced) return traced.error();
  figures_ += traced->figures;
  return Shard{number,
               range,
               std::move(traced->links),
               storeSums(traced->sums.all()),
               storeSums(traced->sums.cut()),
               plan_.identity,
               plan_.bake.provenance};
}

Result<Shard> traceShard(const Scene& scene, const BakePlan& plan, const ShardNumber& number, Context& context) {
  return guardBake(scene, plan.options, context, [&] { return shardStages(scene, plan, number, context); });
}

}  // namespace relume
