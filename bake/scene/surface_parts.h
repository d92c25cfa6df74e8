// SPDX-License-Identifier: MIT
// Visits surface in parts small enough for the cells of seen_cells.h.
#pragma once

#include "bake/context.h"
#include "bake/parallel.h"
#include "bake/scene/scene.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace relume {

inline glm::vec3 pointOf(const std::array<glm::vec3, 3>& c, const glm::vec2& b) {
  return c[0] + (c[1] - c[0]) * b.x + (c[2] - c[0]) * b.y;
}

// Normal by the world corners, front side; not unit, its length is twice the area.
inline glm::vec3 crossOf(const std::array<glm::vec3, 3>& c) { return glm::cross(c[1] - c[0], c[2] - c[0]); }

// Visit the fixed triangles in parallel: visit(instance index, triangle, corners, area).
template <class Visit>
void forEachTriangle(const Scene& scene, Context& context, const Visit& visit) {
  // Large triangles, which have many parts, often follow one another.
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

// Visit the centres of the n² equal parts of a triangle, small enough for the cells: visit(position).
template <class Visit>
std::uint32_t forEachPart(const std::array<glm::vec3, 3>& corners, float area, float cellSize, const Visit& visit) {
  constexpr float kMaxSplits = 1024.0f;  // along an edge
  const float wanted = std::ceil(2.0f * std::sqrt(area) / cellSize);
  const auto n = static_cast<std::uint32_t>(std::clamp(wanted, 1.0f, kMaxSplits));
  const float third = 1.0f / (3.0f * static_cast<float>(n));
  for (std::uint32_t row = 0; row < n; ++row) {
    for (std::uint32_t k = 0; k < 2 * (n - row) - 1; ++k) {
      // Parts that point up sit at (1/3, 1/3) of their square, those that point down at (2/3, 2/3).
      const float inner = k % 2 == 0 ? 1.0f : 2.0f;
      const glm::vec2 b(third * (3.0f * static_cast<float>(k / 2) + inner),
                        third * (3.0f * static_cast<float>(row) + inner));
      visit(pointOf(corners, b));
    }
  }
  return n * n;
}

}  // namespace relume
