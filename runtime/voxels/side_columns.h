// SPDX-License-Identifier: MIT
// Which of the triangles that face a side of a voxel are seen from there: a cloth that hangs before a wall hides it.
// Looked at from outside down 16 columns a side, along the grid's axis that is nearest to the voxel's; in integers.
#pragma once

#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/common.hpp>
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
  SideColumns(const glm::ivec3& voxel, const glm::ivec3& axis) : middle_(voxel * kVoxelSteps + kHalf) {
    const glm::ivec3 size = glm::abs(axis);
    along_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    isFrontUp_ = axis[along_] >= 0;
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
  static constexpr int kHalf = kVoxelSteps / 2, kWide = kVoxelSteps / kBrickSide;
  static constexpr int kAlike = 2;  // [1/64 voxel] so near to the outermost is as far out
  static constexpr std::int8_t kNone = std::numeric_limits<std::int8_t>::min();

  using Corner = std::array<int, 3>;  // along the two axes across the columns and along them [1/64 voxel]

  // Twice the signed area of two corners and a place, across the columns
  static int areaOf(const Corner& a, const Corner& b, int x, int y) {
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
  }

  // Calls found(column, height) for the columns that meet a triangle within the voxel. Heights are outward from its
  // middle.
  template <class Found>
  void visit(const SnappedTriangle& t, std::size_t side, const Found& found) const {
    const int outward = isFrontUp_ == (side == 0) ? 1 : -1;
    std::array<Corner, 3> corner{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto a = (static_cast<std::size_t>(along_) + 1 + k) % 3;
        corner[i][k] = t.corner[i][a] - middle_[static_cast<int>(a)];
      }
    }
    const int whole = areaOf(corner[0], corner[1], corner[2][0], corner[2][1]);
    if (whole == 0) return;

    // Columns stand in the middles of quarters; those that its bounds hold
    const auto from = [&](std::size_t k) {
      const int low = std::min({corner[0][k], corner[1][k], corner[2][k]}) + kHalf;
      return low <= kWide / 2 ? 0 : (low + kWide / 2 - 1) / kWide;
    };
    const auto to = [&](std::size_t k) {
      const int high = std::max({corner[0][k], corner[1][k], corner[2][k]}) + kHalf - kWide / 2;
      return high < 0 ? -1 : std::min(high / kWide, kBrickSide - 1);
    };
    for (int j = from(1); j <= to(1); ++j) {
      for (int i = from(0); i <= to(0); ++i) {
        const int x = i * kWide + kWide / 2 - kHalf, y = j * kWide + kWide / 2 - kHalf;
        const std::array<int, 3> part{areaOf(corner[1], corner[2], x, y), areaOf(corner[2], corner[0], x, y),
                                      areaOf(corner[0], corner[1], x, y)};
        if (std::min({part[0], part[1], part[2]}) < 0 && std::max({part[0], part[1], part[2]}) > 0) continue;
        std::int64_t sum = 0;
        for (std::size_t k = 0; k < 3; ++k) sum += std::int64_t{part[k]} * corner[k][2];
        const std::int64_t height = outward * (sum / whole);
        if (height < -kHalf || height > kHalf) continue;
        found(static_cast<std::size_t>(kBrickSide * j + i), static_cast<std::int8_t>(height));
      }
    }
  }

  glm::ivec3 middle_{0};                              // of the voxel [1/64 voxel]
  int along_ = 0;                                     // axis of the grid
  bool isFrontUp_ = true;                             // the front looks up it
  std::array<std::array<std::int8_t, 16>, 2> top_{};  // heights of the outermost [1/64 voxel]
  bool hides_ = false;                                // a column has met two heights
};

}  // namespace relume
