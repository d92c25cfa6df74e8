// SPDX-License-Identifier: MIT
// See upload_links.h.
#include "runtime/gl/upload_links.h"

#include "formats/compact_links.h"
#include "runtime/shared/link_set.h"

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace relume::gl {
namespace {

// Bytes of a link in GpuBake::linkShape.
std::size_t shapeBytes(const Links& links) {
  switch (links.kind) {
    case LinkKind::sh:
      return 2 * std::size_t{links.bands} * links.bands;
    case LinkKind::cone:
      return 0;
    case LinkKind::oct6:
      return 2;
    default:
      return 4;
  }
}

// Cut the rows into batches whose bindings stay below `limit` bytes, starts aligned to `alignment`. linkBytes, shape:
// of a link in GpuBake::links and linkShape. No batch has caches before and from `cut` on.
Result<std::pmr::vector<LinkBatch>> makeBatches(std::span<const std::uint32_t> rowBegin, std::uint32_t cut,
                                                std::size_t linkBytes, std::size_t shape, std::size_t limit,
                                                std::size_t alignment, std::pmr::memory_resource* memory) {
  const auto caches = static_cast<std::uint32_t>(rowBegin.empty() ? 0 : rowBegin.size() - 1);
  const std::size_t max = (limit - std::min(limit, alignment)) / std::max(linkBytes, shape);
  std::pmr::vector<LinkBatch> batches(memory);
  for (std::uint32_t cache = 0; cache < caches;) {
    LinkBatch batch;
    batch.firstCache = cache;
    batch.firstLink = rowBegin[cache];
    const std::uint32_t end = cache < cut ? std::min(cut, caches) : caches;
    while (cache < end && rowBegin[cache + 1] - batch.firstLink <= max) ++cache;
    if (cache == batch.firstCache) {
      return Error{ErrorCode::unsupported, "the links of cache " + std::to_string(cache) + " exceed the " +
                                               std::to_string(limit) + " bytes this OpenGL binds at once"};
    }
    batch.endCache = cache;
    const std::size_t first = batch.firstLink, count = rowBegin[cache] - first;
    const auto alignDown = [alignment](std::size_t byte) { return byte / alignment * alignment; };
    const std::size_t linkStart = alignDown(first * linkBytes), shapeStart = alignDown(first * shape);
    batch.linkStart = static_cast<GLintptr>(linkStart);
    batch.wordOffset = static_cast<GLuint>((first * linkBytes - linkStart) / 4);
    batch.linkBytes =
        static_cast<GLsizeiptr>(std::max(first * linkBytes + count * linkBytes - linkStart, kSmallestBuffer));
    batch.shapeStart = static_cast<GLintptr>(shapeStart);
    batch.halfOffset = static_cast<GLuint>((first * shape - shapeStart) / 2);
    // Whole words: the last half may share its word with padding.
    const std::size_t shapeEnd = (first + count) * shape;
    batch.shapeBytes = static_cast<GLsizeiptr>(std::max((shapeEnd - shapeStart + 3) / 4 * 4, kSmallestBuffer));
    // Caches without links keep the zeros their buffer began with.
    if (count > 0) batches.push_back(batch);
  }
  return batches;
}

// The arrays of links packed again, in GpuBake's layout.
struct FourfoldLinks {
  explicit FourfoldLinks(std::pmr::memory_resource* memory)
      : rowBegin(memory), rows(memory), words(memory), transfers(memory) {}

  std::pmr::vector<std::uint32_t> rowBegin;   // [Size caches + 1] in units of four links
  std::pmr::vector<std::uint32_t> rows;       // RELUME_SLOT_ROWS
  std::pmr::vector<std::uint32_t> words;      // [Size 4 units]
  std::pmr::vector<std::uint32_t> transfers;  // [Size units]
  int nodeSteps = 0;
};

// Nothing when the links cannot be packed again.
std::optional<FourfoldLinks> makeFourfold(const Links& links, std::pmr::memory_resource* memory) {
  if (links.kind != LinkKind::oct6) return std::nullopt;
  const LinkSet set(links, memory);
  const LinkRows rows = set.rows();
  if (rows.kind != kRepackedLinks) return std::nullopt;
  FourfoldLinks out(memory);
  out.nodeSteps = static_cast<int>(rows.nodeSteps);
  out.rowBegin.push_back(0);
  for (std::uint32_t cache = 0; cache < links.cacheCount(); ++cache) {
    const std::uint32_t begin = links.rowBegin[cache], end = links.rowBegin[cache + 1];
    out.rows.push_back(out.rowBegin.back());
    for (std::uint32_t k = 0; k < rows.nodeSteps; k += 2) {
      const std::uint16_t* step = rows.nodeStep + std::size_t{rows.nodeSteps} * cache + k;
      out.rows.push_back(std::uint32_t{step[0]} | std::uint32_t{k + 1 < rows.nodeSteps ? step[1] : step[0]} << 16);
    }
    out.words.insert(out.words.end(), rows.word + begin, rows.word + end);
    out.words.resize((out.words.size() + 3) / 4 * 4, 0);
    for (std::uint32_t i = begin; i < end; ++i) {
      if ((i - begin) % 4 == 0) out.transfers.push_back(0);
      out.transfers.back() |= std::uint32_t{rows.transfer[i]} << (8 * ((i - begin) % 4));
    }
    out.rowBegin.push_back(static_cast<std::uint32_t>(out.transfers.size()));
  }
  out.rows.push_back(out.rowBegin.back());
  return out;
}

}  // namespace

Status makeLinks(const Functions& gl, const Links& links, std::size_t limit, std::size_t alignment, GpuBake& gpu,
                 std::pmr::memory_resource* memory) {
  const std::optional<FourfoldLinks> fourfold = makeFourfold(links, memory);
  const std::size_t linkBytes = fourfold ? 16 : links.kind == LinkKind::cone ? sizeof(ConeLink) : sizeof(std::uint32_t);
  Result<std::pmr::vector<LinkBatch>> batches =
      makeBatches(fourfold ? std::span<const std::uint32_t>(fourfold->rowBegin) : links.rowBegin.span(),
                  gpu.firstMapCache, linkBytes, fourfold ? 4 : shapeBytes(links), limit, alignment, memory);
  if (!batches) return batches.error();
  gpu.batches = std::move(*batches);
  if (fourfold) {
    gpu.nodeSteps = fourfold->nodeSteps;
    gpu.rows = makeArray<std::uint32_t>(gl, fourfold->rows);
    gpu.links = makeArray<std::uint32_t>(gl, fourfold->words);
    gpu.linkShape = makeArray<std::uint32_t>(gl, fourfold->transfers);
    return done();
  }
  gpu.rows = makeArray<std::uint32_t>(gl, links.rowBegin);
  if (links.kind == LinkKind::cone) {
    gpu.links = makeArray<ConeLink>(gl, links.cone);
    gpu.linkShape = makeBuffer(gl, nullptr, 0, GL_STATIC_DRAW);
  } else if (links.kind == LinkKind::sh) {
    gpu.links = makeArray<std::uint32_t>(gl, links.shNode);
    gpu.linkShape = makeArray<std::uint16_t>(gl, links.shCoefficients);
  } else {
    gpu.links = makeArray<std::uint32_t>(gl, links.head);
    gpu.linkShape = makeArray<std::uint32_t>(gl, links.shape);
  }
  return done();
}

}  // namespace relume::gl
