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

#include "runtime/voxels/crossed_columns.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace relume {

class TriangleOverlap {
 public:
  explicit TriangleOverlap(const SnappedTriangle& t) : TriangleOverlap(t, areaNormal(t)) {}

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
    return static_cast<std::uint32_t>(std::popcount(columns_.in(voxel)));
  }

 private:
  using Edges = std::array<ProjectedEdge, 3>;

  TriangleOverlap(const SnappedTriangle& t, const glm::ivec3& normal) : columns_(t, normal, longestAxis(normal)) {
    for (std::size_t c = 0; c < 3; ++c)
      corner_[c] = turned({t.corner[c][0], t.corner[c][1], t.corner[c][2]}, columns_.axis());
    const glm::ivec3& n = columns_.normal();
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::ivec3 &from = corner_[c], edge = corner_[(c + 1) % 3] - from;
      along_[0][c] = {from.y, from.z, edge.y, edge.z, n.x < 0};
      along_[1][c] = {from.z, from.x, edge.z, edge.x, n.y < 0};
    }
  }

  // half: an edge of what has its middle there, halved.
  static bool isInside(const Edges& edges, int cu, int cv, int half) {
    for (const ProjectedEdge& e : edges) {
      if (e.u * cu + e.v * cv + e.offset + half * e.longest < 0) return false;
    }
    return true;
  }

  // visit(cube) for each cube of 1 << kShift steps within [lowest, highest] that is overlapped.
  template <int kShift, class Visit>
  void visitEach(const glm::ivec3& lowest, const glm::ivec3& highest, const Visit& visit) const {
    constexpr int kSteps = 1 << kShift, kHalf = kSteps / 2;
    const glm::ivec3 first = glm::max((glm::min(corner_[0], glm::min(corner_[1], corner_[2])) - 1) >> kShift,
                                      turned(lowest, columns_.axis()));
    const glm::ivec3 last =
        glm::min(glm::max(corner_[0], glm::max(corner_[1], corner_[2])) >> kShift, turned(highest, columns_.axis()));
    if (glm::any(glm::greaterThan(first, last))) return;
    const glm::ivec3& n = columns_.normal();
    const int sign = n.z < 0 ? -1 : 1, step = kSteps * std::abs(n.z),
              begin = std::abs(n.z) * (corner_[0].z - kSteps * first.z);
    glm::ivec3 s;
    for (s.y = first.y; s.y <= last.y; ++s.y) {
      const int cv = s.y * kSteps + kHalf;
      for (s.x = first.x; s.x <= last.x; ++s.x) {
        const int cu = s.x * kSteps + kHalf;
        if (!isInside(columns_.edges(), cu, cv, kHalf)) continue;
        // Where the plane passes the row, from the first cube's bottom
        const int at = begin - sign * (n.x * (cu - corner_[0].x) + n.y * (cv - corner_[0].y));
        int low = first.z, high = last.z;
        if (high - low > 3) {  // a division takes as long as a few tests
          const int k = at / step - (at % step < 0 ? 1 : 0);
          low = std::max(low, first.z + k - 1);
          high = std::min(high, first.z + k);
        }
        for (s.z = low; s.z <= high; ++s.z) {
          const int ca = s.z * kSteps + kHalf, above = at - step * (s.z - first.z);
          if (above >= 0 && above <= step && isInside(along_[0], cv, ca, kHalf) && isInside(along_[1], ca, cu, kHalf))
            visit(turnedBack(s, columns_.axis()));
        }
      }
    }
  }

  CrossedColumns columns_;            // along the axis along which the normal is longest: z of what is turned
  std::array<glm::ivec3, 3> corner_;  // turned
  std::array<Edges, 2> along_;        // in the projections along the other axes
};

}  // namespace relume
