// SPDX-License-Identifier: MIT
// Sides of a layer's voxels, of which a level has hundreds of thousands: some sixteen bytes each, in blocks of a
// cell's voxels, so that cells are copied whole. Places of light are as they were found; the rest is rounded to less
// than the voxel's sums were: places to 2^-9 voxel, normals to 2e-3, albedo to 2^-13, areas to 2^-10.
//
// Most voxels have one surface, whose two sides differ in place alone. Most sides are flat: three of the four places
// of light follow from the plane of the first.
//
// A block: how many of its voxels have a second surface (8 bits); of each voxel the places of both sides and its
// surface (120 bits); the second surfaces (58 bits each); then of each side that is faced its area and places of light.
#pragma once

#include "runtime/voxels/packed_bits.h"
#include "runtime/voxels/voxel_side.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// What is known of a voxel before it is packed.
struct MadeSides {
  std::array<VoxelSide, 2> side;                  // front, back; one of them at least is faced
  std::array<float, 2> area{};                    // [m²]
  std::array<std::array<SubPlace, 4>, 2> places;  // of sides that are faced
};

class PackedSides {
 public:
  // face: of a voxel. [m²]
  explicit PackedSides(float face = 1.0f) : face_(face) {}

  // The next cell's voxels, [0..64] of them.
  void addCell(std::span<const MadeSides> voxels);
  // The next cells, as others have them.
  void append(const PackedSides& other);
  void copyCell(const PackedSides& from, std::size_t cell);
  // The next cell, of which some voxels are those of one, and some those of another.
  struct Source {
    const PackedSides* from = nullptr;
    std::uint32_t cell = 0, voxel = 0, voxels = 0;  // which of how many the cell has
  };
  void mergeCell(std::span<const Source> voxels);
  void shrinkToFit();

  // visit(word) of all that is kept of a cell: the same numbers where that is the same.
  template <class Visit>
  void forWords(std::size_t cell, const Visit& visit) const {
    constexpr std::size_t kWord = 56;
    const std::size_t end = endOf(cell);
    for (std::size_t at = blockOf(cell); at < end; at += kWord)
      visit(bits_.at(at, static_cast<std::uint32_t>(std::min(kWord, end - at))));
  }

  std::size_t bytes() const { return firstByte_.size() * sizeof(firstByte_[0]) + bits_.bytes(); }
  bool operator==(const PackedSides&) const = default;

 private:
  friend class CellSides;
  friend class CellSurfaces;
  std::size_t blockOf(std::size_t cell) const { return std::size_t{8} * firstByte_[cell]; }  // its first bit
  std::size_t endOf(std::size_t cell) const {                                                // that after its last byte
    return cell + 1 < firstByte_.size() ? blockOf(cell + 1) : bits_.size();
  }

  float face_;
  std::vector<std::uint32_t> firstByte_;  // of each cell
  PackedBits bits_;
};

// Voxels of a cell one after the other: their two sides.
class CellSides {
 public:
  // voxels: how many the cell has
  CellSides(const PackedSides& sides, std::size_t cell, std::uint32_t voxels);
  std::array<VoxelSide, 2> next();
  void skip(std::uint32_t voxels);
  std::size_t second() const { return second_; }  // where the next second surface lies. [bits]
  // Whether a triangle faces side 0 or 1 of the cell's voxel of that number.
  static bool isFaced(const PackedSides& sides, std::size_t cell, std::uint32_t voxel, std::uint32_t side);

 private:
  const PackedBits* bits_;
  std::size_t first_, second_;
};

// The same of what their light is found by.
class CellSurfaces {
 public:
  CellSurfaces(const PackedSides& sides, std::size_t cell, std::uint32_t voxels);
  std::array<SideSurface, 2> next();
  std::size_t place() const { return from_.place(); }  // of what it reads next. [bits]

 private:
  const PackedBits* bits_;
  std::size_t first_;
  PackedBitsReader from_;
  float face_;
};

}  // namespace relume
