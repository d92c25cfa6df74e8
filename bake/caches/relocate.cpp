// SPDX-License-Identifier: MIT
// See relocate.h.
#include "bake/caches/relocate.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr std::size_t kRays = 64;

// Fibonacci spirals: even over the sphere, and cosine-weighted over the hemisphere.
std::vector<glm::vec3> spiral(bool hemisphere) {
  std::vector<glm::vec3> directions;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (std::size_t i = 0; i < kRays; ++i) {
    const double u = (static_cast<double>(i) + 0.5) / kRays;
    const double z = hemisphere ? std::sqrt(1.0 - u) : 1.0 - 2.0 * u;
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z)), phi = golden * static_cast<double>(i);
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  return directions;
}

}  // namespace

Prober::Prober(const RayTracer& tracer, const PlaySpace& playSpace)
    : tracer_(tracer), playSpace_(playSpace), hemisphere_(spiral(true)), sphere_(spiral(false)) {}

Surroundings Prober::probe(const glm::vec3& positionWorld, const glm::vec3& normal, float contact) const {
  const bool onSurface = normal != glm::vec3(0.0f);
  glm::vec3 u(1, 0, 0), v(0, 1, 0), w(0, 0, 1);
  if (onSurface) {
    w = normal;
    u = glm::normalize(glm::cross(std::abs(w.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0), w));
    v = glm::cross(w, u);
  }
  std::array<Ray, kRays> rays;
  std::array<Hit, kRays> hits;
  for (std::size_t i = 0; i < kRays; ++i) {
    const glm::vec3& d = onSurface ? hemisphere_[i] : sphere_[i];
    rays[i].origin = positionWorld;
    rays[i].direction = u * d.x + v * d.y + w * d.z;
  }
  tracer_.trace(rays, hits);

  const Scene& scene = tracer_.scene();
  Surroundings result;
  for (const Hit& hit : hits) {
    if (!hit) {
      result.miss += 1.0f;
      continue;
    }
    const Instance& instance = scene.instances[hit.instance];
    if (hit.back && !scene.material(instance).doubleSided) result.back += 1.0f;
    else if (hit.distance < contact) result.near += 1.0f;
    if (playSpace_.seenAt(2 * (instance.firstTriangle + hit.triangle) + (hit.back ? 1u : 0u), hit.barycentric)) result.seen += 1.0f;
  }
  const float scale = 1.0f / static_cast<float>(kRays);
  return {result.back * scale, result.near * scale, result.seen * scale, result.miss * scale};
}

bool Prober::connected(const glm::vec3& from, const glm::vec3& to) const {
  const glm::vec3 way = to - from;
  const float length = glm::length(way);
  const float epsilon = tracer_.epsilonAt(from);
  if (length <= 2.0f * epsilon) return true;
  Ray ray;
  ray.origin = from;
  ray.direction = way / length;
  ray.tMax = length - epsilon;
  return !tracer_.occluded(ray);
}

float Prober::liftAt(const glm::vec3& positionWorld, float texelSize) const {
  const float epsilon = tracer_.epsilonAt(positionWorld);
  return std::max(4.0f * epsilon, std::min(0.004f * texelSize, 0.01f));
}

}  // namespace relume
