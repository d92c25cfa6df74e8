// SPDX-License-Identifier: MIT
// Sorts points in space into buckets: the cubes of a regular grid, of which only the occupied ones are stored. The
// points of a row of buckets along x are contiguous, so that a neighbourhood of 3x3x3 buckets is nine runs of points.
#pragma once

#include "relume/bake/context.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class PointGrid {
 public:
  // Number of a bucket along each axis.
  struct Bucket {
    std::int64_t x, y, z;
    bool operator==(const Bucket&) const = default;
  };
  // All buckets from low to high.
  struct Box {
    Bucket low, high;
  };

  PointGrid() = default;
  // bucketSize [m] > 0. It is raised if the points' bounds would need more than 2^20 buckets along an axis.
  PointGrid(std::span<const glm::vec3> points, float bucketSize, Context& context);

  float bucketSize() const { return bucketSize_; }
  Bucket bucketOf(const glm::vec3& p) const;
  std::size_t bucketCount() const { return key_.size(); }
  // The points of occupied bucket b are order()[bucketBegin(b)] .. order()[bucketBegin(b + 1) - 1], ascending.
  std::uint32_t bucketBegin(std::size_t c) const { return begin_[c]; }
  std::span<const std::uint32_t> order() const { return order_; }

  // Visit the points in the bucket of p and in all buckets at most `rings` away from it, run by run: visit(begin, end)
  // indexes order(). Runs come in the order of their buckets.
  template <class Visit>
  void forEachRun(const glm::vec3& p, int rings, const Visit& visit) const {
    const Bucket c = bucketOf(p);
    forEachRunIn({{c.x - rings, c.y - rings, c.z - rings}, {c.x + rings, c.y + rings, c.z + rings}}, visit);
  }

  // The buckets that a cube of half width `halfWidth` [m] around p meets.
  Box boxAround(const glm::vec3& p, float halfWidth) const {
    return {bucketOf(p - glm::vec3(halfWidth)), bucketOf(p + glm::vec3(halfWidth))};
  }

  // Visit the points in the buckets of a box.
  template <class Visit>
  void forEachRunIn(const Box& box, const Visit& visit) const {
    // Within the grid: a box may have millions of rows beyond it, and all of them where the grid has no points.
    const std::int64_t z1 = std::min(box.high.z, size_.z - 1), y1 = std::min(box.high.y, size_.y - 1);
    for (std::int64_t z = std::max<std::int64_t>(box.low.z, 0); z <= z1; ++z) {
      for (std::int64_t y = std::max<std::int64_t>(box.low.y, 0); y <= y1; ++y)
        visitRow(box.low.x, box.high.x, y, z, visit);
    }
  }

  // Visit the points in the buckets exactly `ring` away from that of p.
  template <class Visit>
  void forEachRunOfShell(const glm::vec3& p, int ring, const Visit& visit) const {
    const Bucket c = bucketOf(p);
    for (std::int64_t z = c.z - ring; z <= c.z + ring; ++z) {
      for (std::int64_t y = c.y - ring; y <= c.y + ring; ++y) {
        if (z == c.z - ring || z == c.z + ring || y == c.y - ring || y == c.y + ring) {
          visitRow(c.x - ring, c.x + ring, y, z, visit);
        } else {
          visitRow(c.x - ring, c.x - ring, y, z, visit);
          visitRow(c.x + ring, c.x + ring, y, z, visit);
        }
      }
    }
  }

 private:
  std::uint64_t keyOf(const Bucket& c) const {
    return static_cast<std::uint64_t>((c.z * size_.y + c.y) * size_.x + c.x);
  }

  template <class Visit>
  void visitRow(std::int64_t x0, std::int64_t x1, std::int64_t y, std::int64_t z, const Visit& visit) const {
    if (y < 0 || y >= size_.y || z < 0 || z >= size_.z) return;
    x0 = std::max<std::int64_t>(x0, 0);
    x1 = std::min<std::int64_t>(x1, size_.x - 1);
    if (x0 > x1) return;
    const auto row = static_cast<std::size_t>(z * size_.y + y);
    const std::size_t slot = (row * kRowHash >> 20) & rowMask_;
    std::size_t c = 0, last = 0;
    if (!findRow(slot, row, c, last)) return;
    const std::uint64_t low = keyOf({x0, y, z}), high = keyOf({x1, y, z});
    c = static_cast<std::size_t>(std::lower_bound(key_.begin() + static_cast<std::ptrdiff_t>(c),
                                                  key_.begin() + static_cast<std::ptrdiff_t>(last), low) -
                                 key_.begin());
    std::size_t end = c;
    while (end < last && key_[end] <= high) ++end;
    if (c < end) visit(begin_[c], begin_[end]);
  }
  bool findRow(std::size_t slot, std::size_t row, std::size_t& first, std::size_t& last) const;

  static constexpr std::size_t kRowHash = 0x9E3779B97F4A7C15ull;
  struct Row {
    std::size_t row = static_cast<std::size_t>(-1);
    std::uint32_t first = 0, last = 0;  // occupied buckets
  };
  glm::vec3 origin_{0.0f};
  float bucketSize_ = 1.0f;
  Bucket size_{0, 0, 0};
  std::vector<std::uint64_t> key_;    // of the occupied buckets, ascending
  std::vector<std::uint32_t> begin_;  // [Size buckets + 1] into order_
  std::vector<std::uint32_t> order_;  // point indices, sorted by bucket, then index
  std::vector<Row> rows_;             // hash table of the occupied rows; power of two
  std::size_t rowMask_ = 0;
};

}  // namespace relume
