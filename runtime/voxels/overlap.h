// SPDX-License-Identifier: MIT
// Which voxels a triangle overlaps: thin, 6-separating voxelisation (Schwarz and Seidel 2010, Section 4.1) in integers
// of 32 bits. A walk from voxel to neighbouring voxel cannot pass such a surface, and no voxel is set that it does not
// need.
//
// For a voxel with centre c and half edge h = 32, of a triangle with normal N = (v1 - v0) x (v2 - v0):
//   |N . (c - v0)| <= h max |N_i|                                      the plane passes the voxel's middle
//   e . (c - v) + h max |e_i| >= 0 in each of three projections        e: inward normal of each edge at v
// Edges are at most 512 steps, so that |N_i| <= 2^19, |c - v| <= 544 and all sums stay below 2^31. Sub-voxels by the
// same tests, h = 8. Along the axis a of N_a = max |N_i| a row of either has one that the plane passes, or two where it
// passes between them, at k = floor(v0_a / 2h - (N_u d_u + N_v d_v) / (2h N_a)), d = c - v0.
#pragma once

#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace relume {

class TriangleOverlap {
 public:
  explicit TriangleOverlap(const SnappedTriangle& t) {
    for (std::size_t c = 0; c < 3; ++c) corner_[c] = {t.corner[c][0], t.corner[c][1], t.corner[c][2]};
    const glm::ivec3 a = corner_[1] - corner_[0], b = corner_[2] - corner_[0],
                     normal(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x),
                     size = glm::abs(normal);
    steepest_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    normal_ = turned(normal);
    for (glm::ivec3& corner : corner_) corner = turned(corner);
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::ivec3 &from = corner_[c], edge = corner_[(c + 1) % 3] - from;
      along_[0][c] = {from.y, from.z, edge.y, edge.z, normal_.x < 0};
      along_[1][c] = {from.z, from.x, edge.z, edge.x, normal_.y < 0};
      along_[2][c] = {from.x, from.y, edge.x, edge.y, normal_.z < 0};
    }
  }

  // visit(voxel) for each that is overlapped, within the grid.
  template <class Visit>
  void visit(const VolumeGrid& grid, const Visit& visit) const {
    visitEach<kVoxelShift>(glm::ivec3(0), grid.voxels() - 1, visit);
  }
  // The same within the grid or not.
  template <class Visit>
  void visitAll(const Visit& visit) const {
    visitEach<kVoxelShift>(glm::ivec3(INT16_MIN), glm::ivec3(INT16_MAX), visit);
  }
  // visit(voxel, brickBit() of sub-voxels that are overlapped), within the grid; a voxel may come several times.
  template <class Visit>
  void visitSubVoxels(const VolumeGrid& grid, const Visit& visit) const {
    glm::ivec3 voxel(-1);
    std::uint64_t found = 0;
    visitEach<kSubShift>(glm::ivec3(0), kBrickSide * grid.voxels() - 1, [&](const glm::ivec3& s) {
      if ((s >> 2) != voxel) {
        if (found != 0) visit(voxel, found);
        voxel = s >> 2;
        found = 0;
      }
      found |= std::uint64_t{1} << brickBit(s);
    });
    if (found != 0) visit(voxel, found);
  }

  // How many of sixteen places, spread over the voxel as seen along the normal's longest axis, the triangle covers
  // within the voxel: its share of the triangle's area.
  std::uint32_t covered(const glm::ivec3& voxel) const {
    constexpr int kQuarter = kVoxelSteps / 4;
    const glm::ivec3 first =  // place
        turned(voxel) * kVoxelSteps + glm::ivec3(kQuarter / 2, kQuarter / 2, kVoxelSteps / 2);
    // Five sums that are linear in the place: it is covered where none is negative.
    std::array<int, 5> at, alongU, alongV;
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge& e = along_[2][k];
      // A place on the edge of two triangles is one's alone.
      const bool owns = e.u > 0 || (e.u == 0 && e.v > 0);
      at[k] = e.u * first.x + e.v * first.y + e.offset - (owns ? 0 : 1);
      alongU[k] = kQuarter * e.u;
      alongV[k] = kQuarter * e.v;
    }
    const glm::ivec3 d = first - corner_[0];
    const int depth = normal_.x * d.x + normal_.y * d.y + normal_.z * d.z,
              reach = kVoxelSteps / 2 * std::abs(normal_.z);
    at[3] = depth + reach;
    at[4] = reach - 1 - depth;
    alongU[3] = kQuarter * normal_.x;
    alongU[4] = -alongU[3];
    alongV[3] = kQuarter * normal_.y;
    alongV[4] = -alongV[3];
    std::array<int, 4> uncovered{};
    for (int j = 0; j < 4; ++j) {
      for (std::size_t i = 0; i < 4; ++i) {
        int anyNegative = 0;
        for (std::size_t k = 0; k < 5; ++k) anyNegative |= at[k] + static_cast<int>(i) * alongU[k];
        uncovered[i] += anyNegative < 0 ? 1 : 0;
      }
      for (std::size_t k = 0; k < 5; ++k) at[k] += alongV[k];
    }
    return 16 - static_cast<std::uint32_t>(uncovered[0] + uncovered[1] + uncovered[2] + uncovered[3]);
  }

 private:
  // Of an edge in a projection along an axis: u p_u + v p_v + offset >= 0 inside.
  struct Edge {
    Edge() = default;
    Edge(int fromU, int fromV, int edgeU, int edgeV, bool facesAway)
        : u(facesAway ? edgeV : -edgeV),
          v(facesAway ? -edgeU : edgeU),
          offset(-u * fromU - v * fromV),
          longest(std::max(std::abs(u), std::abs(v))) {}
    int u = 0, v = 0, offset = 0, longest = 0;  // longest: the larger of |u| and |v|
  };
  using Edges = std::array<Edge, 3>;

  // Axes in another order, as if turned: the steepest one is z.
  glm::ivec3 turned(const glm::ivec3& v) const {
    return steepest_ == 0 ? glm::ivec3(v.y, v.z, v.x) : steepest_ == 1 ? glm::ivec3(v.z, v.x, v.y) : v;
  }
  glm::ivec3 turnedBack(const glm::ivec3& v) const {
    return steepest_ == 0 ? glm::ivec3(v.z, v.x, v.y) : steepest_ == 1 ? glm::ivec3(v.y, v.z, v.x) : v;
  }
  // half: an edge of what has its middle there, halved.
  static bool isInside(const Edges& edges, int cu, int cv, int half) {
    for (const Edge& e : edges) {
      if (e.u * cu + e.v * cv + e.offset + half * e.longest < 0) return false;
    }
    return true;
  }

  // visit(cube) for each cube of 1 << kShift steps within [lowest, highest] that is overlapped.
  template <int kShift, class Visit>
  void visitEach(const glm::ivec3& lowest, const glm::ivec3& highest, const Visit& visit) const {
    constexpr int kSteps = 1 << kShift, kHalf = kSteps / 2;
    const glm::ivec3 first =
        glm::max((glm::min(corner_[0], glm::min(corner_[1], corner_[2])) - 1) >> kShift, turned(lowest));
    const glm::ivec3 last = glm::min(glm::max(corner_[0], glm::max(corner_[1], corner_[2])) >> kShift, turned(highest));
    if (glm::any(glm::greaterThan(first, last))) return;
    const int sign = normal_.z < 0 ? -1 : 1, step = kSteps * std::abs(normal_.z),
              begin = std::abs(normal_.z) * (corner_[0].z - kSteps * first.z);
    glm::ivec3 s;
    for (s.y = first.y; s.y <= last.y; ++s.y) {
      const int cv = s.y * kSteps + kHalf;
      for (s.x = first.x; s.x <= last.x; ++s.x) {
        const int cu = s.x * kSteps + kHalf;
        if (!isInside(along_[2], cu, cv, kHalf)) continue;
        // Where the plane passes the row, from the first cube's bottom
        const int at = begin - sign * (normal_.x * (cu - corner_[0].x) + normal_.y * (cv - corner_[0].y));
        int low = first.z, high = last.z;
        if (high - low > 3) {  // a division takes as long as a few tests
          const int k = at / step - (at % step < 0 ? 1 : 0);
          low = std::max(low, first.z + k - 1);
          high = std::min(high, first.z + k);
        }
        for (s.z = low; s.z <= high; ++s.z) {
          const int ca = s.z * kSteps + kHalf, above = at - step * (s.z - first.z);
          if (above >= 0 && above <= step && isInside(along_[0], cv, ca, kHalf) && isInside(along_[1], ca, cu, kHalf))
            visit(turnedBack(s));
        }
      }
    }
  }

  int steepest_ = 0;  // axis along which the normal is longest
  std::array<glm::ivec3, 3> corner_;
  glm::ivec3 normal_{0};
  std::array<Edges, 3> along_;  // in the projection along each axis
};

}  // namespace relume
