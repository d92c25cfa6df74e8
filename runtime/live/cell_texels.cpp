// SPDX-License-Identifier: MIT
// See cell_texels.h.
#include "runtime/live/cell_texels.h"

#include <bit>

namespace relume {

std::vector<glm::uvec4> cellTexels(const CellSet& cells) {
  std::vector<glm::uvec4> texels;
  if (cells.standing == nullptr) return texels;
  const SubVoxels& subVoxels = cells.standing->subVoxels;
  texels.reserve(subVoxels.bits.size());
  for (std::size_t c = 0; c < subVoxels.bits.size(); ++c) {
    std::uint32_t cache = kInactive;
    if (const std::uint32_t slot = cells.slot[c]; slot != kInactive) cache = 64 * slot + cells.place[slot];
    texels.emplace_back(wordsOf(subVoxels.bits[c]), subVoxels.first[c], cache);
  }
  return texels;
}

std::vector<glm::uvec4> subVoxelTexels(const CellSet& cells) {
  std::vector<glm::uvec4> texels;
  if (cells.standing == nullptr) return texels;
  const SubVoxels& subVoxels = cells.standing->subVoxels;
  texels.reserve(subVoxels.of.size());
  for (std::uint32_t c = 0; c < subVoxels.bits.size(); ++c) {
    for (std::uint64_t rest = subVoxels.bits[c]; rest != 0; rest &= rest - 1) {
      const glm::ivec3 v = kBrickSide * cells.grid.cellAt(c) + voxelOfBit(std::countr_zero(rest));
      const auto plane = std::bit_cast<std::uint32_t>(cells.planeAt(v));
      texels.emplace_back(wordsOf(subVoxels.of[texels.size()]), plane, 0);
    }
  }
  return texels;
}

}  // namespace relume
