// SPDX-License-Identifier: MIT
// See cell_texels.h.
#include "runtime/live/cell_texels.h"

#include <glm/common.hpp>

namespace relume {

std::vector<glm::uvec4> cellTexels(const CellSet& cells) {
  std::vector<glm::uvec4> texels;
  texels.reserve(cells.standing.size());
  for (std::size_t c = 0; c < cells.standing.size(); ++c) {
    const std::uint64_t bits = cells.standing[c];
    std::uint32_t cache = kInactive;
    if (const std::uint32_t slot = cells.slot[c]; slot != kInactive)
      cache = 64 * slot + brickBit(glm::ivec3(glm::floor(cells.position[slot])));
    texels.emplace_back(static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32), cells.first[c],
                        cache);
  }
  return texels;
}

}  // namespace relume
