// SPDX-License-Identifier: MIT
// What the passes read of the light map and of the grid's texture, as arrays.
#pragma once

#include "relume/bake_data.h"
#include "runtime/shared/bands.h"
#include "runtime/shared/grid_texture.h"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume::gpu {

// Words of four halves that a channel's coefficients take: in the caches' buffer, padded, and as layers of the light
// map.
inline int wordsOf(int bands) { return (bands * bands + 3) / 4; }
// Bytes of one cache's coefficients in their buffer.
inline std::size_t cacheBytes(const CacheBands& bands) {
  return 8 * static_cast<std::size_t>(wordsOf(bands.lumaBands) + 2 * wordsOf(bands.chromaBands));
}

// Normal of each texel's cache as signed bytes, w = 1; zeros where there is none. One texel without a light map.
std::pmr::vector<std::int8_t> packNormals(const Caches& caches, std::pmr::memory_resource* memory);
// RELUME_SLOT_MAP_TEXELS. firstMapCache: Caches::firstMapCache().
std::pmr::vector<std::uint32_t> listTexels(const Caches& caches, std::uint32_t firstMapCache,
                                           std::pmr::memory_resource* memory);
// RELUME_SLOT_TEXELS without light: surfels leave out texels that hold no cache.
std::pmr::vector<std::uint32_t> darkTexels(const Lightmap& map, std::pmr::memory_resource* memory);
// RELUME_SLOT_SHARES and RELUME_SLOT_FACTORS, of bands 2 and up, four coefficients a vector.
std::pmr::vector<std::uint32_t> packShares(const GridTexture& texture, std::pmr::memory_resource* memory);
std::pmr::vector<float> packFactors(int bands, std::pmr::memory_resource* memory);

}  // namespace relume::gpu
