// SPDX-License-Identifier: MIT
// Direct light of a volume's sides, most of which no light reaches: six bytes of each that is lit, and a bit of all.
#pragma once

#include "runtime/voxels/packed_light.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class SparseLight {
 public:
  std::size_t size() const { return size_; }  // [sides]
  // [side < size(), W/m²]
  glm::vec3 operator[](std::size_t side) const {
    return (lit_[side / kBlock] >> side % kBlock & 1u) != 0 ? light_[litBefore(side)].value() : glm::vec3(0.0f);
  }
  // The next sides.
  void append(std::span<const PackedLight> sides) {
    for (const PackedLight& side : sides) {
      startBlock();
      if (side != PackedLight()) {
        lit_.back() |= std::uint64_t{1} << size_ % kBlock;
        light_.push_back(side);
      }
      ++size_;
    }
  }
  // The next ones, dark, until there are so many. [at least size()]
  void growTo(std::size_t sides) {
    while (size_ < sides) {
      startBlock();
      size_ = std::min(sides, lit_.size() * kBlock);
    }
  }
  // Those before a side. [at most size()]
  SparseLight before(std::size_t side) const {
    SparseLight some;
    const auto blocks = static_cast<std::ptrdiff_t>((side + kBlock - 1) / kBlock);
    some.lit_.assign(lit_.begin(), lit_.begin() + blocks);
    some.first_.assign(first_.begin(), first_.begin() + blocks);
    if (side % kBlock != 0) some.lit_.back() &= (std::uint64_t{1} << side % kBlock) - 1;
    some.light_.assign(light_.begin(), light_.begin() + static_cast<std::ptrdiff_t>(litBefore(side)));
    some.size_ = side;
    return some;
  }
  void shrinkToFit() {
    lit_.shrink_to_fit();
    first_.shrink_to_fit();
    light_.shrink_to_fit();
  }
  std::size_t bytes() const {
    return sizeof(lit_[0]) * lit_.size() + sizeof(first_[0]) * first_.size() + sizeof(light_[0]) * light_.size();
  }

 private:
  static constexpr std::size_t kBlock = 64;  // sides

  // How many sides before this one are lit. [at most size()]
  std::size_t litBefore(std::size_t side) const {
    const std::size_t block = side / kBlock;
    if (block == lit_.size()) return light_.size();
    const std::uint64_t below = (std::uint64_t{1} << side % kBlock) - 1;
    return first_[block] + static_cast<std::size_t>(std::popcount(lit_[block] & below));
  }
  void startBlock() {
    if (size_ % kBlock != 0) return;
    lit_.push_back(0);
    first_.push_back(static_cast<std::uint32_t>(light_.size()));
  }

  std::size_t size_ = 0;
  std::vector<std::uint64_t> lit_;    // of each block, its sides' bits
  std::vector<std::uint32_t> first_;  // of each block, the place of its first lit side in light_
  std::vector<PackedLight> light_;
};

}  // namespace relume
