// SPDX-License-Identifier: MIT
// A shard as a file (formats/README.md), and whether it fits a plan.
#include "bake/base/read_json.h"
#include "bake/shards/shard.h"
#include "formats/chunk_arrays.h"
#include "formats/compact_links.h"
#include "formats/file_io.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <new>
#include <string>
#include <utility>

namespace relume {
namespace {

// scalars: plan (low, high), number, count, begin, end, link kind, bands.
constexpr std::size_t kScalarWords = 8;
constexpr std::uint64_t kSumWords = 2;

struct ShardArrays {
  std::array<std::uint32_t, kScalarWords> scalars{};
  std::vector<std::byte> provenance;
};

std::uint64_t coefficientsOf(std::uint32_t bands) { return std::max<std::uint64_t>(1, std::uint64_t{bands} * bands); }

Result<std::vector<Chunk>> chunksOf(const Shard& shard, ShardArrays& arrays) {
  Result<std::vector<std::byte>> provenance = saveArchive(shard.provenance);
  if (!provenance) return provenance.error();
  arrays.provenance = std::move(*provenance);
  const Links& links = shard.links;
  arrays.scalars = {static_cast<std::uint32_t>(shard.plan),
                    static_cast<std::uint32_t>(shard.plan >> 32),
                    shard.number.number,
                    shard.number.count,
                    shard.range.begin,
                    shard.range.end,
                    static_cast<std::uint32_t>(links.kind),
                    links.bands};
  return std::vector<Chunk>{chunkOf<std::uint32_t>("scalars", arrays.scalars),
                            chunkOf<std::uint32_t>("link.row", links.rowBegin),
                            chunkOf<std::uint32_t>("link.node", links.shNode),
                            chunkOf<std::uint16_t>("link.sh", links.shCoefficients, coefficientsOf(links.bands)),
                            chunkOf<ConeLink>("link.cone", links.cone),
                            chunkOf<std::uint32_t>("link.head", links.head),
                            chunkOf<std::uint32_t>("link.shape", links.shape),
                            chunkOf<std::uint32_t>("all.node", shard.all.node),
                            chunkOf<std::uint32_t>("all.sum", shard.all.sum, kSumWords),
                            chunkOf<std::uint32_t>("cut.node", shard.cut.node),
                            chunkOf<std::uint32_t>("cut.sum", shard.cut.sum, kSumWords),
                            archiveChunk("provenance", arrays.provenance)};
}

Error expectedFound(const std::string& what, std::uint64_t expected, std::uint64_t found) {
  return invalidFile(what + ": expected " + std::to_string(expected) + ", found " + std::to_string(found));
}

Result<Shard> assembleShard(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner) {
  const auto chunks = readChunks(bytes, std::pmr::new_delete_resource(), kShardFileType);
  if (!chunks) return chunks.error();
  if (const Status status = verifyChunks(*chunks); !status) return status.error();
  ChunkReader reader(*chunks);
  const auto scalars = reader.takeArray<std::uint32_t>("scalars", owner);
  if (!reader.failed() && (scalars.size() != kScalarWords || scalars[7] > 8))
    return invalidFile("chunk scalars: expected 8 numbers, the last of them from 0 to 8");
  const std::uint64_t coefficients = reader.failed() ? 1 : coefficientsOf(scalars[7]);
  Shard shard;
  shard.links.rowBegin = reader.takeArray<std::uint32_t>("link.row", owner);
  shard.links.shNode = reader.takeArray<std::uint32_t>("link.node", owner);
  shard.links.shCoefficients = reader.takeArray<std::uint16_t>("link.sh", owner, coefficients);
  shard.links.cone = reader.takeArray<ConeLink>("link.cone", owner);
  shard.links.head = reader.takeArray<std::uint32_t>("link.head", owner);
  shard.links.shape = reader.takeArray<std::uint32_t>("link.shape", owner);
  shard.all.node = reader.takeArray<std::uint32_t>("all.node", owner);
  shard.all.sum = reader.takeArray<std::uint32_t>("all.sum", owner, kSumWords);
  shard.cut.node = reader.takeArray<std::uint32_t>("cut.node", owner);
  shard.cut.sum = reader.takeArray<std::uint32_t>("cut.sum", owner, kSumWords);
  reader.takeArchive("provenance", shard.provenance);
  reader.finish();
  if (reader.failed()) return reader.error();
  shard.plan = scalars[0] | std::uint64_t{scalars[1]} << 32;
  shard.number = {scalars[2], scalars[3]};
  shard.range = {scalars[4], scalars[5]};
  shard.links.kind = static_cast<LinkKind>(scalars[6]);
  shard.links.bands = scalars[7];
  return shard;
}

// Which options differ: "links.raysPerCache 64, the plan has 128".
std::string otherOptions(const std::string& mine, const std::string& planned) {
  const Result<nlohmann::json> a = readJson(mine), b = readJson(planned);
  if (!a || !b) return "which cannot be read";
  std::string named;
  const nlohmann::json first = a->flatten(), second = b->flatten();
  for (const auto& [path, value] : second.items()) {
    const auto found = first.find(path);
    if (found != first.end() && *found == value) continue;
    std::string name = path.substr(1);
    std::replace(name.begin(), name.end(), '/', '.');
    named += (named.empty() ? "" : ", ") + name + " " + (found == first.end() ? "none" : found->dump()) +
             " where the plan has " + value.dump();
  }
  return named;
}

// What tells a shard's plan from another.
Status checkSamePlan(const Shard& shard, const BakePlan& plan) {
  if (shard.plan == plan.identity) return done();
  const Provenance &mine = shard.provenance, &its = plan.bake.provenance;
  const auto other = [](ErrorCode code, const std::string& what) {
    return Error{code, "of another plan: " + what + "; trace it again with this one"};
  };
  if (mine.algorithmVersion != its.algorithmVersion)
    return other(ErrorCode::unsupported, "of algorithm version " + std::to_string(mine.algorithmVersion) +
                                             ", the plan has " + std::to_string(its.algorithmVersion));
  if (mine.toolVersion != its.toolVersion)
    return other(ErrorCode::unsupported, "of version " + mine.toolVersion + ", the plan has " + its.toolVersion);
  if (mine.rayTracer != its.rayTracer)
    return other(ErrorCode::unsupported, "of ray tracer " + mine.rayTracer + ", the plan has " + its.rayTracer);
  if (mine.sceneHash != its.sceneHash || mine.viewHash != its.viewHash)
    return other(ErrorCode::invalidFile, "of another level");
  if (mine.optionsJson != its.optionsJson)
    return other(ErrorCode::invalidFile, "of other options, " + otherOptions(mine.optionsJson, its.optionsJson));
  return other(ErrorCode::invalidFile, "the same level and options, planned elsewhere to other numbers");
}

Status checkSums(const char* name, const StoredSums& sums, const BakePlan& plan) {
  const std::string chunk = std::string("chunk ") + name;
  if (sums.sum.size() != kSumWords * sums.node.size())
    return expectedFound(chunk + ".sum rows", sums.node.size(), sums.sum.size() / kSumWords);
  if (plan.options.links.pull == LinkOptions::PullWeight::area && !sums.node.empty())
    return expectedFound(chunk + ".node rows", 0, sums.node.size());
  for (std::size_t i = 0; i < sums.node.size(); ++i) {
    if (sums.node[i] >= plan.bake.hierarchy.nodeCount() || (i > 0 && sums.node[i] <= sums.node[i - 1]))
      return invalidFile(chunk + ".node[" + std::to_string(i) + "]: expected ascending nodes below " +
                         std::to_string(plan.bake.hierarchy.nodeCount()) + ", found " + std::to_string(sums.node[i]));
  }
  return done();
}

// Rows and arrays of links fit each other. That nodes are of the hierarchy is asked of the merged bake.
Status checkRows(const Shard& shard, const BakePlan& plan) {
  const Links& links = shard.links;
  if (links.kind != plan.bake.links.kind || links.bands != plan.bake.links.bands)
    return invalidFile("chunk scalars: links are not of the plan's kind");
  if (links.rowBegin.size() != std::size_t{shard.range.count()} + 1)
    return expectedFound("chunk link.row", std::size_t{shard.range.count()} + 1, links.rowBegin.size());
  for (std::size_t i = 0; i < links.rowBegin.size(); ++i) {
    if (i == 0 ? links.rowBegin[0] != 0 : links.rowBegin[i] < links.rowBegin[i - 1])
      return invalidFile("chunk link.row[" + std::to_string(i) + "]: expected to ascend from 0, found " +
                         std::to_string(links.rowBegin[i]));
  }
  const std::uint64_t count = links.count();
  const bool sh = links.kind == LinkKind::sh, cone = links.kind == LinkKind::cone, head = linkHasHead(links.kind);
  const auto normals = plan.bake.caches.normal.span().subspan(shard.range.begin, shard.range.count());
  const auto onSurface =
      std::find_if(normals.begin(), normals.end(), [](const glm::vec3& n) { return n != glm::vec3(0.0f); });
  const std::uint64_t gridLinks = links.rowBegin[static_cast<std::size_t>(onSurface - normals.begin())];
  const struct {
    const char* name;
    std::uint64_t expected, found;
  } arrays[] = {{"link.node", sh ? count : 0, links.shNode.size()},
                {"link.sh", sh ? count * links.bands * links.bands : 0, links.shCoefficients.size()},
                {"link.cone", cone ? count : 0, links.cone.size()},
                {"link.head", head ? count : 0, links.head.size()},
                {"link.shape", shapeWords(links.kind, count, gridLinks), links.shape.size()}};
  for (const auto& array : arrays) {
    if (array.found != array.expected)
      return expectedFound("chunk " + std::string(array.name) + " elements", array.expected, array.found);
  }
  return done();
}

}  // namespace

Status checkShard(const Shard& shard, const BakePlan& plan) {
  if (const Status status = checkSamePlan(shard, plan); !status) return status;
  const ShardNumber& number = shard.number;
  if (number.count < 1 || number.count > kMaxShards || number.number < 1 || number.number > number.count ||
      !(shard.range == rangeOf(number, plan.bake.caches.count())))
    return invalidFile("chunk scalars: expected the caches of a shard of the plan, found " + toString(number) +
                       " with caches " + std::to_string(shard.range.begin) + ".." + std::to_string(shard.range.end));
  if (const Status status = checkRows(shard, plan); !status) return status;
  if (const Status status = checkSums("all", shard.all, plan); !status) return status;
  return checkSums("cut", shard.cut, plan);
}

Status writeShard(const Shard& shard, const std::filesystem::path& path) {
  ShardArrays arrays;
  const Result<std::vector<Chunk>> chunks = chunksOf(shard, arrays);
  if (!chunks) return Error{chunks.error().code, path.string() + ": not written: " + chunks.error().message};
  return writeFileAtomically(
      path, [&](const ByteSink& sink) { return writeChunks(*chunks, sink, kShardFileType.version, kShardFileType); });
}

Result<std::vector<std::byte>> serializeShard(const Shard& shard) {
  ShardArrays arrays;
  const Result<std::vector<Chunk>> chunks = chunksOf(shard, arrays);
  if (!chunks) return chunks.error();
  return joinChunks(*chunks, kShardFileType.version, kShardFileType);
}

Result<Shard> parseShard(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % 8 != 0)
    return Error{ErrorCode::usage, "the memory of a shard must be aligned to 8 bytes"};
  try {
    return assembleShard(bytes, owner);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "out of memory"};
  }
}

Result<Shard> readShard(const std::filesystem::path& path) {
  const Result<FileBytes> file = readFile(path);
  if (!file) return file.error();
  Result<Shard> shard = parseShard(file->bytes, file->owner);
  if (!shard) return Error{shard.error().code, path.string() + ": " + shard.error().message};
  return shard;
}

}  // namespace relume
