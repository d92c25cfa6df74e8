// SPDX-License-Identifier: MIT
// Surfaces as sums over the triangles of a voxel take them: four bytes each at most, as neighbours are alike, and
// twenty more of those that emit.
#pragma once

#include "relume/voxel_geometry.h"
#include "runtime/voxels/packed_bits.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr int kAlbedoSteps = 4095;

struct SurfaceEmission {
  std::uint32_t surface = 0;
  glm::vec3 emission{0.0f};  // [W/m²/sr] not 0
  bool doubleSided = false;
};

class SummedSurfaces {
 public:
  SummedSurfaces() = default;
  explicit SummedSurfaces(std::span<const VoxelSurface> surfaces) {
    for (const VoxelSurface& each : surfaces) add(each);
  }

  void add(const VoxelSurface& surface) {
    Steps steps{};
    for (int k = 0; k < 3; ++k)
      steps[static_cast<std::size_t>(k)] =
          static_cast<std::uint32_t>(std::floor(surface.albedo[k] * float{kAlbedoSteps} + 0.5f));
    if (surface.emission != glm::vec3(0.0f)) {
      steps[3] = 1;
      emission_.push_back({size(), surface.emission, surface.doubleSided});
      brightest_ = std::max({brightest_, surface.emission.x, surface.emission.y, surface.emission.z});
    }
    last_.push_back(steps);
    if (last_.size() == kBlock) packLast();
  }

  std::uint32_t size() const { return static_cast<std::uint32_t>(kBlock * block_.size() + last_.size()); }
  glm::ivec3 albedo(std::uint32_t surface) const {  // [1/kAlbedoSteps]
    if (surface / kBlock >= block_.size()) return glm::ivec3(toAlbedo(last_[surface % kBlock]));
    const Block& block = block_[surface / kBlock];
    std::uint64_t bits = bits_.at(block.placeOf(surface), block.width());
    glm::ivec3 steps;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t width = block.widthOf(k);
      steps[static_cast<int>(k)] = static_cast<int>(block.least(k) + (bits & ((1u << width) - 1)));
      bits >>= width;
    }
    return steps;
  }
  const SurfaceEmission* emission(std::uint32_t surface) const {  // null: none
    if (emission_.empty() || !emits(surface)) return nullptr;
    const auto less = [](const SurfaceEmission& a, std::uint32_t b) { return a.surface < b; };
    return &*std::lower_bound(emission_.begin(), emission_.end(), surface, less);
  }
  float brightest() const { return brightest_; }  // [W/m²/sr] of any channel
  std::size_t bytes() const {
    return block_.size() * sizeof(Block) + bits_.bytes() + last_.size() * sizeof(Steps) +
           emission_.size() * sizeof(SurfaceEmission);
  }

 private:
  static constexpr std::uint32_t kBlock = 64;  // surfaces
  using Steps = std::array<std::uint32_t, 4>;  // albedo, and whether it emits

  // Neighbours are alike: of each the difference from the least of them is kept.
  struct Block {
    std::uint64_t head =
        0;  // of each of the four numbers the least, in twelve bits, and the bits of differences, in four
    std::uint64_t firstBit = 0;

    std::uint32_t least(std::uint32_t k) const { return static_cast<std::uint32_t>(head >> 16 * k & 4095u); }
    std::uint32_t widthOf(std::uint32_t k) const { return static_cast<std::uint32_t>(head >> (16 * k + 12) & 15u); }
    std::uint32_t width() const { return widthOf(0) + widthOf(1) + widthOf(2) + widthOf(3); }
    std::size_t placeOf(std::uint32_t surface) const { return firstBit + std::size_t{surface % kBlock} * width(); }
  };
  static_assert(kAlbedoSteps < 1 << 12);

  static glm::uvec3 toAlbedo(const Steps& steps) { return {steps[0], steps[1], steps[2]}; }

  bool emits(std::uint32_t surface) const {
    if (surface / kBlock >= block_.size()) return last_[surface % kBlock][3] != 0;
    const Block& block = block_[surface / kBlock];
    if (block.widthOf(3) == 0) return block.least(3) != 0;
    return bits_.at(block.placeOf(surface) + block.width() - 1, 1) != 0;
  }

  void packLast() {
    Block block;
    block.firstBit = bits_.size();
    for (std::uint32_t k = 0; k < 4; ++k) {
      const auto less = [k](const Steps& a, const Steps& b) { return a[k] < b[k]; };
      const auto [least, most] = std::minmax_element(last_.begin(), last_.end(), less);
      const auto width = static_cast<std::uint64_t>(std::bit_width((*most)[k] - (*least)[k]));
      block.head |= (std::uint64_t{(*least)[k]} | width << 12) << 16 * k;
    }
    for (const Steps& steps : last_) {
      for (std::uint32_t k = 0; k < 4; ++k) bits_.add(steps[k] - block.least(k), block.widthOf(k));
    }
    block_.push_back(block);
    last_.clear();
  }

  std::vector<Block> block_;
  PackedBits bits_;
  std::vector<Steps> last_;                // that no block has as yet
  std::vector<SurfaceEmission> emission_;  // by ascending surface
  float brightest_ = 0.0f;
};

}  // namespace relume
