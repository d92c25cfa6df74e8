// SPDX-License-Identifier: MIT
// See pack_links.h.
#include "runtime/passes/pack_links.h"

#include "formats/compact_links.h"
#include "runtime/shared/link_set.h"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

namespace relume::gpu {
namespace {

constexpr std::size_t kSmallestRange = 16;  // [byte] of a binding

// Bytes of a link in LinkArrays::shape.
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
// of a link in LinkArrays::links and shape. No batch has caches before and from `cut` on.
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
                                               std::to_string(limit) + " bytes this device binds at once"};
    }
    batch.endCache = cache;
    const std::size_t first = batch.firstLink, count = rowBegin[cache] - first;
    const auto alignDown = [alignment](std::size_t byte) { return byte / alignment * alignment; };
    const std::size_t linkStart = alignDown(first * linkBytes), shapeStart = alignDown(first * shape);
    batch.linkStart = linkStart;
    batch.wordOffset = static_cast<std::uint32_t>((first * linkBytes - linkStart) / 4);
    batch.linkBytes = std::max(first * linkBytes + count * linkBytes - linkStart, kSmallestRange);
    batch.shapeStart = shapeStart;
    batch.halfOffset = static_cast<std::uint32_t>((first * shape - shapeStart) / 2);
    // Whole words: the last half may share its word with padding.
    const std::size_t shapeEnd = (first + count) * shape;
    batch.shapeBytes = std::max((shapeEnd - shapeStart + 3) / 4 * 4, kSmallestRange);
    // Caches without links keep the zeros their buffer began with.
    if (count > 0) batches.push_back(batch);
  }
  return batches;
}

// Pack links again where they can be; returns the rows in units of four links [Size caches + 1], or nothing.
std::pmr::vector<std::uint32_t> packFourfold(const Links& links, LinkArrays& out, std::pmr::memory_resource* memory) {
  std::pmr::vector<std::uint32_t> rowBegin(memory);
  if (links.kind != LinkKind::oct6) return rowBegin;
  const LinkSet set(links, memory);
  const LinkRows rows = set.rows();
  if (rows.kind != kRepackedLinks) return rowBegin;
  // The GPU is given the links at which nodes grow, not how far apart they are.
  std::uint32_t steps = 0;
  for (std::uint32_t i = 0; i < links.count(); ++i) steps = std::max(steps, links.node(i) >> 16);
  out.nodeSteps = static_cast<int>(steps);
  rowBegin.push_back(0);
  for (std::uint32_t cache = 0; cache < links.cacheCount(); ++cache) {
    const std::uint32_t begin = links.rowBegin[cache], end = links.rowBegin[cache + 1];
    out.repackedRows.push_back(rowBegin.back());
    std::uint32_t step = 0;
    const auto addStep = [&](std::uint32_t link) {
      // Two to a word.
      if (step++ % 2 == 0) {
        out.repackedRows.push_back(link | link << 16);
      } else {
        out.repackedRows.back() = (out.repackedRows.back() & 0xFFFFu) | link << 16;
      }
    };
    for (std::uint32_t i = begin; i < end; ++i) {
      while (step < links.node(i) >> 16) addStep(i - begin);
    }
    while (step < steps) addStep(0xFFFFu);
    out.repackedWords.insert(out.repackedWords.end(), rows.word + begin, rows.word + end);
    out.repackedWords.resize((out.repackedWords.size() + 3) / 4 * 4, 0);
    for (std::uint32_t i = begin; i < end; ++i) {
      if ((i - begin) % 4 == 0) out.transfers.push_back(0);
      out.transfers.back() |= std::uint32_t{rows.transfer[i]} << (8 * ((i - begin) % 4));
    }
    rowBegin.push_back(static_cast<std::uint32_t>(out.transfers.size()));
  }
  out.repackedRows.push_back(rowBegin.back());
  return rowBegin;
}

}  // namespace

Result<LinkArrays> packLinks(const Links& links, std::uint32_t firstMapCache, std::size_t limit, std::size_t alignment,
                             std::pmr::memory_resource* memory) {
  LinkArrays out(memory);
  const std::pmr::vector<std::uint32_t> fourfold = packFourfold(links, out, memory);
  const bool repacked = !fourfold.empty();
  const std::size_t linkBytes = repacked ? 16 : links.kind == LinkKind::cone ? sizeof(ConeLink) : sizeof(std::uint32_t);
  Result<std::pmr::vector<LinkBatch>> batches =
      makeBatches(repacked ? std::span<const std::uint32_t>(fourfold) : links.rowBegin.span(), firstMapCache, linkBytes,
                  repacked ? 4 : shapeBytes(links), limit, alignment, memory);
  if (!batches) return batches.error();
  out.batches = std::move(*batches);
  const auto bytes = [](const auto& array) { return std::as_bytes(std::span(array.data(), array.size())); };
  if (repacked) {
    out.rows = bytes(out.repackedRows);
    out.links = bytes(out.repackedWords);
    out.shape = bytes(out.transfers);
    return out;
  }
  out.rows = bytes(links.rowBegin);
  if (links.kind == LinkKind::cone) {
    out.links = bytes(links.cone);
  } else if (links.kind == LinkKind::sh) {
    out.links = bytes(links.shNode);
    out.shape = bytes(links.shCoefficients);
  } else {
    out.links = bytes(links.head);
    out.shape = bytes(links.shape);
  }
  return out;
}

}  // namespace relume::gpu
