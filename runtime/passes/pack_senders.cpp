// SPDX-License-Identifier: MIT
// See pack_senders.h.
#include "runtime/passes/pack_senders.h"

#include "runtime/passes/leaf_blocks.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/receivers.h"

#include <algorithm>
#include <array>
#include <span>

namespace relume::gpu {
namespace {

using gl::kRelumeNone;
static_assert(gl::kRelumeCacheBits == kCacheBits);

// Surfels by kind, in blocks; `ends` are where each kind ends.
LeafBlocks placeSurfels(const Bake& bake, const PackedMap& map, int lumaBands, std::span<std::uint32_t, 3> ends,
                        std::pmr::memory_resource* memory) {
  const Hierarchy& hierarchy = bake.hierarchy;
  const std::uint32_t count = bake.surfels.count();
  std::pmr::vector<ReceiverKind> kindOf(count, memory);
  for (std::uint32_t s = 0; s < count; ++s)
    kindOf[s] = receiverKind(map, bake.surfels, s, normalsCount(bake.links.kind, lumaBands));
  LeafBlocks blocks(memory);
  // Each kind, and then the sky, ends a block.
  blocks.reserve(hierarchy.leafNode.size() + 4 * RELUME_SURFEL_GROUP);
  for (const ReceiverKind kind : {ReceiverKind::flat, ReceiverKind::tilted, ReceiverKind::gridded}) {
    std::uint32_t leaf = 0;
    for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
      if (!hierarchy.isLeaf(node) || hierarchy.sender(node) >= count) continue;
      const std::uint32_t s = hierarchy.sender(node);
      if (kindOf[s] == kind) blocks.add({s, node, leaf});
      ++leaf;
    }
    blocks.endBlock();
    ends[static_cast<std::size_t>(kind)] = static_cast<std::uint32_t>(blocks.slots().size());
  }
  return blocks;
}

// emission: packed, by slot.
void packEmitters(const Emitters& emitters, std::span<const SenderSlot> slots, SenderArrays& out) {
  if (emitters.count() == 0) return;
  std::uint32_t surfels = 0;
  for (const std::uint32_t s : emitters.surfel) surfels = std::max(surfels, s + 1);
  std::pmr::vector<std::uint32_t> slotOf(surfels, 0, out.emitters.get_allocator().resource());
  for (std::uint32_t i = 0; i < slots.size(); ++i) {
    if (slots[i].node != kRelumeNone && slots[i].surfel < surfels) slotOf[slots[i].surfel] = i;
  }
  out.emitters.resize(emitters.count());
  for (std::uint32_t e = 0; e < emitters.count(); ++e) {
    const std::uint32_t slot = slotOf[emitters.surfel[e]], *tap = emitters.tap.data() + std::size_t{kFootprintTaps} * e;
    static_assert(kFootprintTaps == 4);
    out.emitters[e] = {slot, out.emission[slot], emitters.tapWidth[e], 0, {tap[0], tap[1], tap[2], tap[3]}};
  }
}

// Where the shares of each gridded surfel begin, then the shares.
void packGridded(const Bake& bake, const PackedCaches& caches, std::span<const SenderSlot> slots, SenderArrays& out) {
  std::pmr::vector<std::uint32_t> shares(out.gridded.get_allocator().resource());
  const std::size_t sharesBegin = slots.size() + 1;
  for (const SenderSlot& each : slots) {
    out.gridded.push_back(static_cast<std::uint32_t>(sharesBegin + shares.size()));
    if (each.node != kRelumeNone) appendGridShares(caches, bake.surfels, each.surfel, shares);
  }
  out.gridded.push_back(static_cast<std::uint32_t>(sharesBegin + shares.size()));
  out.gridded.insert(out.gridded.end(), shares.begin(), shares.end());
}

}  // namespace

SenderArrays packSenders(const Bake& bake, const PackedCaches& caches, int lumaBands,
                         std::pmr::memory_resource* memory) {
  const Surfels& surfels = bake.surfels;
  const Hierarchy& hierarchy = bake.hierarchy;
  SenderArrays out(memory);
  std::array<std::uint32_t, 3> ends{};
  LeafBlocks blocks = placeSurfels(bake, caches.map(), lumaBands, ends, memory);
  out.flatEnd = ends[0];
  out.tiltedEnd = ends[1];
  out.surfelEnd = ends[2];

  // Albedo has the CPU backend's dithers.
  out.box = boxOf(surfels.positionWorld);
  out.emits = bake.emitters.count() > 0 || std::any_of(surfels.emission.begin(), surfels.emission.end(),
                                                       [](const glm::vec3& e) { return e != glm::vec3(0.0f); });
  out.surfels.assign(out.surfelEnd, SurfelWords{});
  out.emission.assign(out.emits ? out.surfelEnd : 0, 0);
  for (std::size_t i = 0; i < out.surfels.size(); ++i) {
    const SenderSlot& each = blocks.slots()[i];
    if (each.node == kRelumeNone) continue;
    const std::uint32_t s = each.surfel;
    out.surfels[i] = packSurfel(out.box, surfels.positionWorld[s], surfels.normal[s], surfels.albedo[s],
                                surfels.receiver[s], ditherOf(each.dither));
    if (out.emits) out.emission[i] = packColor(surfels.emission[s], ditherOf(s));
  }
  packEmitters(bake.emitters, blocks.slots(), out);
  packGridded(bake, caches, blocks.slots().subspan(out.tiltedEnd), out);

  std::pmr::vector<std::uint32_t> sky(hierarchy.leafNode.begin() + surfels.count(), hierarchy.leafNode.end(), memory);
  std::sort(sky.begin(), sky.end());
  for (const std::uint32_t node : sky) blocks.add({hierarchy.sender(node) - surfels.count(), node, 0});
  blocks.endBlock();
  out.senderEnd = static_cast<std::uint32_t>(blocks.slots().size());
  for (const SenderSlot& each : blocks.slots().subspan(out.surfelEnd)) out.skyOrder.push_back(each.surfel);
  out.leafNode = blocks.words();
  return out;
}

std::pmr::vector<std::uint32_t> orderSurfels(const Bake& bake, int lumaBands, std::pmr::memory_resource* memory) {
  std::array<std::uint32_t, 3> ends{};
  const LeafBlocks blocks = placeSurfels(bake, PackedMap(bake.caches, memory), lumaBands, ends, memory);
  std::pmr::vector<std::uint32_t> order(memory);
  order.reserve(blocks.slots().size());
  for (const SenderSlot& each : blocks.slots()) order.push_back(each.surfel);
  return order;
}

}  // namespace relume::gpu
