// SPDX-License-Identifier: MIT
// Where a triangle crosses the sixteen columns of a voxel that run along one of the grid's axes, in the middles of the
// sixteenths of its face: how much of it lies in the voxel, and how far up. In integers of 32 bits, by the sums of
// overlap.h.
#pragma once

#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace relume {

// Axes in another order, as if turned: this one is z.
inline glm::ivec3 turned(const glm::ivec3& v, int axis) {
  return axis == 0 ? glm::ivec3(v.y, v.z, v.x) : axis == 1 ? glm::ivec3(v.z, v.x, v.y) : v;
}
inline glm::ivec3 turnedBack(const glm::ivec3& v, int axis) {
  return axis == 0 ? glm::ivec3(v.z, v.x, v.y) : axis == 1 ? glm::ivec3(v.y, v.z, v.x) : v;
}

// The axis along which a vector is longest.
inline int longestAxis(const glm::ivec3& v) {
  const glm::ivec3 size(std::abs(v.x), std::abs(v.y), std::abs(v.z));
  return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

// (v1 - v0) x (v2 - v0): twice the triangle's area long. [1/64 voxel squared]
inline glm::ivec3 areaNormal(const SnappedTriangle& t) {
  const auto edge = [&](std::size_t to, std::size_t k) { return t.corner[to][k] - t.corner[0][k]; };
  const auto part = [&](std::size_t u, std::size_t v) { return edge(1, u) * edge(2, v) - edge(1, v) * edge(2, u); };
  return {part(1, 2), part(2, 0), part(0, 1)};
}

// An edge in the projection along an axis: u p_u + v p_v + offset >= 0 inside the triangle.
struct ProjectedEdge {
  ProjectedEdge() = default;
  ProjectedEdge(int fromU, int fromV, int edgeU, int edgeV, bool facesAway)
      : u(facesAway ? edgeV : -edgeV),
        v(facesAway ? -edgeU : edgeU),
        offset(-u * fromU - v * fromV),
        longest(std::max(std::abs(u), std::abs(v))) {}
  int u = 0, v = 0, offset = 0, longest = 0;  // longest: the larger of |u| and |v|
};

class CrossedColumns {
 public:
  CrossedColumns(const SnappedTriangle& t, int axis) : CrossedColumns(t, areaNormal(t), axis) {}
  // normal: areaNormal()
  CrossedColumns(const SnappedTriangle& t, const glm::ivec3& normal, int axis)
      : normal_(turned(normal, axis)), axis_(axis) {
    const auto cornerOf = [&](std::size_t c) { return turned({t.corner[c][0], t.corner[c][1], t.corner[c][2]}, axis); };
    first_ = cornerOf(0);
    glm::ivec3 from = first_;
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::ivec3 to = c < 2 ? cornerOf(c + 1) : first_, edge = to - from;
      edge_[c] = {from.x, from.y, edge.x, edge.y, normal_.z < 0};
      from = to;
    }
  }

  int axis() const { return axis_; }
  const glm::ivec3& normal() const { return normal_; }  // areaNormal(), turned
  const std::array<ProjectedEdge, 3>& edges() const { return edge_; }

  // A bit for each of the columns that the triangle crosses within a voxel: 4 i + j for column i along the axis after
  // this one and j along the next. A column on the edge of two triangles is one's alone. None where the triangle
  // stands along the columns. [Only voxels that are overlapped]
  std::uint32_t in(const glm::ivec3& voxel) const {
    const glm::ivec3 place = firstPlace(voxel);
    // Five sums that are linear in the place: it is crossed where none is negative.
    std::array<int, 5> at, alongU, alongV;
    for (std::size_t k = 0; k < 3; ++k) {
      const ProjectedEdge& e = edge_[k];
      const bool owns = e.u > 0 || (e.u == 0 && e.v > 0);
      at[k] = e.u * place.x + e.v * place.y + e.offset - (owns ? 0 : 1);
      alongU[k] = kWide * e.u;
      alongV[k] = kWide * e.v;
    }
    const int depth = depthAt(place), reach = kVoxelSteps / 2 * std::abs(normal_.z);
    at[3] = depth + reach;
    at[4] = reach - 1 - depth;
    alongU[3] = kWide * normal_.x;
    alongU[4] = -alongU[3];
    alongV[3] = kWide * normal_.y;
    alongV[4] = -alongV[3];
    std::array<std::uint32_t, 4> crossed{};
    for (int j = 0; j < 4; ++j) {
      for (std::size_t i = 0; i < 4; ++i) {
        int anyNegative = 0;
        for (std::size_t k = 0; k < 5; ++k) anyNegative |= at[k] + static_cast<int>(i) * alongU[k];
        crossed[i] |= anyNegative >= 0 ? 1u << j : 0u;
      }
      for (std::size_t k = 0; k < 5; ++k) at[k] += alongV[k];
    }
    return crossed[0] | crossed[1] << 4 | crossed[2] << 8 | crossed[3] << 12;
  }

  // Calls visit(column, height) for each column of in(). Heights are up the axis, from the voxel's middle, rounded
  // toward it. [1/64 voxel]
  template <class Visit>
  void visit(const glm::ivec3& voxel, const Visit& visit) const {
    std::uint32_t rest = in(voxel);
    if (rest == 0) return;
    const int depth = depthAt(firstPlace(voxel));
    for (; rest != 0; rest &= rest - 1) {
      const int column = std::countr_zero(rest);
      visit(static_cast<std::size_t>(column),
            -(depth + kWide * (normal_.x * (column >> 2) + normal_.y * (column & 3))) / normal_.z);
    }
  }

 private:
  static constexpr int kWide = kVoxelSteps / 4;  // of a column

  // The middle of a voxel's first column, halfway up. [1/64 voxel]
  glm::ivec3 firstPlace(const glm::ivec3& voxel) const {
    return turned(voxel, axis_) * kVoxelSteps + glm::ivec3(kWide / 2, kWide / 2, kVoxelSteps / 2);
  }
  int depthAt(const glm::ivec3& place) const {
    const glm::ivec3 d = place - first_;
    return normal_.x * d.x + normal_.y * d.y + normal_.z * d.z;
  }

  glm::ivec3 first_{0}, normal_{0};  // turned
  int axis_;
  std::array<ProjectedEdge, 3> edge_;
};

}  // namespace relume
