// SPDX-License-Identifier: MIT
// See shard.h.
#include "bake/links/join_rows.h"
#include "bake/shards/shard.h"
#include "bake/stages.h"

#include <algorithm>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kMaxNamed = 12;  // problems that a message names

// All that is wrong with a set of shards, each text once, as one error with the code of the first.
class Problems {
 public:
  void add(ErrorCode code, std::string text) {
    if (texts_.empty()) code_ = code;
    if (std::find(texts_.begin(), texts_.end(), text) == texts_.end()) texts_.push_back(std::move(text));
  }
  bool any() const { return !texts_.empty(); }
  Error error() const {
    std::string message = "the shards cannot be merged:";
    for (std::size_t i = 0; i < std::min(kMaxNamed, texts_.size()); ++i) message += "\n  " + texts_[i];
    if (texts_.size() > kMaxNamed) message += "\n  and " + std::to_string(texts_.size() - kMaxNamed) + " more";
    return {code_, message};
  }

 private:
  ErrorCode code_ = ErrorCode::invalidFile;
  std::vector<std::string> texts_;
};

std::string cachesOf(const CacheRange& range) {
  return "caches " + std::to_string(range.begin) + " to " + std::to_string(range.end - 1);
}

// A gap as the shards that would fill it, where all shards are of one count: "shard 2/6" or "shards 2/6, 3/6".
std::string missing(const CacheRange& gap, std::uint32_t caches, const std::optional<std::uint32_t>& count) {
  std::string names;
  std::size_t named = 0;
  for (std::uint32_t i = 1; count && i <= *count; ++i) {
    const CacheRange range = rangeOf({i, *count}, caches);
    if (range.count() == 0 || range.begin < gap.begin || range.end > gap.end) continue;
    if (++named <= kMaxNamed) names += (names.empty() ? "" : ", ") + toString(ShardNumber{i, *count});
  }
  if (named > kMaxNamed) names += " and " + std::to_string(named - kMaxNamed) + " more";
  if (names.empty()) return "missing: " + cachesOf(gap) + " are in none of the shards";
  return std::string("missing: shard") + (named == 1 ? " " : "s ") + names + ", " + cachesOf(gap);
}

// What two shards both have.
std::string doubled(const CacheRange& caches, const NamedShard& a, const NamedShard& b) {
  std::error_code isNone;
  const bool sameName = a.name == b.name, sameFile = sameName || std::filesystem::equivalent(a.name, b.name, isNone);
  return "doubled: " + cachesOf(caches) + " are in " + a.name + " (shard " + toString(a.shard->number) + ")" +
         (sameName ? "" : " and in " + b.name + " (shard " + toString(b.shard->number) + ")") +
         (sameFile ? ", given twice" : "");
}

// Whether every cache is in exactly one shard. Shards are sorted by their ranges.
void checkCoverage(std::span<const NamedShard> shards, std::uint32_t caches, Problems& problems) {
  std::optional<std::uint32_t> count;
  if (!shards.empty()) count = shards[0].shard->number.count;
  for (const NamedShard& s : shards) {
    if (s.shard->number.count != count) count.reset();
  }
  std::uint32_t end = 0;
  const NamedShard* last = nullptr;
  for (const NamedShard& s : shards) {
    const CacheRange& range = s.shard->range;
    if (range.count() == 0) continue;
    if (range.begin > end) problems.add(ErrorCode::invalidFile, missing({end, range.begin}, caches, count));
    if (range.begin < end)
      problems.add(ErrorCode::invalidFile, doubled({range.begin, std::min(end, range.end)}, *last, s));
    if (range.end > end) {
      end = range.end;
      last = &s;
    }
  }
  if (end < caches) problems.add(ErrorCode::invalidFile, missing({end, caches}, caches, count));
}

// Shards that can be read and are of the plan, sorted by their caches; all others are problems.
std::vector<NamedShard> takeFitting(std::vector<NamedShard> shards, const BakePlan& plan, Problems& problems) {
  std::vector<NamedShard> fitting;
  for (NamedShard& s : shards) {
    if (!s.shard) {
      problems.add(s.shard.error().code, s.shard.error().message);
    } else if (const Status status = checkShard(*s.shard, plan); !status) {
      problems.add(status.error().code, s.name + ": " + status.error().message);
    } else {
      fitting.push_back(std::move(s));
    }
  }
  std::stable_sort(fitting.begin(), fitting.end(), [](const NamedShard& a, const NamedShard& b) {
    return std::pair(a.shard->range.begin, a.shard->range.end) < std::pair(b.shard->range.begin, b.shard->range.end);
  });
  return fitting;
}

std::uint64_t sumAt(const StoredSums& sums, std::size_t i) {
  return sums.sum[2 * i] | std::uint64_t{sums.sum[2 * i + 1]} << 32;
}

Result<Bake> mergeStages(BakePlan plan, std::vector<NamedShard> given, Context& context) {
  if (const Status status = checkPlanVersion(plan); !status) return status.error();
  Problems problems;
  std::vector<NamedShard> shards = takeFitting(std::move(given), plan, problems);
  checkCoverage(shards, plan.bake.caches.count(), problems);
  if (problems.any()) return problems.error();

  Bake bake = std::move(plan.bake);
  const Status joined = runStage(context, "links", [&]() -> Status {
    std::uint64_t links = 0;
    for (const NamedShard& s : shards) links += s.shard->links.count();
    if (const Status status = checkLinkCount(links); !status) return status;
    RowJoiner joiner(bake.links.kind, bake.links.bands, links, bake.caches.count());
    PullSums sums(bake.hierarchy, plan.options.links.pull);
    for (NamedShard& s : shards) {
      if (context.cancelled()) return cancelledError();
      if (s.shard->range.count() > 0) joiner.append(s.shard->links);
      for (std::size_t i = 0; i < s.shard->all.node.size(); ++i)
        sums.addAll(s.shard->all.node[i], sumAt(s.shard->all, i));
      for (std::size_t i = 0; i < s.shard->cut.node.size(); ++i)
        sums.addCut(s.shard->cut.node[i], sumAt(s.shard->cut, i));
      s.shard->links = {};
    }
    bake.links = joiner.finish();
    bake.hierarchy.firstWeight = sums.weights(bake.hierarchy);
    context.figure("links", bake.links.count());
    warnOfManyLinks(bake.links, plan.chosen.links, context);
    return done();
  });
  if (!joined) return joined.error();
  if (const Status status = checkBaked(bake, context); !status)
    return Error{ErrorCode::invalidFile, "the shards make no valid bake: " + status.error().message};
  auto certificate = certifyBaked(bake, plan.test, context);
  if (!certificate) return certificate.error();
  bake.certificate = std::move(*certificate);
  return bake;
}

}  // namespace

Result<Bake> mergeShards(BakePlan plan, std::vector<NamedShard> shards, Context& context) {
  try {
    return mergeStages(std::move(plan), std::move(shards), context);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "out of memory while merging shards"};
  }
}

}  // namespace relume
