// SPDX-License-Identifier: MIT
// Points in space sorted into cubic cells, of which only the occupied ones are stored. The points of a row of cells
// along x are contiguous, so that a neighbourhood of 3x3x3 cells is nine runs of points.
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
  struct Cell {
    std::int64_t x, y, z;
    bool operator==(const Cell&) const = default;
  };
  // All cells from low to high.
  struct Box {
    Cell low, high;
  };

  PointGrid() = default;
  // cellSize [m] > 0; it is raised where the points' bounds would need more than 2^20 cells along an axis.
  PointGrid(std::span<const glm::vec3> points, float cellSize, Context& context);

  float cellSize() const { return cellSize_; }
  Cell cellOf(const glm::vec3& p) const;
  std::size_t cellCount() const { return key_.size(); }
  // Points of cell c are order()[cellBegin(c)] .. order()[cellBegin(c + 1) - 1], ascending.
  std::uint32_t cellBegin(std::size_t c) const { return begin_[c]; }
  std::span<const std::uint32_t> order() const { return order_; }

  // Visit the runs of sorted points in the cube of cells within `rings` cells of the one that holds p: visit(begin,
  // end) indexes order(). Runs come in the order of their cells.
  template <class Visit>
  void forEachRun(const glm::vec3& p, int rings, const Visit& visit) const {
    const Cell c = cellOf(p);
    for (std::int64_t z = c.z - rings; z <= c.z + rings; ++z) {
      for (std::int64_t y = c.y - rings; y <= c.y + rings; ++y) visitRow(c.x - rings, c.x + rings, y, z, visit);
    }
  }

  // The cells that a cube of this half width [m] around p meets.
  Box boxAround(const glm::vec3& p, float halfWidth) const {
    return {cellOf(p - glm::vec3(halfWidth)), cellOf(p + glm::vec3(halfWidth))};
  }

  // The same, of the cells of a box.
  template <class Visit>
  void forEachRunIn(const Box& box, const Visit& visit) const {
    for (std::int64_t z = box.low.z; z <= box.high.z; ++z) {
      for (std::int64_t y = box.low.y; y <= box.high.y; ++y) visitRow(box.low.x, box.high.x, y, z, visit);
    }
  }

  // The same, of the cells exactly `ring` away only.
  template <class Visit>
  void forEachRunOfShell(const glm::vec3& p, int ring, const Visit& visit) const {
    const Cell c = cellOf(p);
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
  std::uint64_t keyOf(const Cell& c) const { return static_cast<std::uint64_t>((c.z * size_.y + c.y) * size_.x + c.x); }

  template <class Visit>
  void visitRow(std::int64_t x0, std::int64_t x1, std::int64_t y, std::int64_t z, const Visit& visit) const {
    if (y < 0 || y >= size_.y || z < 0 || z >= size_.z) return;
    x0 = std::max<std::int64_t>(x0, 0);
    x1 = std::min<std::int64_t>(x1, size_.x - 1);
    if (x0 > x1) return;
    const auto row = static_cast<std::size_t>(z * size_.y + y);
    const std::size_t bucket = (row * kRowHash >> 20) & rowMask_;
    std::size_t c = 0, last = 0;
    if (!findRow(bucket, row, c, last)) return;
    const std::uint64_t low = keyOf({x0, y, z}), high = keyOf({x1, y, z});
    c = static_cast<std::size_t>(std::lower_bound(key_.begin() + static_cast<std::ptrdiff_t>(c),
                                                  key_.begin() + static_cast<std::ptrdiff_t>(last), low) -
                                 key_.begin());
    std::size_t end = c;
    while (end < last && key_[end] <= high) ++end;
    if (c < end) visit(begin_[c], begin_[end]);
  }
  bool findRow(std::size_t bucket, std::size_t row, std::size_t& first, std::size_t& last) const;

  static constexpr std::size_t kRowHash = 0x9E3779B97F4A7C15ull;
  struct Row {
    std::size_t row = static_cast<std::size_t>(-1);
    std::uint32_t first = 0, last = 0;  // occupied cells
  };
  glm::vec3 origin_{0.0f};
  float cellSize_ = 1.0f;
  Cell size_{0, 0, 0};
  std::vector<std::uint64_t> key_;    // of the occupied cells, ascending
  std::vector<std::uint32_t> begin_;  // [Size cells + 1] into order_
  std::vector<std::uint32_t> order_;  // point indices, sorted by cell, then index
  std::vector<Row> rows_;             // hash table of the occupied rows; power of two
  std::size_t rowMask_ = 0;
};

}  // namespace relume
