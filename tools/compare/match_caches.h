// SPDX-License-Identifier: MIT
// Which cache of one bake stands where a cache of another stands: by position and normal, so that bakes with other
// light maps, grids or seeds still compare.
#pragma once

#include "relume/bake_data.h"

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace relume {

// Points sorted into the buckets of a uniform grid; finds the nearest within a bucket's size.
class PointIndex {
 public:
  // bucketSize [m] > 0. `subset` lists the points that count; it and `points` must outlive this.
  PointIndex(std::span<const glm::vec3> points, std::span<const std::uint32_t> subset, float bucketSize);

  static constexpr std::uint32_t kNothing = 0xFFFFFFFFu;
  // The point with the least distance to p, where tolerance² (1 - cosine) is added to distance² for a normal that turns
  // away; among equals, the first. kNothing when none lies within the bucket's size with a cosine above 0.7. A zero
  // normal matches zero normals only. [Size normals == points]
  std::uint32_t nearest(const glm::vec3& p, const glm::vec3& normal, std::span<const glm::vec3> normals) const;
  // The same by distance alone.
  std::uint32_t nearest(const glm::vec3& p) const;

 private:
  template <class Penalty>
  std::uint32_t search(const glm::vec3& p, const Penalty& penalty) const;

  std::span<const glm::vec3> points_;
  float bucketSize_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> buckets_;
};

struct CachePair {
  std::uint32_t a = 0, b = 0;
  float distance = 0.0f;  // [m]
};

struct CacheMatch {
  std::vector<CachePair> pairs;           // a cache of A and the nearest cache of B, ascending by a
  std::vector<std::uint32_t> partnerOfB;  // [Size n_C of B] index into pairs, or kNothing; nearest pair for caches of B
  std::uint32_t onlyInA = 0, onlyInB = 0;               // caches without a partner within the tolerance
  float surfaceTolerance = 0.0f, gridTolerance = 0.0f;  // [m]
};

// Surface caches match within the wider spacing of the two light maps, grid caches within half the wider spacing of the
// two grids.
CacheMatch matchCaches(const Bake& a, const Bake& b);

// The part that each cache stands on or near: that of the nearest surfel; PointIndex::kNothing when none is near.
// [Size n_C]
std::vector<std::uint32_t> partsOfCaches(const Bake& bake);

}  // namespace relume
