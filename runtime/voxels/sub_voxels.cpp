// SPDX-License-Identifier: MIT
// See sub_voxels.h.
#include "runtime/voxels/sub_voxels.h"

#include "runtime/shared/chunks.h"
#include "runtime/voxels/overlap.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

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

// Number what `bits` has: room for the sub-voxels of each.
std::vector<std::uint64_t> number(SubVoxels& all) {
  return std::vector<std::uint64_t>(numberBits(all.bits, all.first), 0);
}

// Of the voxel of this bit.
std::uint32_t numberOf(const SubVoxels& all, std::size_t cell, std::uint64_t bit) {
  return all.first[cell] + static_cast<std::uint32_t>(std::popcount(all.bits[cell] & (bit - 1)));
}

// Shapes by a table of their hashes, of which half at least stays empty.
class ShapeNumbers {
 public:
  // For so many shapes. [1..2^16]
  explicit ShapeNumbers(std::size_t most)
      : slot_(std::bit_ceil(2 * most), 0), shift_(64 - std::countr_zero(slot_.size())) {}

  // The shape's number, which is appended where it has none.
  std::uint16_t numberOf(std::uint64_t shape, std::vector<std::uint64_t>& shapes) {
    for (std::uint64_t at = shape * 0x9E3779B97F4A7C15u >> shift_;; ++at) {
      std::uint32_t& slot = slot_[at % slot_.size()];
      if (slot == 0) {
        shapes.push_back(shape);
        slot = static_cast<std::uint32_t>(shapes.size());
      }
      if (shapes[slot - 1] == shape) return static_cast<std::uint16_t>(slot - 1);
    }
  }

 private:
  std::vector<std::uint32_t> slot_;  // a shape's number and one; 0: none
  int shift_;                        // to a hash's highest bits
};

}  // namespace

SubVoxelShapes::SubVoxelShapes(std::vector<std::uint64_t> ofVoxels) {
  // Six bytes a voxel are saved, for eight a shape.
  const std::size_t most = std::min(std::size_t{1} << 16, 3 * ofVoxels.size() / 4);
  ShapeNumbers numbers(std::max<std::size_t>(most, 1));
  number_.reserve(ofVoxels.size());
  for (std::size_t v = 0; v < ofVoxels.size() && shape_.size() < most; ++v)
    number_.push_back(numbers.numberOf(ofVoxels[v], shape_));
  if (number_.size() == ofVoxels.size()) {
    shape_.shrink_to_fit();
    return;
  }
  shape_ = std::move(ofVoxels);
  number_ = {};
}

std::vector<std::uint64_t> SubVoxelShapes::ofVoxels() const {
  std::vector<std::uint64_t> all(size());
  for (std::size_t v = 0; v < all.size(); ++v) all[v] = (*this)[v];
  return all;
}

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
  std::vector<std::uint64_t> of = number(all);
  for (const auto& chunk : chunks) {
    for (const FoundSubVoxels::Found& each : chunk)
      of[numberOf(all, each.cell, std::uint64_t{1} << each.voxel)] |= each.subVoxels;
  }
  all.of = SubVoxelShapes(std::move(of));
  return all;
}

SubVoxels SubVoxels::moved(const VolumeGrid& to, const glm::ivec3& by) const {
  SubVoxels moved;
  moved.bits = movedBits(bits, to, by);
  std::vector<std::uint64_t> made = number(moved);
  for (std::uint32_t c = 0; c < bits.size(); ++c) {
    if (moved.bits[c] == 0) continue;
    const std::uint32_t from = first[to.cellIndex(to.cellAt(c) + by)];
    const auto count = static_cast<std::uint32_t>(std::popcount(moved.bits[c]));
    for (std::uint32_t v = 0; v < count; ++v) made[moved.first[c] + v] = of[from + v];
  }
  moved.of = SubVoxelShapes(std::move(made));
  return moved;
}

SubVoxels SubVoxels::patched(std::span<const std::uint64_t> dirty, const SubVoxels& patch) const {
  SubVoxels made;
  made.bits.resize(bits.size());
  for (std::size_t c = 0; c < bits.size(); ++c) made.bits[c] = (bits[c] & ~dirty[c]) | (patch.bits[c] & dirty[c]);
  std::vector<std::uint64_t> ofMade = number(made);
  for (std::size_t c = 0; c < bits.size(); ++c) {
    std::uint32_t to = made.first[c];
    for (std::uint64_t rest = made.bits[c]; rest != 0; rest &= rest - 1, ++to) {
      const std::uint64_t bit = rest & (~rest + 1);
      const SubVoxels& from = (dirty[c] & bit) != 0 ? patch : *this;
      ofMade[to] = from.of[numberOf(from, c, bit)];
    }
  }
  made.of = SubVoxelShapes(std::move(ofMade));
  return made;
}

}  // namespace relume
