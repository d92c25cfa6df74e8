// SPDX-License-Identifier: MIT
// Numbered points by place, for "who is near?". Visits in the order of insertion within a voxel, voxels in z, y, x.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace relume {

class PointHash {
 public:
  explicit PointHash(float voxel) : inverse_(1.0f / voxel) {}
  void add(std::uint32_t index, const glm::vec3& p) { table_[key(voxelOf(p))].push_back(index); }
  void remove(std::uint32_t index, const glm::vec3& p) { std::erase(table_[key(voxelOf(p))], index); }

  // Every point in a voxel that the cube of half width `radius` around p touches.
  template <class Visit>
  void near(const glm::vec3& p, float radius, Visit&& visit) const {
    const glm::ivec3 low = voxelOf(p - radius), high = voxelOf(p + radius);
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
          const auto found = table_.find(key({x, y, z}));
          if (found == table_.end()) continue;
          for (const std::uint32_t index : found->second) visit(index);
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
  float inverse_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> table_;
};

}  // namespace relume
