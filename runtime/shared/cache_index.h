// SPDX-License-Identifier: MIT
// Numbers of caches, or of bricks, as look-ups keep them: in two bytes each where they lie near enough together, else
// in four. Caches of a light map do up to 65,534 of them.
#pragma once

#include "relume/caches.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

class CacheIndex {
 public:
  // index: numbers below kHangingPoint, kHangingPoint and kNoCache. memory: keeps them.
  CacheIndex(std::span<const std::uint32_t> index, std::pmr::memory_resource* memory) : narrow_(memory), wide_(memory) {
    static_assert(kNoBrick == kNoCache && kHangingPoint == kNoCache - 1);
    std::uint32_t end = 0;
    first_ = kNoCache;
    for (const std::uint32_t i : index) {
      if (i >= kHangingPoint) continue;
      first_ = std::min(first_, i);
      end = std::max(end, i + 1);
    }
    if (end > 0 && end - first_ > kNarrowHanging) {
      first_ = 0;
      wide_.assign(index.begin(), index.end());
      return;
    }
    // Kernels read pairs, also from the last on.
    narrow_.reserve(index.size() + 1);
    for (const std::uint32_t i : index)
      narrow_.push_back(static_cast<std::uint16_t>(i >= kHangingPoint ? i : i - first_));
    if (!narrow_.empty()) narrow_.push_back(0);
  }

  bool empty() const { return size() == 0; }
  std::size_t size() const { return narrow_.empty() ? wide_.size() : narrow_.size() - 1; }
  std::uint32_t operator[](std::size_t i) const {
    if (narrow_.empty()) return wide_[i];
    const std::uint32_t number = narrow_[i];
    return number < kNarrowHanging ? first_ + number : number | 0xFFFF0000u;
  }
  std::size_t bytes() const { return sizeof(std::uint16_t) * narrow_.size() + sizeof(std::uint32_t) * wide_.size(); }

  // For kernels: numbers less first(), all ones for kNoCache; one of them is null.
  const std::uint16_t* narrow() const { return narrow_.empty() ? nullptr : narrow_.data(); }
  const std::uint32_t* wide() const { return wide_.empty() ? nullptr : wide_.data(); }
  std::uint32_t first() const { return first_; }

 private:
  static constexpr std::uint32_t kNarrowHanging = kHangingPoint & 0xFFFFu;

  std::uint32_t first_ = 0;
  std::pmr::vector<std::uint16_t> narrow_;
  std::pmr::vector<std::uint32_t> wide_;
};

}  // namespace relume
