// SPDX-License-Identifier: MIT
// See scene_bounds.h.
#include "tools/render/scene_bounds.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <vector>

namespace relume {
namespace {

constexpr float kMuchWider = 8.0f;  // than the play volumes: their cells would be of a quarter of them and more

void add(const glm::vec3& world, SceneBounds& bounds) {
  bounds.min = bounds.empty ? world : glm::min(bounds.min, world);
  bounds.max = bounds.empty ? world : glm::max(bounds.max, world);
  bounds.empty = false;
}

void add(const Scene& scene, const Instance& instance, SceneBounds& bounds) {
  for (const glm::vec3& p : scene.meshes[instance.mesh].position)
    add(glm::vec3(instance.toWorld * glm::vec4(p, 1.0f)), bounds);
}

// The part of a convex polygon where sign * (p[axis] - at) >= 0.
std::vector<glm::dvec3> cut(const std::vector<glm::dvec3>& polygon, int axis, double at, double sign) {
  std::vector<glm::dvec3> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = sign * (a[axis] - at), db = sign * (b[axis] - at);
    if (da >= 0.0) kept.push_back(a);
    if ((da >= 0.0) != (db >= 0.0)) kept.push_back(a + da / (da - db) * (b - a));
  }
  return kept;
}

}  // namespace

SceneBounds boundsOf(const Scene& scene) {
  SceneBounds bounds;
  for (const Instance& instance : scene.instances) add(scene, instance, bounds);
  return bounds;
}

SceneBounds boundsOf(const Scene& scene, const Instance& instance) {
  SceneBounds bounds;
  add(scene, instance, bounds);
  return bounds;
}

SceneBounds joined(const SceneBounds& a, const SceneBounds& b) {
  if (a.empty || b.empty) return a.empty ? b : a;
  return {glm::min(a.min, b.min), glm::max(a.max, b.max), false};
}

float diagonal(const SceneBounds& bounds) { return glm::distance(bounds.min, bounds.max); }

float longestSide(const SceneBounds& bounds) {
  const glm::vec3 size = bounds.max - bounds.min;
  return std::max({size.x, size.y, size.z});
}

std::optional<SceneBounds> livePartOf(const Scene& scene) {
  SceneBounds played;
  for (const PlayVolume& volume : scene.volumes) {
    const glm::mat4& m = volume.toWorld;
    const glm::vec3 half(0.5f * (glm::abs(m[0]) + glm::abs(m[1]) + glm::abs(m[2])));
    add(glm::vec3(m[3]) - half, played);
    add(glm::vec3(m[3]) + half, played);
  }
  const float margin = longestSide(played);
  if (!(margin > 0.0f) || !(longestSide(boundsOf(scene)) > kMuchWider * margin)) return std::nullopt;
  // Also below a ground: near the faces of a box light fades into the sky's.
  return SceneBounds{played.min - margin, played.max + margin, false};
}

double areaWithin(const SceneBounds& box, const std::array<glm::vec3, 3>& triangle) {
  const bool isInside = std::all_of(triangle.begin(), triangle.end(),
                                    [&](const glm::vec3& p) { return glm::clamp(p, box.min, box.max) == p; });
  if (isInside)
    return 0.5 * static_cast<double>(glm::length(glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0])));
  std::vector<glm::dvec3> polygon(triangle.begin(), triangle.end());
  for (int axis = 0; axis < 3; ++axis) {
    polygon = cut(polygon, axis, box.min[axis], 1.0);
    polygon = cut(polygon, axis, box.max[axis], -1.0);
  }
  glm::dvec3 twice(0.0);
  for (std::size_t i = 2; i < polygon.size(); ++i)
    twice += glm::cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
  return 0.5 * glm::length(twice);
}

}  // namespace relume
