// SPDX-License-Identifier: MIT
// The senders in the order of their threads on the GPU, and where their leaves are (shaders/lib/leaf_node.glsl).
#pragma once

#include "shaders/shared/layout.h"

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::gpu {

// A sender's slot on the GPU.
struct SenderSlot {
  // A surfel or a patch of the sky, and its leaf; gl::kRelumeNone = an empty slot.
  std::uint32_t surfel = gl::kRelumeNone, node = gl::kRelumeNone;
  std::uint32_t dither = 0;
};

// Senders by ascending node, in blocks of a work group whose nodes lie within 16 bits.
class LeafBlocks {
 public:
  explicit LeafBlocks(std::pmr::memory_resource* memory) : slots_(memory) {}
  void reserve(std::size_t slots) { slots_.reserve(slots); }
  void add(const SenderSlot& sender) {
    const std::size_t inBlock = slots_.size() % kBlock;
    if (inBlock > 0 && sender.node - slots_[slots_.size() - inBlock].node >= kEmpty) endBlock();
    slots_.push_back(sender);
  }
  // Leave the rest of the block empty: the next sender begins one.
  void endBlock() { slots_.resize((slots_.size() + kBlock - 1) / kBlock * kBlock); }
  std::span<const SenderSlot> slots() const { return slots_; }

  // [a block was ended last]
  std::pmr::vector<std::uint32_t> words() const {
    std::pmr::vector<std::uint32_t> words(slots_.get_allocator());
    words.reserve(slots_.size() / kBlock * (1 + kBlock / 2));
    for (std::size_t i = 0; i < slots_.size(); i += 2) {
      if (i % kBlock == 0) words.push_back(slots_[i].node);
      const auto step = [&](const SenderSlot& p) {
        return p.node == gl::kRelumeNone ? kEmpty : p.node - slots_[i / kBlock * kBlock].node;
      };
      words.push_back(step(slots_[i]) | step(slots_[i + 1]) << 16);
    }
    return words;
  }

 private:
  static constexpr std::size_t kBlock = RELUME_SURFEL_GROUP;
  static constexpr std::uint32_t kEmpty = 0xFFFFu;
  std::pmr::vector<SenderSlot> slots_;
};

}  // namespace relume::gpu
