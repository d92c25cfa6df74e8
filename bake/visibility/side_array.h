// SPDX-License-Identifier: MIT
// Values by side of the scene's triangles. Where neighbours in the order of the triangles have no value, that is T(),
// on the same side, they take no memory: of a level of many instances little may be seen, and of a closed shape only
// the fronts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relume {

// A side: 2 * triangle + (back ? 1 : 0). Reading is thread-safe, writing is not.
template <class T>
class SideArray {
 public:
  SideArray() = default;
  explicit SideArray(std::size_t sides) { grow(sides); }
  // Give every side its value.
  SideArray& operator=(std::span<const T> values) {
    *this = SideArray();
    append(values);
    shrinkToFit();
    return *this;
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T operator[](std::size_t side) const {
    const std::size_t block = block_[blockOf(side)];
    return block == kNoBlock ? T() : value_[block + offsetOf(side)];
  }
  void set(std::size_t side, T value) {
    std::size_t& block = block_[blockOf(side)];
    if (block == kNoBlock) {
      if (value == T()) return;
      block = value_.size();
      value_.resize(value_.size() + kAlong, T());
    }
    value_[block + offsetOf(side)] = value;
  }
  // The values of the sides after those that there are. [even number]
  void append(std::span<const T> values) {
    const std::size_t first = size_;
    grow(first + values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!(values[i] == T())) set(first + i, values[i]);
    }
  }
  void shrinkToFit() { value_.shrink_to_fit(); }
  std::vector<T> toVector() const {
    std::vector<T> values(size_);
    for (std::size_t side = 0; side < size_; ++side) values[side] = (*this)[side];
    return values;
  }

  bool operator==(const SideArray& other) const {
    if (size_ != other.size_) return false;
    for (std::size_t side = 0; side < size_; ++side) {
      if (!((*this)[side] == other[side])) return false;
    }
    return true;
  }

 private:
  // A block has the same side of so many triangles.
  static constexpr std::size_t kAlong = 64, kNoBlock = static_cast<std::size_t>(-1);
  static std::size_t blockOf(std::size_t side) { return side / (2 * kAlong) * 2 + side % 2; }
  static std::size_t offsetOf(std::size_t side) { return side / 2 % kAlong; }
  void grow(std::size_t sides) {
    size_ = sides;
    block_.resize((sides + 2 * kAlong - 1) / (2 * kAlong) * 2, kNoBlock);
  }

  std::size_t size_ = 0;
  std::vector<std::size_t> block_;  // [Size 2 a block of triangles] first of its values, or kNoBlock
  std::vector<T> value_;
};

}  // namespace relume
