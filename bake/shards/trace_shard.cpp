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
  const CacheRange range = rangeOf(number, bake.caches.count());
  const double share = static_cast<double>(range.count()) / std::max(1u, bake.caches.count());
  Surfels surfels = bake.surfels;
  if (!plan.tracedEmission.empty()) surfels.emission = plan.tracedEmission;
  Result<TracedRange> traced = runStage(context, "links", [&] {
    return needs(reserveLinks(bake.hierarchy, bake.caches, plan.chosen.links, context, share), [&] {
      auto rows =
          LinkTracer(*tracer, surfels, plan.map, bake.hierarchy, bake.caches, plan.chosen.links, plan.chosen.seed)
              .trace(range, plan.minKey, context);
      if (rows) noteFigures(*rows, context);
      return rows;
    });
  });
  if (!traced) return traced.error();
  return Shard{number,
               range,
               std::move(traced->links),
               storeSums(traced->sums.all()),
               storeSums(traced->sums.cut()),
               plan.identity,
               bake.provenance};
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

Result<Shard> traceShard(const Scene& scene, const BakePlan& plan, const ShardNumber& number, Context& context) {
  return guardBake(scene, plan.options, context, [&] { return shardStages(scene, plan, number, context); });
}

}  // namespace relume
