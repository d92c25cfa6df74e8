// SPDX-License-Identifier: MIT
// See sub_voxels.h.
#include "runtime/voxels/sub_voxels.h"

#include "runtime/shared/chunks.h"
#include "runtime/voxels/overlap.h"

#include <algorithm>
#include <array>
#include <bit>

namespace relume {
namespace {

constexpr std::uint32_t kTrianglesAtOnce = 2048;

// What a chunk of triangles overlaps.
class FoundSubVoxels {
 public:
  struct Found {
    std::uint32_t cell = 0, voxel = 0;  // brickBit()
    std::uint64_t subVoxels = 0;
  };

  // Triangles beside each other share voxels: what has come of late is added to before it is kept.
  void add(std::uint32_t cell, std::uint32_t voxel, std::uint64_t subVoxels) {
    Found& recent = recent_[(7 * cell + voxel) % recent_.size()];
    if (recent.cell != cell || recent.voxel != voxel) {
      keep(recent);
      recent = {cell, voxel, 0};
    }
    recent.subVoxels |= subVoxels;
  }
  std::vector<Found> finish() {
    for (const Found& recent : recent_) keep(recent);
    return std::move(all_);
  }

 private:
  void keep(const Found& found) {
    if (found.subVoxels != 0) all_.push_back(found);
  }

  std::array<Found, 64> recent_{};
  std::vector<Found> all_;
};

// Number what `bits` has; none has sub-voxels as yet.
void number(SubVoxels& all) { all.of.assign(numberBits(all.bits, all.first), 0); }

// Of the voxel of this bit.
std::uint32_t numberOf(const SubVoxels& all, std::size_t cell, std::uint64_t bit) {
  return all.first[cell] + static_cast<std::uint32_t>(std::popcount(all.bits[cell] & (bit - 1)));
}

}  // namespace

SubVoxels findSubVoxels(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles,
                        const ParallelFor& parallelFor) {
  const auto count = static_cast<std::uint32_t>(triangles.size());
  std::vector<std::vector<FoundSubVoxels::Found>> chunks((count + kTrianglesAtOnce - 1) / kTrianglesAtOnce);
  forChunks(parallelFor, count, kTrianglesAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    FoundSubVoxels found;
    for (std::uint32_t t = begin; t < end; ++t) {
      TriangleOverlap(triangles[t]).visitSubVoxels(grid, [&](const glm::ivec3& v, std::uint64_t subVoxels) {
        found.add(grid.cellOf(v), brickBit(v), subVoxels);
      });
    }
    chunks[begin / kTrianglesAtOnce] = found.finish();
  });
  SubVoxels all;
  all.bits.assign(grid.cellCount(), 0);
  for (const auto& chunk : chunks) {
    for (const FoundSubVoxels::Found& each : chunk) all.bits[each.cell] |= std::uint64_t{1} << each.voxel;
  }
  number(all);
  for (const auto& chunk : chunks) {
    for (const FoundSubVoxels::Found& each : chunk)
      all.of[numberOf(all, each.cell, std::uint64_t{1} << each.voxel)] |= each.subVoxels;
  }
  return all;
}

SubVoxels SubVoxels::moved(const VolumeGrid& to, const glm::ivec3& by) const {
  SubVoxels moved;
  moved.bits = movedBits(bits, to, by);
  number(moved);
  for (std::uint32_t c = 0; c < bits.size(); ++c) {
    if (moved.bits[c] != 0)
      std::copy_n(of.begin() + first[to.cellIndex(to.cellAt(c) + by)], std::popcount(moved.bits[c]),
                  moved.of.begin() + moved.first[c]);
  }
  return moved;
}

SubVoxels SubVoxels::patched(std::span<const std::uint64_t> dirty, const SubVoxels& patch) const {
  SubVoxels made;
  made.bits.resize(bits.size());
  for (std::size_t c = 0; c < bits.size(); ++c) made.bits[c] = (bits[c] & ~dirty[c]) | (patch.bits[c] & dirty[c]);
  number(made);
  for (std::size_t c = 0; c < bits.size(); ++c) {
    std::uint32_t to = made.first[c];
    for (std::uint64_t rest = made.bits[c]; rest != 0; rest &= rest - 1, ++to) {
      const std::uint64_t bit = rest & (~rest + 1);
      const SubVoxels& from = (dirty[c] & bit) != 0 ? patch : *this;
      made.of[to] = from.of[numberOf(from, c, bit)];
    }
  }
  return made;
}

}  // namespace relume
