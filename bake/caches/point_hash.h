// SPDX-License-Identifier: MIT
// Numbered points by place, for "who is near?". Visits in the order of insertion within a voxel, voxels in z, y, x.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace relume {

class PointHash {
 public:
  explicit PointHash(float voxel) : inverse_(1.0f / voxel), slots_(kFirstSlots) {}

  void add(std::uint32_t index, const glm::vec3& p) {
    if (2 * voxels_ >= slots_.size()) grow();
    const auto place = static_cast<std::uint32_t>(points_.size());
    points_.push_back({index, kEnd});
    Slot& slot = slots_[slotOf(key(voxelOf(p)))];
    if (slot.first == kEnd) {
      slot = {key(voxelOf(p)), place, place};
      ++voxels_;
    } else {
      points_[slot.last].next = place;
      slot.last = place;
    }
  }

  // Every point in a voxel that the cube of half width `radius` around p touches.
  template <class Visit>
  void near(const glm::vec3& p, float radius, Visit&& visit) const {
    const glm::ivec3 low = voxelOf(p - radius), high = voxelOf(p + radius);
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
          for (std::uint32_t at = slots_[slotOf(key({x, y, z}))].first; at != kEnd; at = points_[at].next) visit(points_[at].index);
        }
      }
    }
  }

  glm::ivec3 voxelOf(const glm::vec3& p) const { return glm::ivec3(glm::floor(glm::clamp(p * inverse_, -1e6f, 1e6f))); }
  static std::uint64_t key(const glm::ivec3& v) {
    const auto part = [](int c) { return static_cast<std::uint64_t>(c + (1 << 20)) & 0x1FFFFFu; };
    return part(v.x) | (part(v.y) << 21) | (part(v.z) << 42);
  }

 private:
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFu;
  static constexpr std::size_t kFirstSlots = 64;
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t first = kEnd, last = kEnd;  // of points_; first == kEnd: the slot is free
  };
  struct Point {
    std::uint32_t index, next;
  };

  // Where a voxel is, or would go.
  std::size_t slotOf(std::uint64_t voxel) const {
    std::uint64_t hash = voxel * 0x9E3779B97F4A7C15ull;
    hash ^= hash >> 32;
    std::size_t at = hash & (slots_.size() - 1);
    while (slots_[at].first != kEnd && slots_[at].key != voxel) at = (at + 1) & (slots_.size() - 1);
    return at;
  }

  void grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.first != kEnd) slots_[slotOf(slot.key)] = slot;
    }
  }

  float inverse_;
  std::vector<Slot> slots_;  // of voxels that hold points, open addressing; a power of two, at most half full
  std::vector<Point> points_;
  std::size_t voxels_ = 0;
};

}  // namespace relume
