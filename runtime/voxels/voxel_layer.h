// SPDX-License-Identifier: MIT
// The voxels of one set of triangles: a bit for each that is occupied, and for each of these what its two sides are.
// A layer holds what stands or what moves; a volume has one of both.
#pragma once

#include "relume/relighter.h"
#include "runtime/voxels/packed_sides.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/sub_voxels.h"
#include "runtime/voxels/voxel_grid.h"
#include "runtime/voxels/voxel_side.h"

#include <glm/gtc/type_precision.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class SummedSurfaces;

inline constexpr std::uint32_t kNoVoxel = 0xFFFFFFFFu;
// Bits of VoxelLayer::emitters.
inline constexpr unsigned kDarkFaces = 63, kFrontEmits = 64, kBackEmits = 128;

struct SideEmission {
  std::uint32_t side = 0;
  glm::vec3 emission{0.0f};   // [W/m²/sr] not 0
  std::uint8_t litFaces = 0;  // faceBit() of those that anything that emits in the voxel faces
};

// The bit of a cube's face by which a ray that goes up, or down, along an axis comes in.
inline unsigned faceBit(int axis, bool goesUp) { return 2 * static_cast<unsigned>(axis) + (goesUp ? 0u : 1u); }

// Whether a ray of this direction meets the front of a voxel with this axis.
inline bool isFront(const glm::i8vec3& axis, const glm::vec3& direction) {
  return static_cast<float>(axis.x) * direction.x + static_cast<float>(axis.y) * direction.y +
             static_cast<float>(axis.z) * direction.z <
         0.0f;
}

struct VoxelLayer {
  std::vector<std::uint64_t> bits;     // [Size cells] brickBit() of each voxel; CRC's geometry volume
  std::vector<std::uint32_t> first;    // [Size cells] number of the cell's first occupied voxel
  std::vector<glm::i8vec3> axis;       // [Size kept] toward the front side, 127 times the unit vector
  PackedSides sides;                   // of the voxels that are kept
  std::vector<SideEmission> emission;  // of the sides that emit, by ascending side
  // Of emitting voxels the bits of kDarkFaces that no emitter faces, and kFrontEmits, kBackEmits; of others 0. [Size
  // kept; 0 where nothing emits]
  std::vector<std::uint8_t> emitters;
  SubVoxels subVoxels;                   // what rays meet
  std::uint32_t occupied = 0, kept = 0;  // voxels, and those of them that have sides

  bool has(const VolumeGrid& grid, const glm::ivec3& v) const {
    return (bits[grid.cellOf(v)] >> brickBit(v) & 1u) != 0;
  }
  // The number of an occupied voxel: those of the cell before, and the bits below its own.
  std::uint32_t numberOf(const VolumeGrid& grid, const glm::ivec3& v) const {
    const std::uint32_t cell = grid.cellOf(v);
    return first[cell] + countBefore(bits[cell], v);
  }
  // The voxel whose sides a ray meets in a sub-voxel: its own, or where that is not occupied the one beside its corner.
  // kNoVoxel where there is none.
  std::uint32_t numberBehind(const VolumeGrid& grid, const glm::ivec3& v, unsigned subVoxel) const {
    if (has(grid, v)) return numberOf(grid, v);
    const glm::ivec3 at = voxelOfBit(static_cast<int>(subVoxel));
    for (int a = 0; a < 3; ++a) {
      glm::ivec3 beside = v;
      beside[a] += at[a] < kBrickSide / 2 ? -1 : 1;
      if (grid.holds(beside) && has(grid, beside)) return numberOf(grid, beside);
    }
    return kNoVoxel;
  }
  // Whether the side of a voxel that a ray of this direction meets emits.
  bool emitsToward(std::uint32_t number, const glm::vec3& direction) const {
    return !emitters.empty() && number < kept &&
           (emitters[number] & (isFront(axis[number], direction) ? kFrontEmits : kBackEmits)) != 0;
  }
  // Whether a ray of this direction that comes into a sub-voxel of it across a plane of this axis has passed all that
  // emits there: an emitter is flat, and the rim of its sub-voxels would shine where it is seen at a grazing angle.
  bool isDark(std::uint32_t number, int across, const glm::vec3& direction) const {
    return emitsToward(number, direction) &&
           (unsigned{emitters[number]} >> faceBit(across, direction[across] > 0.0f) & 1u) != 0;
  }
  std::uint32_t sideCount() const { return 2 * kept; }
  // Voxels of a cell that are kept.
  std::uint32_t keptOf(std::size_t cell) const {
    return std::min(static_cast<std::uint32_t>(std::popcount(bits[cell])), kept - std::min(first[cell], kept));
  }
  // The cell of a voxel of that number.
  std::uint32_t cellOfNumber(std::uint32_t number) const {
    return static_cast<std::uint32_t>(std::upper_bound(first.begin(), first.end(), number) - first.begin() - 1);
  }
  // What emits of this side and of those after it.
  std::vector<SideEmission>::const_iterator emissionFrom(std::uint32_t s) const {
    return std::lower_bound(emission.begin(), emission.end(), s,
                            [](const SideEmission& a, std::uint32_t b) { return a.side < b; });
  }
  glm::vec3 emissionOf(std::uint32_t s) const {  // [W/m²/sr]
    const auto found = emissionFrom(s);
    return found != emission.end() && found->side == s ? found->emission : glm::vec3(0.0f);
  }
};

