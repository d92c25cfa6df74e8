// SPDX-License-Identifier: MIT
// See seen_cells.h.
#include "bake/visibility/seen_cells.h"

#include "bake/base/random.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace relume {

namespace {

// Signed axis that a normal follows most, 0..5.
std::uint32_t directionOf(const glm::vec3& normal) {
  int axis = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(normal[a]) > std::abs(normal[axis])) axis = a;
  }
  return static_cast<std::uint32_t>(2 * axis + (normal[axis] < 0.0f ? 1 : 0));
}

}  // namespace

std::uint64_t cellKey(std::uint32_t facing, const glm::ivec3& voxel) {
  std::uint64_t hash = mix64(facing);
  for (int a = 0; a < 3; ++a) hash = mix64(hash ^ static_cast<std::uint64_t>(std::int64_t{voxel[a]}));
  return std::max<std::uint64_t>(hash, 1);  // 0 marks an empty slot
}

glm::ivec3 CellGrid::voxelOf(const glm::vec3& positionWorld) const {
  glm::ivec3 voxel;
  for (int a = 0; a < 3; ++a) {
    const float v = std::floor((positionWorld[a] - origin[a]) / size);
    voxel[a] = static_cast<int>(std::clamp(v, -1e9f, 1e9f));
  }
  return voxel;
}

std::uint32_t CellGrid::facingOf(std::uint32_t instance, const glm::vec3& normalOfSide) {
  return (instance << 3) | directionOf(normalOfSide);
}

CellHits CellGrid::cell(std::uint32_t instance, const glm::vec3& positionWorld, const glm::vec3& normalOfSide) const {
  const std::uint32_t facing = facingOf(instance, normalOfSide);
  const glm::ivec3 voxel = voxelOf(positionWorld);
  return {cellKey(facing, voxel), 0, 0, voxel, facing};
}

std::uint64_t CellGrid::key(std::uint32_t instance, const glm::vec3& positionWorld,
                            const glm::vec3& normalOfSide) const {
  return cellKey(facingOf(instance, normalOfSide), voxelOf(positionWorld));
}

std::array<std::uint64_t, 2> CellGrid::keys(std::uint32_t instance, const glm::vec3& positionWorld,
                                            const glm::vec3& normal) const {
  const glm::ivec3 voxel = voxelOf(positionWorld);
  return {cellKey(facingOf(instance, normal), voxel), cellKey(facingOf(instance, -normal), voxel)};
}

std::array<std::uint64_t, 6> CellGrid::neighbours(std::uint32_t instance, const glm::vec3& positionWorld,
                                                  const glm::vec3& normalOfSide) const {
  const std::uint32_t facing = facingOf(instance, normalOfSide);
  const glm::ivec3 centre = voxelOf(positionWorld);
  std::array<std::uint64_t, 6> keys;
  for (int face = 0; face < 6; ++face) {
    glm::ivec3 voxel = centre;
    voxel[face / 2] += face % 2 == 0 ? 1 : -1;
    keys[static_cast<std::size_t>(face)] = cellKey(facing, voxel);
  }
  return keys;
}

CellIndex::CellIndex(std::vector<std::uint64_t> sortedKeys) : key_(std::move(sortedKeys)) {
  const int bits = std::clamp(static_cast<int>(std::bit_width(key_.size())), 1, 31);
  shift_ = 64 - bits;
  bucketBegin_.assign((std::size_t{1} << bits) + 1, 0);
  for (const std::uint64_t key : key_) ++bucketBegin_[(key >> shift_) + 1];
  std::partial_sum(bucketBegin_.begin(), bucketBegin_.end(), bucketBegin_.begin());
}

CellIndex::CellIndex(std::span<const CellHits> sortedCells)
    : CellIndex([&] {
        std::vector<std::uint64_t> keys;
        keys.reserve(sortedCells.size());
        for (const CellHits& c : sortedCells) keys.push_back(c.key);
        return keys;
      }()) {}

std::size_t CellIndex::find(std::uint64_t key) const {
  if (key_.empty()) return 0;
  const std::uint64_t bucket = key >> shift_;
  for (std::uint32_t i = bucketBegin_[bucket]; i < bucketBegin_[bucket + 1]; ++i) {
    if (key_[i] == key) return i;
  }
  return key_.size();
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
  slots[at].voxel = hits.voxel;
  slots[at].facing = hits.facing;
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
