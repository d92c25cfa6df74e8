// SPDX-License-Identifier: MIT
// How far a grid cache sees, so that a receiver behind a wall does not read it: distances over the directions of an
// octahedral lattice, a byte each.
//
// The map holds t = unit / |x|_1 for the first surface point x in a direction, |x|_1 = |x| + |y| + |z| from the cache.
// With p = x / |x|_1, a point of the octahedron, a plane n.x = D gives t = unit n.p / D: linear in p. Interpolating t
// over the triangles of a lattice that respects the octahedron's edges therefore meets a wall exactly, at any angle,
// from few directions. A byte b stands for w = b / 255 = t / (1 + t): fine steps near the cache, 0 for nothing hit. The
// lattice has kDepthSide² nodes; node (m, m), m = (kDepthSide - 1) / 2, is +Z, the corners are -Z.
#pragma once

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace relume {

inline constexpr int kDepthSide = 17;  // odd
inline constexpr int kDepthHalf = kDepthSide / 2;
// Words of a cache's map: bytes row by row, low byte first, the rest of the last word zero.
inline constexpr std::uint32_t kDepthWords = (kDepthSide * kDepthSide + 3) / 4;

// Three nodes around a direction and their weights, which sum to 1.
struct DepthNodes {
  std::array<int, 3> node;
  std::array<float, 3> weight;
};

// v: any vector but zero, finite and within single precision squared (formats/limits.h); l1 = |v|_1.
inline DepthNodes depthNodesAround(const glm::vec3& v, float l1) {
  // Unfold the octahedron: a = |u|, |v| in [0, kDepthHalf]; the diagonal a.x + a.y = kDepthHalf is the equator.
  const glm::vec3 p = glm::abs(v) / l1;
  constexpr float kHalf = kDepthHalf;
  const glm::vec2 a = kHalf * (v.z >= 0.0f ? glm::vec2(p.x, p.y) : glm::vec2(1.0f - p.y, 1.0f - p.x));
  const int x = std::min(static_cast<int>(a.x), kDepthHalf - 1), y = std::min(static_cast<int>(a.y), kDepthHalf - 1);
  const float fx = a.x - static_cast<float>(x), fy = a.y - static_cast<float>(y);
  const auto node = [&](int ax, int ay) {
    return (kDepthHalf + (v.y < 0.0f ? -ay : ay)) * kDepthSide + kDepthHalf + (v.x < 0.0f ? -ax : ax);
  };
  // Squares are cut along the way of the equator.
  if (fx + fy <= 1.0f) return {{node(x, y), node(x + 1, y), node(x, y + 1)}, {1.0f - fx - fy, fx, fy}};
  return {{node(x + 1, y + 1), node(x, y + 1), node(x + 1, y)}, {fx + fy - 1.0f, 1.0f - fx, 1.0f - fy}};
}

inline float unpackDepth(std::uint32_t byte) {
  return static_cast<float>(byte) / (255.0f - std::min(static_cast<float>(byte), 254.0f));
}
// t >= 0 and finite.
inline std::uint32_t packDepth(float t) { return static_cast<std::uint32_t>(std::lrint(255.0f * t / (1.0f + t))); }

// How far behind what a cache sees a receiver still reads it: its weight falls as a Gaussian of this width, in the
// finest spacings of the grid. At a tenth of a spacing, a wall, it is 4e-6. It never ends: where every cache around is
// hidden, the least hidden ones are read.
inline constexpr float kDepthSigma = 0.02f;
// Most of the exponent: weights stay far above the smallest float.
inline constexpr float kDepthMaxExponent = 40.0f;

// depthWeight() where the map holds t toward the receiver, which is l1 = |v|_1 away.
inline float depthWeightAt(float t, float l1, const glm::vec3& v, float unit, float spacing) {
  // The surface is at 1 / s of the way.
  const float s = l1 * t / unit;
  if (s <= 1.0f) return 1.0f;
  const float behind = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z) * (1.0f - 1.0f / s) / (kDepthSigma * spacing);
  return std::exp(-std::min(0.5f * behind * behind, kDepthMaxExponent));
}

// How much of a grid cache's light a receiver reads: 1 where it lies before what the cache sees that way.
// v [m]: from cache to receiver; map: kDepthWords words; unit [m] of t; spacing [m]: the grid's finest.
inline float depthWeight(const std::uint32_t* map, const glm::vec3& v, float unit, float spacing) {
  const float l1 = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
  if (!(l1 > 0.0f)) return 1.0f;
  const DepthNodes nodes = depthNodesAround(v, l1);
  float t = 0.0f;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto n = static_cast<std::uint32_t>(nodes.node[k]);
    t += nodes.weight[k] * unpackDepth(map[n >> 2] >> (8 * (n & 3)) & 0xFFu);
  }
  return depthWeightAt(t, l1, v, unit, spacing);
}

}  // namespace relume
