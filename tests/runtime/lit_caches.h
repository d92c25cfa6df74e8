// SPDX-License-Identifier: MIT
// The coefficients that a kernel of runtime/cpu/light_caches.h finds, as floats.
#pragma once

#include "runtime/cpu/light_caches.h"

#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::test {

// [Size n_C * bands.stride()] Caches from firstMapCache on are those of a light map.
inline std::vector<float> litCaches(cpu::LightCachesKernel kernel, const Links& links,
                                    std::span<const std::uint32_t> nodes, const CacheBands& bands,
                                    const ParallelFor& parallelFor = {},
                                    std::uint32_t firstMapCache = std::numeric_limits<std::uint32_t>::max()) {
  std::pmr::memory_resource* memory = std::pmr::new_delete_resource();
  StoredLight light(bands, links.cacheCount(), firstMapCache, memory);
  cpu::lightCaches(kernel, LinkSet(links, memory), nodes, light, parallelFor);
  std::vector<float> all(links.cacheCount() * bands.stride());
  for (std::uint32_t cache = 0; cache < links.cacheCount(); ++cache) light.read(cache, &all[cache * bands.stride()]);
  return all;
}

}  // namespace relume::test
