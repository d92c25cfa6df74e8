// SPDX-License-Identifier: MIT
// Cuts triangles into parts small enough for the voxels of seen_voxels.h, and visits the parts.
#pragma once

#include "bake/base/parallel.h"
#include "bake/visibility/voxel_tree.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace relume {

inline glm::vec3 pointOf(const std::array<glm::vec3, 3>& c, const glm::vec2& b) {
  return c[0] + (c[1] - c[0]) * b.x + (c[2] - c[0]) * b.y;
}

// Normal of the front, from the world-space corners; its length is twice the area.
inline glm::vec3 crossOf(const std::array<glm::vec3, 3>& c) { return glm::cross(c[1] - c[0], c[2] - c[0]); }

// Visit the triangles of all baked instances in parallel: visit(instance, triangle, corners, area). Triangles without
// area are left out.
template <class Visit>
void forEachTriangle(const Scene& scene, Context& context, const Visit& visit) {
  // Small chunks: large triangles, which have many parts, often follow one another.
  parallelChunks(context, "", scene.triangleCount(), 128, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::uint32_t i = scene.instanceOf(static_cast<std::uint32_t>(t));
      const Instance& instance = scene.instances[i];
      if (!instance.baked()) continue;
      const auto triangle = static_cast<std::uint32_t>(t) - instance.firstTriangle;
      const auto corners = scene.corners(instance, triangle);
      const float area = 0.5f * glm::length(crossOf(corners));
      if (area > 0.0f && std::isfinite(area)) visit(i, triangle, corners, area);
    }
  });
}

// A triangle cut into n² equal triangles, n along an edge, small enough for the voxels. A square of the barycentric
// plane has two of them: the centre of one is at (1/3, 1/3) of the square, the other's at (2/3, 2/3).
struct TriangleParts {
  static constexpr double kMax = 4194304.0;  // most parts along an edge
  static constexpr std::uint32_t kFew = 64;  // with fewer along an edge, the tree does not pay

  std::uint32_t along = 1;
  double count() const { return static_cast<double>(along) * along; }

  TriangleParts(float area, float voxelSize) {
    const float wanted = std::ceil(2.0f * std::sqrt(area) / voxelSize);
    along = static_cast<std::uint32_t>(std::clamp(static_cast<double>(wanted), 1.0, kMax));
  }

  // Barycentric centre of part k of a row, which has 2 (along - row) - 1 parts.
  glm::vec2 centre(std::uint32_t row, std::uint32_t k) const {
    const float inner = k % 2 == 0 ? 1.0f : 2.0f;
    if (along > 1024u) {  // floats could not tell neighbours apart
      const double third = 1.0 / (3.0 * along);
      return {third * (3.0 * (k / 2) + static_cast<double>(inner)), third * (3.0 * row + static_cast<double>(inner))};
    }
    const float third = 1.0f / (3.0f * static_cast<float>(along));
    return {third * (3.0f * static_cast<float>(k / 2) + inner), third * (3.0f * static_cast<float>(row) + inner)};
  }
};

// A block of squares of a triangle's barycentric plane.
struct PartBlock {
  std::uint32_t column, row, width;  // [squares]
};

