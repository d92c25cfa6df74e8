// SPDX-License-Identifier: MIT
// Counts of hits per cell of surface: a cell is what one instance shows of one side within a voxel. Many small
// triangles share a cell, a large one spans many.
#pragma once

#include "relume/bake/scene.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace relume {

struct CellHits {
  std::uint64_t key = 0;
  std::uint32_t direct = 0;   // hits straight from a receiver
  std::uint32_t bounced = 0;  // hits after a bounce
  glm::ivec3 voxel{0};        // where the cell is
  std::uint32_t facing = 0;   // instance and axis, see CellGrid::facingOf()
};

// The voxels that cut surfaces into cells.
struct CellGrid {
  glm::vec3 origin{0.0f};  // [m]
  float size = 1.0f;       // [m]

  glm::ivec3 voxelOf(const glm::vec3& positionWorld) const;
  // What a cell has in addition to its voxel: the instance, and the axis that the side's normal follows most.
  static std::uint32_t facingOf(std::uint32_t instance, const glm::vec3& normalOfSide);
  // The cell of a point, without hits.
  CellHits cell(std::uint32_t instance, const glm::vec3& positionWorld, const glm::vec3& normalOfSide) const;

  // Key of the cell of a point: instance, voxel, and which axis the side's normal follows most.
  std::uint64_t key(std::uint32_t instance, const glm::vec3& positionWorld, const glm::vec3& normalOfSide) const;
  // The keys of both sides: of the normal, and of the opposite one.
  std::array<std::uint64_t, 2> keys(std::uint32_t instance, const glm::vec3& positionWorld,
                                    const glm::vec3& normal) const;
  // Keys of the six cells that share a voxel's face with that one.
  std::array<std::uint64_t, 6> neighbours(std::uint32_t instance, const glm::vec3& positionWorld,
                                          const glm::vec3& normalOfSide) const;
};

// Key of a cell. A 64-bit hash stands for it: two of a million cells collide with probability 3e-8.
std::uint64_t cellKey(std::uint32_t facing, const glm::ivec3& voxel);

// Finds cells by their keys, in about one step: keys are hashes, so their leading bits say where they stand.
// Thread-safe.
class CellIndex {
 public:
  CellIndex() = default;
  explicit CellIndex(std::vector<std::uint64_t> sortedKeys);
  explicit CellIndex(std::span<const CellHits> sortedCells);

  std::size_t size() const { return key_.size(); }
  bool operator==(const CellIndex& other) const { return key_ == other.key_; }
  // Place of a key among the sorted ones; size() when it is not one of them.
  std::size_t find(std::uint64_t key) const;
  bool contains(std::uint64_t key) const { return find(key) < size(); }

 private:
  std::vector<std::uint64_t> key_;
  std::vector<std::uint32_t> bucketBegin_;  // [Size 2^n + 1] of the keys with the same n leading bits
  int shift_ = 0;                           // 64 - n
};

// A concurrent counter whose contents do not depend on the order of additions.
class CellCounter {
 public:
  // Add the counts of these cells. Thread-safe.
  void add(std::span<const CellHits> hits);
  // Every cell that was hit, by ascending key.
  std::vector<CellHits> sorted() const;

 private:
  static constexpr std::size_t kShards = 64;
  struct Shard {
    std::mutex mutex;
    std::vector<CellHits> slots;  // open addressing; power of two; key 0 = empty
    std::size_t used = 0;
    void add(const CellHits& hits);
  };
  std::array<Shard, kShards> shards_;
};

}  // namespace relume
