// SPDX-License-Identifier: MIT
// A shard: the links of a range of a plan's caches, traced by one process; and the bake that all of them make. The
// ranges may be cut in any way, traced in any order, at any number of threads: the merged bake has the bytes of one
// that was made at once. formats/README.md documents the file of a shard.
#pragma once

#include "bake/links/link_tracer.h"
#include "bake/shards/plan.h"
#include "relume/array.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kMaxShards = 1'000'000;

// Shard `number` of `count`.
struct ShardNumber {
  std::uint32_t number = 1, count = 1;  // [1..count], [1..kMaxShards]
  bool operator==(const ShardNumber&) const = default;
};
std::string toString(const ShardNumber& shard);  // "2/6"
// As toString() writes it. usage: anything else.
Result<ShardNumber> parseShardNumber(const std::string& text);
// Its caches: as many in each shard as in the others, to one.
CacheRange rangeOf(const ShardNumber& shard, std::uint32_t caches);

// Sums of PullSums that are not zero. [Size n each]
struct StoredSums {
  Array<std::uint32_t> node;  // ascending
  Array<std::uint32_t> sum;   // [Size 2n] low word, high word
};

struct Shard {
  ShardNumber number;
  CacheRange range;
  Links links;             // rows of the range alone
  StoredSums all, cut;     // PullSums::all(), cut(); empty for equal areas
  std::uint64_t plan = 0;  // BakePlan::identity
  Provenance provenance;   // of its plan: says what differs where a shard is of another one
};

// Traces shards of one plan, one after another. Keeps references to all it is made from. The plan has an identity, and
// is of the tracer's level.
class ShardTracer {
 public:
  ShardTracer(const RayTracer& tracer, const BakePlan& plan);
  // What BakePlan::minKey is to be; failed: cancelled.
  Result<float> findMinKey(Context& context) { return links_.findMinKey(context); }
  // stage: of the progress report; empty = none. failed: cancelled.
  Result<Shard> trace(const ShardNumber& number, Context& context, std::string_view stage);
  // Of all shards up to now.
  const LinkFigures& figures() const { return figures_; }

 private:
  const BakePlan& plan_;
  Surfels surfels_;
  LinkTracer links_;
  LinkFigures figures_;
};

// Trace a shard's links. The plan was read (it has an identity). Errors as of bake(), and of checkPlanVersion(),
// checkPlanTracer() and checkPlanLevel().
Result<Shard> traceShard(const Scene& scene, const BakePlan& plan, const ShardNumber& number, Context& context);

// Done where the shard is of this plan and fits it, so that it is safe to merge. invalidFile: it says what differs;
// unsupported: of another version of the program.
Status checkShard(const Shard& shard, const BakePlan& plan);

// As a file. Errors as of writeBake() and readBake(). What was read is to be asked checkShard().
Status writeShard(const Shard& shard, const std::filesystem::path& path);
Result<std::vector<std::byte>> serializeShard(const Shard& shard);
Result<Shard> readShard(const std::filesystem::path& path);
Result<Shard> parseShard(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner);

// A shard as it was read, or why it could not be.
struct NamedShard {
  std::string name;  // of its file
  Result<Shard> shard;
};

// The whole bake. Every cache must be in exactly one shard; shards of different counts may be mixed. invalidFile,
// unsupported or what could not be read: one message that names all shards that are missing, doubled, damaged, or of
// another plan. unsupported: checkPlanVersion(). failed: cancelled.
Result<Bake> mergeShards(BakePlan plan, std::vector<NamedShard> shards, Context& context);

}  // namespace relume
