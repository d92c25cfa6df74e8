// SPDX-License-Identifier: MIT
// A constant array of which neighbours are often the same: of each block, the different values, and a byte per element
// that says which. A block of one value has no bytes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Reading is thread-safe, appending is not. kSearch: so many of a block's last values are searched for the next one;
// what is found in none of them is kept again.
template <class T, std::size_t kSearch = 256>
class BlockPalette {
 public:
  static constexpr std::size_t kBlock = 256;  // as many values at most, so that a byte tells them apart

  BlockPalette() = default;
  explicit BlockPalette(std::span<const T> values) { append(values); }

  // Add the next values: of all calls but the last, a multiple of kBlock.
  void append(std::span<const T> values) {
    for (std::size_t first = 0; first < values.size(); first += kBlock)
      appendBlock(values.subspan(first, std::min(kBlock, values.size() - first)));
    size_ += values.size();
  }
  void shrinkToFit() {
    value_.shrink_to_fit();
    which_.shrink_to_fit();
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T& operator[](std::size_t i) const {
    const Block& block = block_[i / kBlock];
    return value_[block.value + (block.which == kUniform ? 0 : which_[block.which * kBlock + i % kBlock])];
  }
  // What has to be in the processor's cache before an element can be read.
  const void* address(std::size_t i) const {
    const Block& block = block_[i / kBlock];
    if (block.which == kUniform) return &value_[block.value];
    return &which_[block.which * kBlock + i % kBlock];
  }
  std::vector<T> toVector() const {
    std::vector<T> values;
    values.reserve(size_);
    for (std::size_t i = 0; i < size_; ++i) values.push_back((*this)[i]);
    return values;
  }
  std::size_t sizeBytes() const { return block_.size() * sizeof(Block) + value_.size() * sizeof(T) + which_.size(); }

  bool operator==(const BlockPalette& other) const { return toVector() == other.toVector(); }

 private:
  static constexpr std::uint32_t kUniform = 0xFFFFFFFFu;
  struct Block {
    std::size_t value = 0;           // first of its values
    std::uint32_t which = kUniform;  // its bytes, in blocks; or all elements are the first value
  };

  void appendBlock(std::span<const T> values) {
    Block block{value_.size(), kUniform};
    std::uint8_t which[kBlock] = {};
    for (std::size_t i = 0; i < values.size(); ++i) {
      // Neighbours are the same most often: look among the last values first.
      std::size_t at = value_.size();
      const std::size_t last = std::max(block.value, at - std::min(at, kSearch));
      while (at > last && !(value_[at - 1] == values[i])) --at;
      if (at == last) {
        value_.push_back(values[i]);
        at = value_.size();
      }
      which[i] = static_cast<std::uint8_t>(at - 1 - block.value);
    }
    if (value_.size() - block.value > 1) {
      block.which = static_cast<std::uint32_t>(which_.size() / kBlock);
      which_.insert(which_.end(), which, which + kBlock);
    }
    block_.push_back(block);
  }

  std::size_t size_ = 0;
  std::vector<Block> block_;
  std::vector<T> value_;
  std::vector<std::uint8_t> which_;  // [Size kBlock each block of several values]
};

}  // namespace relume
