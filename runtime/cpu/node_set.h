// SPDX-License-Identifier: MIT
// Some nodes of the hierarchy, ascending, a bit each; which they are is read off a block at a time.
#pragma once

#include "runtime/cpu/light_surfels_job.h"

#include <bit>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume::cpu {

class NodeSet {
 public:
  // `contains(node)` for all nodes below count; `block`: members of a block; `memory`: keeps the set.
  template <class Contains>
  NodeSet(std::uint32_t count, std::uint32_t block, const Contains& contains, std::pmr::memory_resource* memory)
      : bits_((count + 63) / 64, 0, memory), begin_(memory), block_(block) {
    for (std::uint32_t node = 0; node < count; ++node) {
      if (!contains(node)) continue;
      if (size_ % block == 0) begin_.push_back(node);
      bits_[node / 64] |= std::uint64_t{1} << (node % 64);
      ++size_;
    }
  }

  NodeSet(const NodeSet&) = delete;
  NodeSet& operator=(const NodeSet&) = delete;

  std::uint32_t size() const { return size_; }
  std::uint32_t blocks() const { return static_cast<std::uint32_t>(begin_.size()); }
  // Write the members from number `first` on, `wanted` of them. [first + wanted <= size; Size at >= wanted + kAtRoom]
  void read(const LightSurfelsKernel& kernel, std::uint32_t first, std::uint32_t wanted, std::uint32_t* at) const {
    if (wanted == 0) return;
    std::uint32_t skip = first % block_, word = begin_[first / block_] / 64;
    std::uint64_t bits = bits_[word] & (~std::uint64_t{0} << (begin_[first / block_] % 64));
    for (auto here = static_cast<std::uint32_t>(std::popcount(bits)); here <= skip;
         here = static_cast<std::uint32_t>(std::popcount(bits))) {
      skip -= here;
      bits = bits_[++word];
    }
    for (; skip > 0; --skip) bits &= bits - 1;
    kernel.listBits(bits_.data(), 64 * word + static_cast<std::uint32_t>(std::countr_zero(bits)), wanted, at);
  }
  std::size_t bytes() const { return sizeof(std::uint64_t) * bits_.size() + sizeof(std::uint32_t) * begin_.size(); }

 private:
  std::pmr::vector<std::uint64_t> bits_;
  std::pmr::vector<std::uint32_t> begin_;  // first member of each block
  std::uint32_t block_, size_ = 0;
};

}  // namespace relume::cpu
