// SPDX-License-Identifier: MIT
// See seen_cells.h.
#include "bake/scene/seen_cells.h"

#include "bake/random.h"

#include <algorithm>
#include <cmath>

namespace relume {

std::uint64_t CellGrid::key(std::uint32_t instance, const glm::vec3& positionWorld,
                            const glm::vec3& normalOfSide) const {
  // Signed axis of the normal, 0..5.
  std::uint32_t axis = 0;
  for (std::uint32_t a = 1; a < 3; ++a) {
    if (std::abs(normalOfSide[static_cast<int>(a)]) > std::abs(normalOfSide[static_cast<int>(axis)])) axis = a;
  }
  const std::uint32_t direction = 2 * axis + (normalOfSide[static_cast<int>(axis)] < 0.0f ? 1u : 0u);

  // A 64-bit hash stands for the cell: two of a million cells meet with probability 3e-8.
  std::uint64_t hash = mix64((std::uint64_t{instance} << 3) | direction);
  for (int a = 0; a < 3; ++a) {
    const float voxel = std::floor((positionWorld[a] - origin[a]) / size);
    const auto index = static_cast<std::int64_t>(std::clamp(voxel, -1e9f, 1e9f));
    hash = mix64(hash ^ static_cast<std::uint64_t>(index));
  }
  return std::max<std::uint64_t>(hash, 1);  // 0 marks an empty slot
}

void CellCounter::Shard::add(const CellHits& hits) {
  if (2 * used >= slots.size()) {
    // Grow to twice the size.
    std::vector<CellHits> old(std::max<std::size_t>(1024, 2 * slots.size()));
    old.swap(slots);
    used = 0;
    for (const CellHits& slot : old) {
      if (slot.key != 0) add(slot);
    }
  }
  const std::size_t mask = slots.size() - 1;
  std::size_t at = hits.key & mask;
  while (slots[at].key != 0 && slots[at].key != hits.key) at = (at + 1) & mask;
  if (slots[at].key == 0) ++used;
  slots[at].key = hits.key;
  slots[at].direct += hits.direct;
  slots[at].bounced += hits.bounced;
}

void CellCounter::add(std::span<const CellHits> hits) {
  // Deal the hits to their shards, so that each is locked once.
  std::array<std::uint32_t, kShards + 1> begin{};
  const auto shardOf = [](const CellHits& h) { return static_cast<std::size_t>(h.key >> 58); };
  for (const CellHits& h : hits) ++begin[shardOf(h) + 1];
  for (std::size_t s = 0; s < kShards; ++s) begin[s + 1] += begin[s];
  std::vector<CellHits> dealt(hits.size());
  auto next = begin;
  for (const CellHits& h : hits) dealt[next[shardOf(h)]++] = h;

  for (std::size_t s = 0; s < kShards; ++s) {
    if (begin[s] == begin[s + 1]) continue;
    const std::lock_guard lock(shards_[s].mutex);
    for (std::uint32_t i = begin[s]; i < begin[s + 1]; ++i) shards_[s].add(dealt[i]);
  }
}

std::vector<CellHits> CellCounter::sorted() const {
  std::vector<CellHits> all;
  for (const Shard& shard : shards_) {
    for (const CellHits& slot : shard.slots) {
      if (slot.key != 0) all.push_back(slot);
    }
  }
  std::sort(all.begin(), all.end(), [](const CellHits& a, const CellHits& b) { return a.key < b.key; });
  return all;
}

}  // namespace relume
