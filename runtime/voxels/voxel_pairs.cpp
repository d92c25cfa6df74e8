// SPDX-License-Identifier: MIT
// See voxel_pairs.h.
#include "runtime/voxels/voxel_pairs.h"

#include "runtime/shared/chunks.h"
#include "runtime/voxels/overlap.h"

#include <algorithm>
#include <cstddef>

namespace relume {
namespace {

constexpr std::uint32_t kTrianglesOfChunk = 4096;  // of a chunk

struct Numbered {
  std::uint32_t voxel = 0;
  VoxelPair pair;
};

// Whether a triangle lies on faces between voxels: it overlaps those on both sides, and has its area on one.
bool isOnFaces(const SnappedTriangle& t) {
  for (std::size_t k = 0; k < 3; ++k) {
    const int at = t.corner[0][k];
    if (at % kVoxelSteps == 0 && t.corner[1][k] == at && t.corner[2][k] == at) return true;
  }
  return false;
}

struct Part {
  glm::ivec3 voxel;
  std::uint32_t covered;
};

// Voxels by number, and the layers of cells that they lie in.
class VoxelRange {
 public:
  VoxelRange(const VolumeGrid& grid, const VoxelLayer& layer, std::uint32_t first, std::uint32_t end)
      : first_(first), end_(end) {
    if (first == end) return;
    low_ = kBrickSide * kVoxelSteps * grid.cellAt(layer.cellOfNumber(first)).z;
    high_ = kBrickSide * kVoxelSteps * (grid.cellAt(layer.cellOfNumber(end - 1)).z + 1);
  }
  bool has(std::uint32_t number) const { return number >= first_ && number < end_; }
  // Whether a triangle may overlap one of them: those that it touches are overlapped.
  bool mayMeet(const SnappedTriangle& t) const {
    const auto [low, high] = std::minmax({t.corner[0][2], t.corner[1][2], t.corner[2][2]});
    return low <= high_ && high >= low_;
  }

 private:
  std::uint32_t first_, end_;
  int low_ = 0, high_ = -1;  // [1/64 voxel]
};

// The pairs of one triangle. `parts`: memory that is used again.
void addPairs(const VolumeGrid& grid, const SnappedTriangle& triangle, std::uint32_t index, const VoxelLayer& layer,
              const VoxelRange& range, std::vector<Part>& parts, std::vector<Numbered>& pairs) {
  parts.clear();
  std::uint32_t sum = 0;
  const TriangleOverlap overlap(triangle);
  const auto add = [&](const glm::ivec3& v) {
    parts.push_back({v, overlap.covered(v)});
    sum += parts.back().covered;
  };
  if (grid.roams) {
    overlap.visitAll(add);
  } else {
    overlap.visit(grid, add);
  }
  const bool onFaces = isOnFaces(triangle);
  // Small triangles slip between the places: they give all their voxels the same.
  const auto count = static_cast<std::uint32_t>(parts.size());
  for (const Part& part : parts) {
    if (grid.roams && !grid.holds(part.voxel)) continue;
    const std::uint32_t number = layer.numberOf(grid, part.voxel);
    if (!range.has(number) || !layer.has(grid, part.voxel)) continue;
    const std::uint64_t share =
        std::uint64_t{16} * triangle.area * (sum > 0 ? part.covered : 1) / (sum > 0 ? sum : count);
    Numbered& added = pairs.emplace_back();
    added.voxel = number;
    added.pair.triangle = index;
    added.pair.share = static_cast<std::uint32_t>(std::max<std::uint64_t>(share, 1)) & 0x7FFFFFFFu;
    added.pair.touches = onFaces && sum > 0 && part.covered == 0 ? 1 : 0;
  }
}

}  // namespace

VoxelPairs findPairs(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, std::uint32_t first,
                     std::uint32_t end, const ParallelFor& parallelFor, const VoxelLayer& layer) {
  const VoxelRange range(grid, layer, first, end);
  const auto count = static_cast<std::uint32_t>(triangles.size());
  std::vector<std::vector<Numbered>> chunks((count + kTrianglesOfChunk - 1) / kTrianglesOfChunk);
  forChunks(parallelFor, count, kTrianglesOfChunk, [&](std::uint32_t from, std::uint32_t to) {
    std::vector<Numbered>& pairs = chunks[from / kTrianglesOfChunk];
    pairs.reserve(2 * std::size_t{to - from});
    std::vector<Part> parts;
    for (std::uint32_t t = from; t < to; ++t) {
      if (range.mayMeet(triangles[t])) addPairs(grid, triangles[t], t, layer, range, parts, pairs);
    }
  });

  // By voxel, in the order of the triangles
  VoxelPairs pairs;
  pairs.first = first;
  pairs.begin.assign(std::size_t{end - first} + 1, 0);
  std::size_t all = 0;
  for (const std::vector<Numbered>& chunk : chunks) {
    all += chunk.size();
    for (const Numbered& each : chunk) ++pairs.begin[each.voxel - first];
  }
  std::uint32_t next = 0;
  for (std::uint32_t& begin : pairs.begin) {
    const std::uint32_t size = begin;
    begin = next;
    next += size;
  }
  pairs.pair.resize(all);
  for (std::vector<Numbered>& chunk : chunks) {
    for (const Numbered& each : chunk) pairs.pair[pairs.begin[each.voxel - first]++] = each.pair;
    chunk = {};
  }
  // Each has gone on to where the next one began.
  for (std::size_t v = pairs.begin.size() - 1; v > 0; --v) pairs.begin[v] = pairs.begin[v - 1];
  pairs.begin[0] = 0;
  return pairs;
}

}  // namespace relume
