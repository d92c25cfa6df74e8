// SPDX-License-Identifier: MIT
// Which voxels a triangle overlaps: thin, 6-separating voxelisation (Schwarz and Seidel 2010, Section 4.1) in integers
// of 32 bits. A walk from voxel to neighbouring voxel cannot pass such a surface, and no voxel is set that it does not
// need.
//
// For a voxel with centre c and half edge h = 32, of a triangle with normal N = (v1 - v0) x (v2 - v0):
//   |N . (c - v0)| <= h max |N_i|                                      the plane passes the voxel's middle
//   e . (c - v) + h max |e_i| >= 0 in each of three projections        e: inward normal of each edge at v
// Edges are at most 512 steps, so that |N_i| <= 2^19, |c - v| <= 544 and all sums stay below 2^31.
#pragma once

#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>

namespace relume {

class TriangleOverlap {
 public:
  explicit TriangleOverlap(const SnappedTriangle& t) {
    for (std::size_t c = 0; c < 3; ++c) corner_[c] = {t.corner[c][0], t.corner[c][1], t.corner[c][2]};
    const glm::ivec3 a = corner_[1] - corner_[0], b = corner_[2] - corner_[0];
    normal_ = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    reach_ = kHalf * std::max({std::abs(normal_.x), std::abs(normal_.y), std::abs(normal_.z)});
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3, sign = normal_[axis] < 0 ? -1 : 1;
      for (int i = 0; i < 3; ++i) {
        const glm::ivec3 &from = corner_[static_cast<std::size_t>(i)],
                         edge = corner_[static_cast<std::size_t>((i + 1) % 3)] - from;
        Edge& e = edge_[static_cast<std::size_t>(3 * axis + i)];
        e.u = -sign * edge[v];
        e.v = sign * edge[u];
        e.offset = kHalf * std::max(std::abs(e.u), std::abs(e.v)) - e.u * from[u] - e.v * from[v];
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

  // How many of sixteen places, spread over the voxel as seen along the normal's longest axis, the triangle covers
  // within the voxel: its share of the triangle's area.
  std::uint32_t covered(const glm::ivec3& voxel) const {
    const glm::ivec3 size = glm::abs(normal_);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
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
        const int inside = e.u * p[u] + e.v * p[v] + e.offset - kHalf * std::max(std::abs(e.u), std::abs(e.v));
        // A place on the edge of two triangles is one's alone.
        in = in && (inside > 0 || (inside == 0 && (e.u > 0 || (e.u == 0 && e.v > 0))));
      }
      const glm::ivec3 d = p - corner_[0];
      const int depth = normal_.x * d.x + normal_.y * d.y + normal_.z * d.z;
      if (in && depth >= -reach_ && depth < reach_) ++count;
    }
    return count;
  }

 private:
  static constexpr int kHalf = kVoxelSteps / 2;
  struct Edge {
    int u = 0, v = 0, offset = 0;
  };
  static int centre(int voxel) { return voxel * kVoxelSteps + kHalf; }
  template <class Visit>
  void visitWithin(const glm::ivec3& lowest, const glm::ivec3& highest, const Visit& visit) const {
    glm::ivec3 first, last;
    for (int k = 0; k < 3; ++k) {
      const int low = std::min({corner_[0][k], corner_[1][k], corner_[2][k]}),
                high = std::max({corner_[0][k], corner_[1][k], corner_[2][k]});
      first[k] = std::max((low - 1) >> kVoxelShift, lowest[k]);
      last[k] = std::min(high >> kVoxelShift, highest[k]);
    }
    glm::ivec3 v;
    for (v.z = first.z; v.z <= last.z; ++v.z) {
      for (v.y = first.y; v.y <= last.y; ++v.y) {
        const int cy = centre(v.y), cz = centre(v.z);
        if (!isInside(0, cy, cz)) continue;
        for (v.x = first.x; v.x <= last.x; ++v.x) {
          const int cx = centre(v.x);
          if (isNearPlane({cx, cy, cz}) && isInside(1, cz, cx) && isInside(2, cx, cy)) visit(v);
        }
      }
    }
  }
  bool isNearPlane(const glm::ivec3& c) const {
    const glm::ivec3 d = c - corner_[0];
    return std::abs(normal_.x * d.x + normal_.y * d.y + normal_.z * d.z) <= reach_;
  }
  // Of the projection along an axis.
  bool isInside(std::size_t axis, int cu, int cv) const {
    for (std::size_t i = 3 * axis; i < 3 * axis + 3; ++i) {
      if (edge_[i].u * cu + edge_[i].v * cv + edge_[i].offset < 0) return false;
    }
    return true;
  }

  std::array<glm::ivec3, 3> corner_;
  glm::ivec3 normal_{0};
  int reach_ = 0;
  std::array<Edge, 9> edge_;
};

}  // namespace relume
