// SPDX-License-Identifier: MIT
// Computes hit points of rays on triangles that they are known to hit, in plain IEEE operations of a fixed order. The
// results are the same on any processor; Embree's, which use approximate reciprocals, are not.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace relume {

using Corners = std::array<glm::vec3, 3>;

// Rays, the triangles that they hit, and the hit points: one lane per ray, so that compilers use vectors. All widths
// round alike.
template <unsigned Width>
struct HitPoints {
  alignas(64) float corner[9][Width], origin[3][Width], direction[3][Width], tMin[Width], tMax[Width];  // in
  alignas(64) float distance[Width];                                                                    // [m]
  alignas(64) float u[Width], v[Width];                                                                 // barycentric
  alignas(64) float facing[Width];  // [m^2] twice the area times the cosine; positive = the back was hit
  alignas(64) float edge[Width];    // negative: the ray meets an edge within rounding and may hit a neighbour, too

  void put(unsigned i, const Corners& c, const glm::vec3& from, const glm::vec3& to, float nearest, float farthest) {
    for (int k = 0; k < 9; ++k) corner[k][i] = c[static_cast<std::size_t>(k / 3)][k % 3];
    for (int k = 0; k < 3; ++k) origin[k][i] = from[k], direction[k][i] = to[k];
    tMin[i] = nearest;
    tMax[i] = farthest;
  }
  glm::vec2 barycentric(unsigned i) const { return {u[i], v[i]}; }
};

inline float largestOf(float x, float y, float z) { return std::max(std::abs(x), std::max(std::abs(y), std::abs(z))); }

// Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (JGT 2(1), 1997), for triangles that are
// known to be hit. A triangle seen edge-on divides by zero; its first corner is taken then.
template <unsigned Width>
void findHitPoints(HitPoints<Width>& p) {
  constexpr float kEdgeUlps = 8.0f;  // error of the barycentrics, relative to the numbers that they are made from
  constexpr float kSlack = kEdgeUlps * std::numeric_limits<float>::epsilon();
  for (unsigned i = 0; i < Width; ++i) {
    const float x0 = p.corner[0][i], y0 = p.corner[1][i], z0 = p.corner[2][i];
    const float ax = p.corner[3][i] - x0, ay = p.corner[4][i] - y0, az = p.corner[5][i] - z0;
    const float bx = p.corner[6][i] - x0, by = p.corner[7][i] - y0, bz = p.corner[8][i] - z0;
    const float cx = x0 - p.origin[0][i], cy = y0 - p.origin[1][i], cz = z0 - p.origin[2][i];
    const float dx = p.direction[0][i], dy = p.direction[1][i], dz = p.direction[2][i];
    const float nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;  // a x b
    const float rx = cy * dz - cz * dy, ry = cz * dx - cx * dz, rz = cx * dy - cy * dx;  // c x d
    const float facing = nx * dx + ny * dy + nz * dz;
    const float scale = 1.0f / facing;
    const float t = (nx * cx + ny * cy + nz * cz) * scale;
    const float u = (bx * rx + by * ry + bz * rz) * scale;
    const float v = -(ax * rx + ay * ry + az * rz) * scale;
    const bool finite = std::abs(t) + std::abs(u) + std::abs(v) <= std::numeric_limits<float>::max();
    const float distance = finite ? t : cx * dx + cy * dy + cz * dz;
    const float onA = std::min(1.0f, std::max(0.0f, finite ? u : 0.0f));
    p.distance[i] = std::min(p.tMax[i], std::max(p.tMin[i], distance));
    p.u[i] = onA;
    p.v[i] = std::min(1.0f - onA, std::max(0.0f, finite ? v : 0.0f));
    p.facing[i] = facing;
    const float inside = std::min(u, std::min(v, 1.0f - u - v));
    const float slack =
        kSlack * largestOf(cx, cy, cz) * (largestOf(ax, ay, az) + largestOf(bx, by, bz)) * std::abs(scale);
    p.edge[i] = finite ? inside - slack : -1.0f;
  }
}

}  // namespace relume
