// SPDX-License-Identifier: MIT
// The links as light_caches.comp reads them, cut into batches that one binding of their buffers covers: devices limit
// the size of a binding, not of a buffer. Repacked links (runtime/shared/link_set.h) are four to a unit, rows padded
// with links that carry nothing: a "link" is then such a unit.
#pragma once

#include "relume/bake_data.h"
#include "relume/result.h"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::gpu {

struct LinkBatch {
  std::uint32_t firstCache = 0, endCache = 0;
  std::uint32_t firstLink = 0;
  std::size_t linkStart = 0, shapeStart = 0;  // [byte] aligned start of the bindings
  std::size_t linkBytes = 0, shapeBytes = 0;
  std::uint32_t wordOffset = 0, halfOffset = 0;  // where the batch's first link begins within them
};

struct LinkArrays {
  explicit LinkArrays(std::pmr::memory_resource* memory)
      : batches(memory), repackedRows(memory), repackedWords(memory), transfers(memory) {}

  std::pmr::vector<LinkBatch> batches;
  // RELUME_SLOT_ROWS, RELUME_SLOT_LINKS, RELUME_SLOT_LINK_SHAPE: of the bake's arrays, or of those below.
  std::span<const std::byte> rows, links, shape;
  int nodeSteps = -1;  // repacked links: indices per row where nodes step; -1 = links as they are baked

  std::pmr::vector<std::uint32_t> repackedRows, repackedWords;
  std::pmr::vector<std::uint32_t> transfers;  // [Size units]
};

// limit [byte]: of a binding; alignment [byte]: of where it begins. No batch has caches before and from firstMapCache
// on. unsupported: a row of more than the limit. `links` must outlive what comes back.
Result<LinkArrays> packLinks(const Links& links, std::uint32_t firstMapCache, std::size_t limit, std::size_t alignment,
                             std::pmr::memory_resource* memory);

}  // namespace relume::gpu
