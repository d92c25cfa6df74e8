// SPDX-License-Identifier: MIT
// Numbers of few bits, one after the other in bytes: what a volume keeps to find voxels anew is read seldom and in its
// order, and would take twice the memory in whole bytes.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace relume {

static_assert(std::endian::native == std::endian::little, "PackedBits reads eight bytes as one number");

class PackedBits {
 public:
  static constexpr std::uint32_t kWidest = 57;  // of a number: it lies within eight bytes wherever it begins

  std::size_t size() const { return size_; }  // [bits]
  // width [0..kWidest], value < 2^width
  void add(std::uint64_t value, std::uint32_t width) {
    bytes_.resize((size_ + width) / 8 + sizeof(std::uint64_t), 0);
    std::uint64_t word;
    std::memcpy(&word, bytes_.data() + size_ / 8, sizeof(word));
    word |= value << size_ % 8;
    std::memcpy(bytes_.data() + size_ / 8, &word, sizeof(word));
    size_ += width;
  }
  // The number that begins at a bit. [place + width <= size()]
  std::uint64_t at(std::size_t place, std::uint32_t width) const {
    std::uint64_t word;
    std::memcpy(&word, bytes_.data() + place / 8, sizeof(word));
    return word >> place % 8 & ((std::uint64_t{1} << width) - 1);
  }
  void alignToByte() {
    size_ = (size_ + 7) / 8 * 8;
    bytes_.resize(size_ / 8 + sizeof(std::uint64_t), 0);
  }
  // Others' from a byte on. [size(), begin: whole bytes]
  void addBytes(const PackedBits& from, std::size_t begin, std::size_t end) {
    if (begin == end) return;
    bytes_.resize(size_ / 8);
    bytes_.insert(bytes_.end(), from.bytes_.begin() + static_cast<std::ptrdiff_t>(begin / 8),
                  from.bytes_.begin() + static_cast<std::ptrdiff_t>((end + 7) / 8));
    size_ += end - begin;
    bytes_.resize(size_ / 8 + sizeof(std::uint64_t), 0);
  }
  void shrinkToFit() { bytes_.shrink_to_fit(); }
  std::size_t bytes() const { return bytes_.size(); }
  bool operator==(const PackedBits&) const = default;

 private:
  std::vector<std::uint8_t> bytes_;  // and seven more at least, for the last number
  std::size_t size_ = 0;
};

// Reads numbers one after the other.
class PackedBitsReader {
 public:
  PackedBitsReader(const PackedBits& bits, std::size_t place) : bits_(&bits), at_(place) {}
  std::uint64_t next(std::uint32_t width) {
    const std::uint64_t value = bits_->at(at_, width);
    at_ += width;
    return value;
  }
  std::size_t place() const { return at_; }  // of the next number

 private:
  const PackedBits* bits_;
  std::size_t at_;
};

}  // namespace relume
