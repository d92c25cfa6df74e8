// SPDX-License-Identifier: MIT
// Which of the triangles that face a side of a voxel are seen from there: a cloth that hangs before a wall hides it.
// Looked at from outside down 16 columns a side, along the grid's axis that is nearest to the voxel's; in integers.
#pragma once

#include "runtime/voxels/crossed_columns.h"
#include "runtime/voxels/snap_triangles.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace relume {

class SideColumns {
 public:
  SideColumns() = default;
  // Of a voxel with this axis. [127 times the unit vector]
  SideColumns(const glm::ivec3& voxel, const glm::ivec3& axis)
      : voxel_(voxel), along_(longestAxis(axis)), isFrontUp_(axis[along_] >= 0) {
    for (auto& side : top_) side.fill(kNone);
  }

  // A triangle that faces this side hides what lies behind it. side: 0 = front
  void add(const SnappedTriangle& t, std::size_t side) {
    visit(t, side, [&](std::size_t column, std::int8_t height) {
      std::int8_t& top = top_[side][column];
      hides_ = hides_ || (top != kNone && top != height);
      top = std::max(top, height);
    });
  }

  // What is seen of a weight that is spread over a triangle of this side: at least 1 where a column sees it first, and
  // all of it where none meets it.
  std::int64_t seenOf(std::int64_t weight, const SnappedTriangle& t, std::size_t side) const {
    if (!hides_) return weight;
    int met = 0, seen = 0;
    visit(t, side, [&](std::size_t column, std::int8_t height) {
      ++met;
      if (height + kAlike >= top_[side][column]) ++seen;
    });
    if (met == 0) return weight;
    return seen > 0 ? std::max<std::int64_t>(weight * seen / met, 1) : 0;
  }

 private:
  static constexpr int kAlike = 2;  // [1/64 voxel] so near to the outermost is as far out
  static constexpr std::int8_t kNone = std::numeric_limits<std::int8_t>::min();

  // Calls found(column, height) for the columns that a triangle crosses within the voxel. Heights are outward from its
  // middle.
  template <class Found>
  void visit(const SnappedTriangle& t, std::size_t side, const Found& found) const {
    const int outward = isFrontUp_ == (side == 0) ? 1 : -1;
    CrossedColumns(t, along_).visit(
        voxel_, [&](std::size_t column, int height) { found(column, static_cast<std::int8_t>(outward * height)); });
  }

  glm::ivec3 voxel_{0};
  int along_ = 0;                                     // axis of the grid
  bool isFrontUp_ = true;                             // the front looks up it
  std::array<std::array<std::int8_t, 16>, 2> top_{};  // heights of the outermost [1/64 voxel]
  bool hides_ = false;                                // a column has met two heights
};

}  // namespace relume
