// SPDX-License-Identifier: MIT
// Counts hits per voxel. Space is cut into cubes, and a voxel is what one instance shows of one side within one cube,
// so that a wall and the picture on it, or the two faces of a door, are told apart. Many small triangles share a voxel;
// a large one spans many.
#pragma once

#include "relume/bake/scene.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace relume {

struct VoxelHits {
  std::uint64_t key = 0;
  std::uint32_t direct = 0;   // hits straight from a receiver
  std::uint32_t bounced = 0;  // hits after a bounce
  glm::ivec3 cube{0};         // number of its cube along each axis
  std::uint32_t facing = 0;   // its instance and side, see VoxelGrid::facingOf()
};

// The cubes that cut surfaces into voxels.
struct VoxelGrid {
  glm::vec3 origin{0.0f};  // [m]
  float size = 1.0f;       // [m]

  // Inline, as it is asked for each part of each triangle.
  glm::ivec3 cubeOf(const glm::vec3& positionWorld) const {
    glm::ivec3 cube;
    for (int a = 0; a < 3; ++a) {
      // std::floor() would be a call: processors of the first x86-64 cannot round by one instruction.
      const float v = std::clamp((positionWorld[a] - origin[a]) / size, -1e9f, 1e9f);
      const int towardsZero = static_cast<int>(v);
      cube[a] = towardsZero - (v < static_cast<float>(towardsZero) ? 1 : 0);
    }
    return cube;
  }
  // What tells the voxels of one cube apart: the instance, and the signed axis nearest to the side's normal.
  static std::uint32_t facingOf(std::uint32_t instance, const glm::vec3& normalOfSide) {
    return facingsOf(instance, normalOfSide)[0];
  }
  // Those of a surface's two sides: of its normal, and of the opposite one.
  static std::array<std::uint32_t, 2> facingsOf(std::uint32_t instance, const glm::vec3& normal) {
    std::uint32_t axis = 0;
    float most = std::abs(normal.x), along = normal.x;
    if (std::abs(normal.y) > most) axis = 1, most = std::abs(normal.y), along = normal.y;
    if (std::abs(normal.z) > most) axis = 2, along = normal.z;
    const std::uint32_t first = (instance << 3) | 2 * axis;
    return {first + (along < 0.0f ? 1u : 0u), first + (along > 0.0f ? 1u : 0u)};
  }
  // The voxel of a point, without hits.
  VoxelHits voxel(std::uint32_t instance, const glm::vec3& positionWorld, const glm::vec3& normalOfSide) const;

  // The key of that voxel.
  std::uint64_t key(std::uint32_t instance, const glm::vec3& positionWorld, const glm::vec3& normalOfSide) const;
  // Keys of the same instance and side in the six cubes that share a face with one.
  static std::array<std::uint64_t, 6> neighbours(std::uint32_t facing, const glm::ivec3& centre);
};

// Identifies a voxel by a 64-bit hash of its facing and cube. Among a million voxels, two collide with probability
// 3e-8.
std::uint64_t voxelKey(std::uint32_t facing, const glm::ivec3& cube);

// Finds voxels by their keys in about one step: keys are hashes, so their leading bits tell their rank among the sorted
// ones. Thread-safe.
class VoxelIndex {
 public:
  VoxelIndex() = default;
  explicit VoxelIndex(std::vector<std::uint64_t> sortedKeys);
  explicit VoxelIndex(std::span<const VoxelHits> sortedVoxels);

  std::size_t size() const { return key_.size(); }
  std::span<const std::uint64_t> keys() const { return key_; }
  bool operator==(const VoxelIndex& other) const { return key_ == other.key_; }
  // Index of a key among the sorted ones; size() when it is not one of them.
  std::size_t find(std::uint64_t key) const;
  bool contains(std::uint64_t key) const { return find(key) < size(); }

 private:
  std::vector<std::uint64_t> key_;
  std::vector<std::uint32_t> bucketBegin_;  // [Size 2^n + 1] first of the keys with the same n leading bits
  int shift_ = 0;                           // 64 - n
};

// Which sides of which instances have voxels at all.
class SeenFacings {
 public:
  SeenFacings(std::size_t instances, std::span<const VoxelHits> voxels);
  // facing: VoxelGrid::facingOf()
  bool has(std::uint32_t facing) const { return (facings_[facing >> 3] >> (facing & 7u) & 1u) != 0; }
  bool hasAny(std::uint32_t instance) const { return facings_[instance] != 0; }

 private:
  std::vector<std::uint8_t> facings_;  // [Size instances] a bit for each of six
};

// What is known of a few voxels, so that triangles that lie in the same ones do not ask again. For one thread.
template <class Value>
class VoxelMemo {
 public:
  // The value of a voxel: find() where it is not known.
  template <class Find>
  Value of(std::uint32_t facing, const glm::ivec3& cube, const Find& find) {
    const glm::uvec3 at(cube);
    Known& known = known_[((at.x + 3u * at.y + 5u * at.z) * 8u + facing) % kSlots];
    if (known.facing != facing || known.cube != cube) known = {cube, facing, find()};
    return known.value;
  }

 private:
  static constexpr std::uint32_t kSlots = 64;
  struct Known {
    glm::ivec3 cube{0};
    std::uint32_t facing = kNone;
    Value value{};
  };
  std::array<Known, kSlots> known_;
};

// A concurrent counter whose contents do not depend on the order of additions.
class VoxelCounter {
 public:
  // Add the counts of these voxels, of which some may be the same. Thread-safe.
  void add(std::span<const VoxelHits> hits);
  // Every voxel that was hit, by ascending key.
  std::vector<VoxelHits> sorted() const;

 private:
  static constexpr std::size_t kShards = 64;
  struct Shard {
    std::mutex mutex;
    std::vector<VoxelHits> slots;  // open addressing; power of two; key 0 = empty
    std::size_t used = 0;
    void add(const VoxelHits& hits);
  };
  std::array<Shard, kShards> shards_;
};

}  // namespace relume
