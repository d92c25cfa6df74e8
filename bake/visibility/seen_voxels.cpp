// SPDX-License-Identifier: MIT
// See seen_voxels.h.
#include "bake/visibility/seen_voxels.h"

#include "bake/base/random.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

namespace relume {

std::uint64_t voxelKey(std::uint32_t facing, const glm::ivec3& cube) {
  std::uint64_t hash = mix64(facing);
  for (int a = 0; a < 3; ++a) hash = mix64(hash ^ static_cast<std::uint64_t>(std::int64_t{cube[a]}));
  return std::max<std::uint64_t>(hash, 1);  // 0 marks an empty slot
}

VoxelHits VoxelGrid::voxel(std::uint32_t instance, const glm::vec3& positionWorld,
                           const glm::vec3& normalOfSide) const {
  const std::uint32_t facing = facingOf(instance, normalOfSide);
  const glm::ivec3 cube = cubeOf(positionWorld);
  return {voxelKey(facing, cube), 0, 0, cube, facing};
}

std::uint64_t VoxelGrid::key(std::uint32_t instance, const glm::vec3& positionWorld,
                             const glm::vec3& normalOfSide) const {
  return voxelKey(facingOf(instance, normalOfSide), cubeOf(positionWorld));
}

std::array<std::uint64_t, 6> VoxelGrid::neighbours(std::uint32_t facing, const glm::ivec3& centre) {
  std::array<std::uint64_t, 6> keys;
  for (int face = 0; face < 6; ++face) {
    glm::ivec3 cube = centre;
    cube[face / 2] += face % 2 == 0 ? 1 : -1;
    keys[static_cast<std::size_t>(face)] = voxelKey(facing, cube);
  }
  return keys;
}

VoxelIndex::VoxelIndex(std::vector<std::uint64_t> sortedKeys) : key_(std::move(sortedKeys)) {
  const int bits = std::clamp(static_cast<int>(std::bit_width(key_.size())), 1, 31);
  shift_ = 64 - bits;
  bucketBegin_.assign((std::size_t{1} << bits) + 1, 0);
  for (const std::uint64_t key : key_) ++bucketBegin_[(key >> shift_) + 1];
  std::partial_sum(bucketBegin_.begin(), bucketBegin_.end(), bucketBegin_.begin());
}

VoxelIndex::VoxelIndex(std::span<const VoxelHits> sortedVoxels)
    : VoxelIndex([&] {
        std::vector<std::uint64_t> keys;
        keys.reserve(sortedVoxels.size());
        for (const VoxelHits& c : sortedVoxels) keys.push_back(c.key);
        return keys;
      }()) {}

std::size_t VoxelIndex::find(std::uint64_t key) const {
  if (key_.empty()) return 0;
  const std::uint64_t bucket = key >> shift_;
  for (std::uint32_t i = bucketBegin_[bucket]; i < bucketBegin_[bucket + 1]; ++i) {
    if (key_[i] == key) return i;
  }
  return key_.size();
}

SeenFacings::SeenFacings(std::size_t instances, std::span<const VoxelHits> voxels) : facings_(instances, 0) {
  for (const VoxelHits& voxel : voxels)
    facings_[voxel.facing >> 3] |= static_cast<std::uint8_t>(1u << (voxel.facing & 7u));
}

void VoxelCounter::Shard::add(const VoxelHits& hits) {
  if (2 * used >= slots.size()) {
    // Grow to twice the size.
    std::vector<VoxelHits> old(std::max<std::size_t>(1024, 2 * slots.size()));
    old.swap(slots);
    used = 0;
    for (const VoxelHits& slot : old) {
      if (slot.key != 0) add(slot);
    }
  }
  const std::size_t mask = slots.size() - 1;
  std::size_t at = hits.key & mask;
  while (slots[at].key != 0 && slots[at].key != hits.key) at = (at + 1) & mask;
  if (slots[at].key == 0) ++used;
  slots[at].key = hits.key;
  slots[at].cube = hits.cube;
  slots[at].facing = hits.facing;
  slots[at].direct += hits.direct;
  slots[at].bounced += hits.bounced;
}

void VoxelCounter::add(std::span<const VoxelHits> hits) {
  // Deal the hits to their shards, so that each is locked once.
  std::array<std::uint32_t, kShards + 1> begin{};
  const auto shardOf = [](const VoxelHits& h) { return static_cast<std::size_t>(h.key >> 58); };
  for (const VoxelHits& h : hits) ++begin[shardOf(h) + 1];
  for (std::size_t s = 0; s < kShards; ++s) begin[s + 1] += begin[s];
  std::vector<VoxelHits> dealt(hits.size());
  auto next = begin;
  for (const VoxelHits& h : hits) dealt[next[shardOf(h)]++] = h;

  for (std::size_t s = 0; s < kShards; ++s) {
    if (begin[s] == begin[s + 1]) continue;
    const std::lock_guard lock(shards_[s].mutex);
    for (std::uint32_t i = begin[s]; i < begin[s + 1]; ++i) shards_[s].add(dealt[i]);
  }
}

std::vector<VoxelHits> VoxelCounter::sorted() const {
  std::vector<VoxelHits> all;
  for (const Shard& shard : shards_) {
    for (const VoxelHits& slot : shard.slots) {
      if (slot.key != 0) all.push_back(slot);
    }
  }
  std::sort(all.begin(), all.end(), [](const VoxelHits& a, const VoxelHits& b) { return a.key < b.key; });
  return all;
}

}  // namespace relume
