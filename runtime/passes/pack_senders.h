// SPDX-License-Identifier: MIT
// The senders as the passes read them: surfels flat first, then tilted, then gridded (runtime/shared/receivers.h), each
// by ascending leaf, with empty slots between (leaf_blocks.h); then the sky's patches.
#pragma once

#include "relume/bake_data.h"
#include "runtime/shared/pack_surfel.h"
#include "runtime/shared/packed_caches.h"
#include "shaders/shared/layout.h"

#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume::gpu {

struct SenderArrays {
  explicit SenderArrays(std::pmr::memory_resource* memory)
      : surfels(memory), emission(memory), leafNode(memory), gridded(memory), emitters(memory), skyOrder(memory) {}

  std::pmr::vector<SurfelWords> surfels;         // [Size surfelEnd]
  std::pmr::vector<std::uint32_t> emission;      // [Size surfelEnd, or 0 where nothing emits] packed
  std::pmr::vector<std::uint32_t> leafNode;      // LeafBlocks::words()
  std::pmr::vector<std::uint32_t> gridded;       // RELUME_SLOT_GRIDDED
  std::pmr::vector<gl::RelumeEmitter> emitters;  // RELUME_SLOT_EMITTERS
  std::pmr::vector<std::uint32_t> skyOrder;      // the patch of each slot after the surfels, kRelumeNone at empty ones
  SurfelBox box;
  bool emits = false;  // whether any surfel has emission, or can have
  // Where flat, tilted and all surfels end, and the sky's patches: multiples of RELUME_SURFEL_GROUP.
  std::uint32_t flatEnd = 0, tiltedEnd = 0, surfelEnd = 0, senderEnd = 0;
};

SenderArrays packSenders(const Bake& bake, const PackedCaches& caches, int lumaBands,
                         std::pmr::memory_resource* memory);

// The surfel of each slot, kRelumeNone at empty ones: the order of SenderArrays::surfels.
std::pmr::vector<std::uint32_t> orderSurfels(const Bake& bake, int lumaBands, std::pmr::memory_resource* memory);

}  // namespace relume::gpu