// Kept voxels of a layer by number, one after the other.
class VoxelCursor {
 public:
  VoxelCursor(const VoxelLayer& layer, const VolumeGrid& grid, std::uint32_t number)
      : layer_(&layer),
        grid_(&grid),
        cell_(layer.cellOfNumber(number)),
        number_(number),
        corner_(kBrickSide * grid.cellAt(cell_)),
        rest_(layer.bits[cell_]) {
    for (std::uint32_t before = number - layer.first[cell_]; before > 0; --before) rest_ &= rest_ - 1;
  }
  std::uint32_t cell() const { return cell_; }
  glm::ivec3 voxel() const { return corner_ + voxelOfBit(std::countr_zero(rest_)); }
  // How many of its cell come before it.
  std::uint32_t inCell() const { return number_ - layer_->first[cell_]; }
  // Whether it is in another cell now. [Not the layer's last voxel]
  bool next() {
    ++number_;
    rest_ &= rest_ - 1;
    if (rest_ != 0) return false;
    while (layer_->bits[++cell_] == 0) {
    }
    rest_ = layer_->bits[cell_];
    corner_ = kBrickSide * grid_->cellAt(cell_);
    return true;
  }

 private:
  const VoxelLayer* layer_;
  const VolumeGrid* grid_;
  std::uint32_t cell_, number_;
  glm::ivec3 corner_;   // of the cell, whose divisions are not each voxel's
  std::uint64_t rest_;  // of the cell's voxels, from this one on
};

// visit(number, voxel, what `Read` has of both sides) of voxels [begin, end). Read: CellSides, CellSurfaces
template <class Read, class Visit>
void forVoxels(const VoxelLayer& layer, const VolumeGrid& grid, std::uint32_t begin, std::uint32_t end,
               const Visit& visit) {
  if (begin == end) return;
  VoxelCursor at(layer, grid, begin);
  Read read(layer.sides, at.cell(), layer.keptOf(at.cell()));
  for (std::uint32_t i = at.inCell(); i > 0; --i) static_cast<void>(read.next());
  for (std::uint32_t number = begin;;) {
    visit(number, at.voxel(), read.next());
    if (++number == end) return;
    if (at.next()) read = Read(layer.sides, at.cell(), layer.keptOf(at.cell()));
  }
}

// Set the bits of all voxels that triangles overlap, the same at any number of threads. [Size bits: cells]
void addBits(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const ParallelFor& parallelFor,
             std::vector<std::uint64_t>& bits);
// A layer of these bits and sub-voxels, without sides.
void voxelise(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const ParallelFor& parallelFor,
              VoxelLayer& layer);

// A layer in a grid that begins so many cells farther on: of the cells that both grids have, others are empty. All of
// its voxels are kept.
VoxelLayer moveLayer(const VoxelLayer& layer, const VolumeGrid& to, const glm::ivec3& by);

// Sides of the first `budget` occupied voxels, in the order of their numbers. Sums are of integers, so that they do not
// depend on the order in which threads add them.
void fillSides(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const SummedSurfaces& surfaces,
               std::uint32_t budget, const ParallelFor& parallelFor, VoxelLayer& layer);

// The same layer but for the voxels of `dirty`, whose bits, sides and sub-voxels are found anew. triangles: at least
// all that overlap such a voxel, in the order in which the whole layer has them. False, and nothing is changed, where
// the layer has or would have more voxels than the budget keeps. [Size dirty: cells]
bool patchSides(const VolumeGrid& grid, std::span<const std::uint64_t> dirty,
                std::span<const SnappedTriangle> triangles, const SummedSurfaces& surfaces, std::uint32_t budget,
                const ParallelFor& parallelFor, VoxelLayer& layer);

}  // namespace relume
