// SPDX-License-Identifier: MIT
// Which voxels a triangle overlaps: thin, 6-separating voxelisation (Schwarz and Seidel 2010, Section 4.1) in integers
// of 32 bits. A walk from voxel to neighbouring voxel cannot pass such a surface, and no voxel is set that it does not
// need.
//
// For a voxel with centre c and half edge h = 32, of a triangle with normal N = (v1 - v0) x (v2 - v0):
//   |N . (c - v0)| <= h max |N_i|                                      the plane passes the voxel's middle
//   e . (c - v) + h max |e_i| >= 0 in each of three projections        e: inward normal of each edge at v
// Edges are at most 512 steps, so that |N_i| <= 2^19, |c - v| <= 544 and all sums stay below 2^31. Sub-voxels by the
// same tests, h = 8: along the axis N_a = max |N_i|, a row of them has one that the plane passes, or two where it
// passes between them, at k = floor(v0_a / 16 - (N_u d_u + N_v d_v) / (16 N_a)), d = c - v0.
#pragma once

#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <utility>

namespace relume {

class TriangleOverlap {
 public:
  explicit TriangleOverlap(const SnappedTriangle& t) {
    for (std::size_t c = 0; c < 3; ++c) corner_[c] = {t.corner[c][0], t.corner[c][1], t.corner[c][2]};
    const glm::ivec3 a = corner_[1] - corner_[0], b = corner_[2] - corner_[0];
    normal_ = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    const glm::ivec3 size = glm::abs(normal_);
    steepest_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3, sign = normal_[axis] < 0 ? -1 : 1;
      for (int i = 0; i < 3; ++i) {
        const glm::ivec3 &from = corner_[static_cast<std::size_t>(i)],
                         edge = corner_[static_cast<std::size_t>((i + 1) % 3)] - from;
        Edge& e = edge_[static_cast<std::size_t>(3 * axis + i)];
        e.u = -sign * edge[v];
        e.v = sign * edge[u];
        e.offset = -e.u * from[u] - e.v * from[v];
        e.longest = std::max(std::abs(e.u), std::abs(e.v));
      }
    }
  }

  // visit(voxel) for each that is overlapped, within the grid.
  template <class Visit>
  void visit(const VolumeGrid& grid, const Visit& visit) const {
    visitWithin(glm::ivec3(0), grid.voxels() - 1, visit);
  }
  // The same within the grid or not.
  template <class Visit>
  void visitAll(const Visit& visit) const {
    visitWithin(glm::ivec3(INT16_MIN), glm::ivec3(INT16_MAX), visit);
  }
  // visit(voxel, brickBit() of sub-voxels that are overlapped), within the grid; a voxel may come several times.
  template <class Visit>
  void visitSubVoxels(const VolumeGrid& grid, const Visit& visit) const {
    const auto [first, last] = boundsIn(kSubShift, glm::ivec3(0), kBrickSide * grid.voxels() - 1);
    const int a = steepest_, u = (a + 1) % 3, v = (a + 2) % 3, sign = normal_[a] < 0 ? -1 : 1;
    const int step = kSubSteps * std::abs(normal_[a]),
              begin = std::abs(normal_[a]) * (corner_[0][a] - kSubSteps * first[a]);
    glm::ivec3 s, voxel(-1);
    std::uint64_t found = 0;
    const auto add = [&] {
      if ((s >> 2) != voxel) {
        if (found != 0) visit(voxel, found);
        voxel = s >> 2;
        found = 0;
      }
      found |= std::uint64_t{1} << brickBit(s);
    };
    for (s[v] = first[v]; s[v] <= last[v]; ++s[v]) {
      for (s[u] = first[u]; s[u] <= last[u]; ++s[u]) {
        const int cu = subCentre(s[u]), cv = subCentre(s[v]);
        if (!isInside(a, cu, cv, kSubHalf)) continue;
        const int at = begin - sign * (normal_[u] * (cu - corner_[0][u]) + normal_[v] * (cv - corner_[0][v]));
        int low = first[a], high = last[a];
        if (high - low > 3) {  // a division takes as long as a few tests
          const int k = at / step - (at % step < 0 ? 1 : 0);
          low = std::max(low, first[a] + k - 1);
          high = std::min(high, first[a] + k);
        }
        for (s[a] = low; s[a] <= high; ++s[a]) {
          const int ca = subCentre(s[a]), above = at - step * (s[a] - first[a]);
          if (above >= 0 && above <= step && isInside(u, cv, ca, kSubHalf) && isInside(v, ca, cu, kSubHalf)) add();
        }
      }
    }
    if (found != 0) visit(voxel, found);
  }

