// SPDX-License-Identifier: MIT
// See cell_changes.h.
#include "runtime/live/cell_changes.h"

#include "runtime/shared/chunks.h"

#include <algorithm>

namespace relume {
namespace {

constexpr std::uint32_t kCellsDigested = 1024;  // of a chunk

// Numbers, in their order, in one.
class Digest {
 public:
  void add(std::uint64_t value) {
    sum_ = (sum_ ^ value) * 0x9E3779B97F4A7C15u;
    sum_ ^= sum_ >> 29;
  }
  std::uint64_t sum() const { return sum_; }

 private:
  std::uint64_t sum_ = 0;
};

}  // namespace

void addContent(const VoxelLayer& layer, const ParallelFor& parallelFor, std::span<std::uint64_t> content) {
  forChunks(parallelFor, static_cast<std::uint32_t>(content.size()), kCellsDigested,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t c = begin; c < end; ++c) {
                std::uint64_t rest = layer.subVoxels.bits[c];
                if (layer.bits[c] == 0 && rest == 0) continue;
                Digest digest;
                digest.add(content[c]);
                digest.add(layer.bits[c]);
                for (std::uint32_t v = layer.first[c]; v < layer.first[c] + layer.keptOf(c); ++v) {
                  const glm::u8vec3 axis(layer.axis[v]);
                  digest.add(std::uint64_t{axis.x} << 16 | std::uint64_t{axis.y} << 8 | axis.z);
                }
                layer.sides.forWords(c, [&](std::uint64_t word) { digest.add(word); });
                digest.add(rest);
                for (std::uint32_t s = layer.subVoxels.first[c]; rest != 0; rest &= rest - 1, ++s)
                  digest.add(layer.subVoxels.of[s]);
                content[c] = digest.sum();
              }
            });
}

namespace {

// The least of each number and of its neighbours' along an axis, one more for each cell on the way.
void spread(const VolumeGrid& grid, int axis, std::vector<std::uint8_t>& distance) {
  const std::uint32_t stride = axis == 0 ? 1 : grid.cellIndex(axis == 1 ? glm::ivec3(0, 1, 0) : glm::ivec3(0, 0, 1));
  const std::vector<std::uint8_t> from = distance;
  for (std::uint32_t c = 0; c < from.size(); ++c) {
    const int at = grid.cellAt(c)[axis], last = grid.cells[axis] - 1;
    int least = from[c];
    for (int d = 1; d < least; ++d) {
      // Cells at a distance are reached by the farther of the ways along the axes.
      const auto step = static_cast<std::uint32_t>(d) * stride;
      if (at - d >= 0) least = std::min(least, std::max<int>(from[c - step], d));
      if (at + d <= last) least = std::min(least, std::max<int>(from[c + step], d));
    }
    distance[c] = static_cast<std::uint8_t>(least);
  }
}

}  // namespace

CellChanges changesSince(const VolumeGrid& before, std::span<const std::uint64_t> contentBefore, const VolumeGrid& grid,
                         std::span<const std::uint64_t> content) {
  CellChanges changes;
  changes.by = grid.shift - before.shift;
  constexpr std::uint8_t kFar = kFarthestChange + 1;
  changes.distance.assign(grid.cellCount(), kFar);
  bool isAny = false;
  for (std::uint32_t c = 0; c < changes.distance.size(); ++c) {
    const glm::ivec3 was = grid.cellAt(c) + changes.by;
    if (before.holdsCell(was) && contentBefore[before.cellIndex(was)] == content[c]) continue;
    changes.distance[c] = 0;
    isAny = true;
  }
  for (int axis = 0; axis < 3 && isAny; ++axis) spread(grid, axis, changes.distance);
  return changes;
}

bool CellChanges::seesTheSame(const VolumeGrid& grid, const glm::ivec3& cell, int reach) const {
  if (distance[grid.cellIndex(cell)] <= reach) return false;
  // Rays end at faces of the grid, which have moved as well.
  for (int k = 0; k < 3; ++k) {
    if (by[k] == 0) continue;
    const int low = std::min(cell[k], cell[k] + by[k]) - reach, high = std::max(cell[k], cell[k] + by[k]) + reach;
    if (low < 0 || high >= grid.cells[k]) return false;
  }
  return true;
}

}  // namespace relume