// The box around a block. [m]
inline std::array<glm::vec3, 2> boxOf(const std::array<glm::vec3, 3>& corners, std::uint32_t along,
                                      const PartBlock& block) {
  const double each = 1.0 / along;
  glm::vec3 low(INFINITY), high(-INFINITY);
  for (std::uint32_t k = 0; k < 4; ++k) {
    const glm::vec2 b((block.column + (k & 1u) * block.width) * each, (block.row + (k >> 1) * block.width) * each);
    const glm::vec3 p = pointOf(corners, b);
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return {low, high};
}

// Visit blocks at most 8 squares wide, but only those whose box, and every box above, `meets(low, high)` says yes to.
template <class Meets, class Visit>
void forEachBlock(const std::array<glm::vec3, 3>& corners, std::uint32_t along, const Meets& meets,
                  const Visit& visit) {
  constexpr std::uint32_t kBlock = 8;
  std::vector<PartBlock> stack;
  stack.push_back({0, 0, std::bit_ceil(std::max(along, kBlock))});
  while (!stack.empty()) {
    const PartBlock block = stack.back();
    stack.pop_back();
    if (block.column + block.row >= along) continue;
    const auto [low, high] = boxOf(corners, along, block);
    if (!meets(low, high)) continue;
    if (block.width <= kBlock) {
      visit(block);
      continue;
    }
    const std::uint32_t half = block.width / 2;
    for (std::uint32_t k = 0; k < 4; ++k)
      stack.push_back({block.column + (k & 1u) * half, block.row + (k >> 1) * half, half});
  }
}

// Whether a triangle is over 32 times as long as it is wide. Equal parts of it would have that shape, too, and the box
// around each would meet voxels far away.
inline bool isNeedle(const std::array<glm::vec3, 3>& c, float area) {
  const glm::vec3 edge[3] = {c[1] - c[0], c[2] - c[1], c[0] - c[2]};
  float longest = 0.0f;
  for (const glm::vec3& e : edge) longest = std::max(longest, glm::dot(e, e));
  return longest > 64.0f * area;
}

// forEachPart() for a needle. Its parts come from halving the longest edge again and again, which makes them about as
// wide as they are long.
template <class Visit>
double forEachPartOfNeedle(const std::array<glm::vec3, 3>& corners, float area, float voxelSize, const VoxelTree& tree,
                           std::uint32_t instance, const Visit& visit) {
  struct Piece {
    std::array<glm::dvec3, 3> corner;
    int halvings;
  };
  const glm::vec3 normal = crossOf(corners);
  const double wanted = std::min(4.0 * area / voxelSize / voxelSize, TriangleParts::kMax * TriangleParts::kMax);
  const int max = std::max(0, static_cast<int>(std::ceil(std::log2(wanted))));
  std::vector<Piece> stack;
  stack.push_back({{glm::dvec3(corners[0]), glm::dvec3(corners[1]), glm::dvec3(corners[2])}, 0});
  while (!stack.empty()) {
    const Piece piece = stack.back();
    stack.pop_back();
    const auto& c = piece.corner;
    const glm::vec3 low(glm::min(glm::min(c[0], c[1]), c[2])), high(glm::max(glm::max(c[0], c[1]), c[2]));
    if (!tree.meets(instance, normal, low, high)) continue;
    if (piece.halvings == max) {
      visit(glm::vec3((c[0] + c[1] + c[2]) / 3.0));
      continue;
    }
    std::size_t k = 0;  // the longest edge goes from corner k to the next
    const auto lengthOf = [&](std::size_t i) { return glm::distance(c[i], c[(i + 1) % 3]); };
    for (std::size_t i = 1; i < 3; ++i) k = lengthOf(i) > lengthOf(k) ? i : k;
    const glm::dvec3 &from = c[k], &to = c[(k + 1) % 3], &across = c[(k + 2) % 3], middle = 0.5 * (from + to);
    stack.push_back({{from, middle, across}, piece.halvings + 1});
    stack.push_back({{middle, to, across}, piece.halvings + 1});
  }
  return std::exp2(max);
}

// Visit the centres of those parts of a triangle that may be in a voxel of the tree, or of all parts when the tree is
// empty: visit(position). Returns the number of all parts.
template <class Visit>
double forEachPart(const std::array<glm::vec3, 3>& corners, float area, float voxelSize, const VoxelTree& tree,
                   std::uint32_t instance, const Visit& visit) {
  const TriangleParts parts(area, voxelSize);
  const std::uint32_t n = parts.along;
  const auto visitRow = [&](std::uint32_t row, std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t k = 2 * begin; k < std::min(2 * end, 2 * (n - row) - 1); ++k)
      visit(pointOf(corners, parts.centre(row, k)));
  };
  if (n < TriangleParts::kFew || tree.empty()) {
    for (std::uint32_t row = 0; row < n; ++row) visitRow(row, 0, n);
    return parts.count();
  }
  if (isNeedle(corners, area)) return forEachPartOfNeedle(corners, area, voxelSize, tree, instance, visit);
  const glm::vec3 normal = crossOf(corners);
  forEachBlock(
      corners, n, [&](const glm::vec3& low, const glm::vec3& high) { return tree.meets(instance, normal, low, high); },
      [&](const PartBlock& block) {
        for (std::uint32_t row = block.row; row < std::min(block.row + block.width, n); ++row)
          visitRow(row, block.column, block.column + block.width);
      });
  return parts.count();
}

}  // namespace relume