  // How many of sixteen places, spread over the voxel as seen along the normal's longest axis, the triangle covers
  // within the voxel: its share of the triangle's area.
  std::uint32_t covered(const glm::ivec3& voxel) const {
    const int axis = steepest_, u = (axis + 1) % 3, v = (axis + 2) % 3, reach = this->reach();
    constexpr int kQuarter = kVoxelSteps / 4;
    std::uint32_t count = 0;
    glm::ivec3 p;
    p[axis] = centre(voxel[axis]);
    for (int i = 0; i < 16; ++i) {
      p[u] = voxel[u] * kVoxelSteps + kQuarter / 2 + (i & 3) * kQuarter;
      p[v] = voxel[v] * kVoxelSteps + kQuarter / 2 + (i >> 2) * kQuarter;
      bool in = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge& e = edge_[3 * static_cast<std::size_t>(axis) + k];
        const int inside = e.u * p[u] + e.v * p[v] + e.offset;
        // A place on the edge of two triangles is one's alone.
        in = in && (inside > 0 || (inside == 0 && (e.u > 0 || (e.u == 0 && e.v > 0))));
      }
      const glm::ivec3 d = p - corner_[0];
      const int depth = normal_.x * d.x + normal_.y * d.y + normal_.z * d.z;
      if (in && depth >= -reach && depth < reach) ++count;
    }
    return count;
  }

 private:
  static constexpr int kHalf = kVoxelSteps / 2, kSubSteps = 1 << kSubShift, kSubHalf = kSubSteps / 2;
  struct Edge {
    int u = 0, v = 0, offset = 0, longest = 0;  // longest: the larger of |u| and |v|
  };
  static int centre(int voxel) { return voxel * kVoxelSteps + kHalf; }
  static int subCentre(int sub) { return sub * kSubSteps + kSubHalf; }
  int reach() const { return kHalf * std::abs(normal_[steepest_]); }
  // What the triangle's bounds touch of voxels, or of sub-voxels, within [lowest, highest].
  std::pair<glm::ivec3, glm::ivec3> boundsIn(int shift, const glm::ivec3& lowest, const glm::ivec3& highest) const {
    glm::ivec3 first, last;
    for (int k = 0; k < 3; ++k) {
      const int low = std::min({corner_[0][k], corner_[1][k], corner_[2][k]}),
                high = std::max({corner_[0][k], corner_[1][k], corner_[2][k]});
      first[k] = std::max((low - 1) >> shift, lowest[k]);
      last[k] = std::min(high >> shift, highest[k]);
    }
    return {first, last};
  }
  template <class Visit>
  void visitWithin(const glm::ivec3& lowest, const glm::ivec3& highest, const Visit& visit) const {
    const auto [first, last] = boundsIn(kVoxelShift, lowest, highest);
    const int reach = this->reach();
    glm::ivec3 v;
    for (v.z = first.z; v.z <= last.z; ++v.z) {
      for (v.y = first.y; v.y <= last.y; ++v.y) {
        const int cy = centre(v.y), cz = centre(v.z);
        if (!isInside(0, cy, cz, kHalf)) continue;
        for (v.x = first.x; v.x <= last.x; ++v.x) {
          const int cx = centre(v.x);
          const glm::ivec3 d = glm::ivec3(cx, cy, cz) - corner_[0];
          if (std::abs(normal_.x * d.x + normal_.y * d.y + normal_.z * d.z) <= reach && isInside(1, cz, cx, kHalf) &&
              isInside(2, cx, cy, kHalf))
            visit(v);
        }
      }
    }
  }
  // Of the projection along an axis. half: an edge of what has its middle there, halved.
  bool isInside(int axis, int cu, int cv, int half) const {
    for (int i = 3 * axis; i < 3 * axis + 3; ++i) {
      const Edge& e = edge_[static_cast<std::size_t>(i)];
      if (e.u * cu + e.v * cv + e.offset + half * e.longest < 0) return false;
    }
    return true;
  }

  std::array<glm::ivec3, 3> corner_;
  glm::ivec3 normal_{0};
  int steepest_ = 0;  // axis along which the normal is longest
  std::array<Edge, 9> edge_;
};

}  // namespace relume
