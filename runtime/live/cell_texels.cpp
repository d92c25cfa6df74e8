// SPDX-License-Identifier: MIT
// See cell_texels.h.
#include "runtime/live/cell_texels.h"

namespace relume {

std::vector<glm::uvec4> cellTexels(const CellSet& cells) {
  std::vector<glm::uvec4> texels;
  if (cells.standing == nullptr) return texels;
  const VoxelLayer& standing = *cells.standing;
  texels.reserve(standing.bits.size());
  for (std::size_t c = 0; c < standing.bits.size(); ++c) {
    const std::uint64_t bits = standing.bits[c];
    std::uint32_t cache = kInactive;
    if (const std::uint32_t slot = cells.slot[c]; slot != kInactive) cache = 64 * slot + cells.place[slot];
    texels.emplace_back(static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32), standing.first[c],
                        cache);
  }
  return texels;
}

std::vector<std::array<std::int8_t, 4>> cellPlanes(const CellSet& cells) {
  if (cells.standing == nullptr) return {};
  std::vector<std::array<std::int8_t, 4>> planes(cells.standing->occupied);
  for (std::uint32_t v = 0; v < cells.standing->kept; ++v) planes[v] = cells.planeOf(v);
  return planes;
}

}  // namespace relume
