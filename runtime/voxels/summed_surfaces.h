// SPDX-License-Identifier: MIT
// Surfaces as sums over the triangles of a voxel take them: some two bytes each, as neighbours are alike, and twenty
// more of those that emit. Where each of 64 neighbours is one triangle's, which it is where there is a texture, albedo
// is told to a 16th or a 31st of what it varies by among them; elsewhere to 1/4095.
#pragma once

#include "relume/voxel_geometry.h"
#include "runtime/voxels/packed_bits.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
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
  // isOfOne: one triangle has it, as those have that a texture covers.
  void add(const VoxelSurface& surface, bool isOfOne = false) {
    const glm::ivec3 albedo(glm::floor(surface.albedo * float{kAlbedoSteps} + 0.5f));
    const bool emits = surface.emission != glm::vec3(0.0f);
    if (emits) {
      emission_.push_back({size(), surface.emission, surface.doubleSided});
      brightest_ = std::max({brightest_, surface.emission.x, surface.emission.y, surface.emission.z});
    }
    last_.push_back({albedo.y, albedo.x - albedo.y, albedo.z - albedo.y, emits ? 1 : 0});
    ofOne_ += isOfOne ? 1 : 0;
    if (last_.size() == kBlock) packLast();
  }

  std::uint32_t size() const { return static_cast<std::uint32_t>(kBlock * block_.size() + last_.size()); }
  glm::ivec3 albedo(std::uint32_t surface) const {  // [1/kAlbedoSteps]
    if (surface / kBlock >= block_.size()) return toAlbedo(last_[surface % kBlock]);
    const Block& block = block_[surface / kBlock];
    std::uint64_t bits = bits_.at(block.placeOf(surface), block.width());
    Steps steps{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t shift = block.shiftOf(k),
                          kept = static_cast<std::uint32_t>(bits) & ((1u << block.widthOf(k)) - 1);
      steps[k] = block.least[k] + static_cast<int>(kept << shift);
      bits >>= block.widthOf(k);
    }
    return glm::clamp(toAlbedo(steps), 0, kAlbedoSteps);
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
  static constexpr std::uint32_t kKept = 5;    // bits of a difference at most
  // Albedo as green, red less green, and blue less green, which vary less than red and blue do; whether it emits.
  using Steps = std::array<int, 4>;

  // Neighbours are alike: of each the difference from the least of them is kept; of textured ones by its highest bits,
  // rounded down or up by turns so that means over a few of them stay.
  struct Block {
    std::array<std::int16_t, 4> least{};
    std::uint16_t widths = 0, shifts = 0;  // bits of each difference that are kept, and that are not, in four
    std::uint32_t first = 0;               // [kBlock bits]

    std::uint32_t widthOf(std::size_t k) const { return widths >> 4 * k & 15u; }
    std::uint32_t shiftOf(std::size_t k) const { return shifts >> 4 * k & 15u; }
    std::uint32_t width() const { return widthOf(0) + widthOf(1) + widthOf(2) + widthOf(3); }
    std::size_t placeOf(std::uint32_t surface) const {
      return std::size_t{kBlock} * first + std::size_t{surface % kBlock} * width();
    }
  };
  static_assert(2 * kAlbedoSteps < 1 << 15);

  static glm::ivec3 toAlbedo(const Steps& steps) { return {steps[0] + steps[1], steps[0], steps[0] + steps[2]}; }

  bool emits(std::uint32_t surface) const {
    if (surface / kBlock >= block_.size()) return last_[surface % kBlock][3] != 0;
    const Block& block = block_[surface / kBlock];
    if (block.widthOf(3) == 0) return block.least[3] != 0;
    return bits_.at(block.placeOf(surface) + block.width() - 1, 1) != 0;
  }

  void packLast() {
    Block block;
    block.first = static_cast<std::uint32_t>(bits_.size() / kBlock);
    const bool textured = std::exchange(ofOne_, 0) == kBlock;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto less = [k](const Steps& a, const Steps& b) { return a[k] < b[k]; };
      const auto [least, most] = std::minmax_element(last_.begin(), last_.end(), less);
      block.least[k] = static_cast<std::int16_t>((*least)[k]);
      const auto range = static_cast<std::uint32_t>((*most)[k] - (*least)[k]);
      std::uint32_t shift = 0;
      while (textured && ((1u << kKept) - 1) << shift < range) ++shift;
      const auto width = static_cast<std::uint32_t>(std::bit_width(shift > 0 ? (1u << kKept) - 1 : range));
      block.widths = static_cast<std::uint16_t>(block.widths | width << 4 * k);
      block.shifts = static_cast<std::uint16_t>(block.shifts | shift << 4 * k);
    }
    for (std::uint32_t i = 0; i < kBlock; ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        const std::uint32_t shift = block.shiftOf(k),
                            turn = i * 2654435769u + static_cast<std::uint32_t>(k) * 0x55555555u;
        const std::uint64_t up = std::uint64_t{turn} << shift >> 32;  // [0..2^shift)
        bits_.add((static_cast<std::uint64_t>(last_[i][k] - block.least[k]) + up) >> shift, block.widthOf(k));
      }
    }
    block_.push_back(block);
    last_.clear();
  }

  std::vector<Block> block_;
  PackedBits bits_;
  std::vector<Steps> last_;                // that no block has as yet
  std::uint32_t ofOne_ = 0;                // how many of them one triangle has
  std::vector<SurfaceEmission> emission_;  // by ascending surface
  float brightest_ = 0.0f;
};

}  // namespace relume
