// SPDX-License-Identifier: MIT
// Which points of surfaces are neighbours of each other: those between which distance means distance along the surface.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>

namespace relume {

struct SurfaceNode {
  glm::vec3 positionWorld{0.0f};
  glm::vec3 normal{0.0f};
  std::uint32_t emitter = 0xFFFFFFFFu;  // see SurfaceSample
};

// The two sides of a wall are no neighbours, nor are parallel layers, nor an emitter and what is around it. Two points
// of one surface lie near each other's tangent plane as far as their normals agree: with d between them, theta between
// the normals and h the larger height over a plane, h² <= d² (2 sin² theta + 0.02). Symmetric to the last bit.
inline bool areNeighbours(const SurfaceNode& a, const SurfaceNode& b, const glm::vec3& apart, float distanceSquared) {
  const float cosine = glm::dot(a.normal, b.normal);
  if (cosine < -0.1f || a.emitter != b.emitter) return false;
  const float sineSquared = cosine > 0.0f ? 1.0f - cosine * cosine : 1.0f;
  const float ha = glm::dot(a.normal, apart), hb = glm::dot(b.normal, apart);
  return std::max(ha * ha, hb * hb) <= distanceSquared * (2.0f * sineSquared + 0.02f);
}

}  // namespace relume
