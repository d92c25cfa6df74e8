// SPDX-License-Identifier: MIT
// The senders in the order of their threads on the GPU, and where their leaves are (shaders/lib/leaf_node.glsl).
#pragma once

#include "shaders/shared/layout.h"

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::gl {

// A sender's place on the GPU.
struct Placed {
  // A surfel or a patch of the sky, and its leaf; kRelumeNone = an empty place.
  std::uint32_t surfel = kRelumeNone, node = kRelumeNone;
  std::uint32_t dither = 0;
};

// Senders by ascending node, in blocks of a work group whose nodes lie within 16 bits.
class LeafBlocks {
 public:
  explicit LeafBlocks(std::pmr::memory_resource* memory) : placed_(memory) {}
  void add(const Placed& sender) {
    const std::size_t inBlock = placed_.size() % kBlock;
    if (inBlock > 0 && sender.node - placed_[placed_.size() - inBlock].node >= kEmpty) endBlock();
    placed_.push_back(sender);
  }
  // Leave the rest of the block empty: the next sender begins one.
  void endBlock() { placed_.resize((placed_.size() + kBlock - 1) / kBlock * kBlock); }
  std::span<const Placed> placed() const { return placed_; }

  // [a block was ended last]
  std::pmr::vector<std::uint32_t> words() const {
    std::pmr::vector<std::uint32_t> words(placed_.get_allocator());
    words.reserve(placed_.size() / kBlock * (1 + kBlock / 2));
    for (std::size_t i = 0; i < placed_.size(); i += 2) {
      if (i % kBlock == 0) words.push_back(placed_[i].node);
      const auto step = [&](const Placed& p) {
        return p.node == kRelumeNone ? kEmpty : p.node - placed_[i / kBlock * kBlock].node;
      };
      words.push_back(step(placed_[i]) | step(placed_[i + 1]) << 16);
    }
    return words;
  }

 private:
  static constexpr std::size_t kBlock = RELUME_SURFEL_GROUP;
  static constexpr std::uint32_t kEmpty = 0xFFFFu;
  std::pmr::vector<Placed> placed_;
};

}  // namespace relume::gl
