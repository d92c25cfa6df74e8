// SPDX-License-Identifier: MIT
// See relocate.h.
#include "bake/caches/grid/relocate.h"

#include "bake/base/morton.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr std::size_t kSeenRays = 64;
// Rays cast first. They are the whole answer when none or many of them meet back faces, and, in the air, some meet what
// the play space sees. In Sponza's grid, where half of 16 rays meet backs, fewer than a quarter of 64 do at only one
// position in ten thousand. Caches on surfaces may see more backs, so that more of their first rays must meet backs.
constexpr std::size_t kFirstRays = 16;
constexpr float kClearlyInside = 0.5f, kClearlyInsideSurface = 0.75f, kClearlySeen = 0.25f;

// Fibonacci spirals: even over the sphere, cosine-weighted over the hemisphere. The first quarter is even, too. Within
// it, and within the rest, neighbours follow each other, so that packets of rays stay together.
std::vector<glm::vec3> spiral(bool hemisphere) {
  std::vector<glm::vec3> directions;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  constexpr std::size_t kStride = kSeenRays / kFirstRays;
  for (std::size_t k = 0; k < kSeenRays; ++k) {
    const std::size_t i = k % kFirstRays * kStride + k / kFirstRays;
    const double u = (static_cast<double>(i) + 0.5) / kSeenRays;
    const double z = hemisphere ? std::sqrt(1.0 - u) : 1.0 - 2.0 * u;
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z)), phi = golden * static_cast<double>(i);
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  const auto along = [](const glm::vec3& a, const glm::vec3& b) {
    return mortonOf(1024.0f * (a + 1.0f)) < mortonOf(1024.0f * (b + 1.0f));
  };
  std::sort(directions.begin(), directions.begin() + kFirstRays, along);
  std::sort(directions.begin() + kFirstRays, directions.end(), along);
  return directions;
}

}  // namespace

Prober::Prober(const RayTracer& tracer, const PlaySpace& playSpace)
    : tracer_(tracer), playSpace_(playSpace), hemisphere_(spiral(true)), sphere_(spiral(false)) {}

Surroundings Prober::probe(const glm::vec3& positionWorld, const glm::vec3& normal, float contact,
                           std::uint32_t own) const {
  const bool onSurface = normal != glm::vec3(0.0f);
  glm::vec3 u(1, 0, 0), v(0, 1, 0), w(0, 0, 1);
  if (onSurface) {
    w = normal;
    u = glm::normalize(glm::cross(std::abs(w.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0), w));
    v = glm::cross(w, u);
  }
  std::array<Ray, kSeenRays> rays;
  std::array<Hit, kSeenRays> hits;
  // A spot may lie on another surface as well, whose side its rays would miss: they start a little behind it, no deeper
  // than liftAt() has lifted it.
  const float behind = onSurface ? tracer_.epsilonAt(positionWorld) : 0.0f;
  for (std::size_t i = 0; i < kSeenRays; ++i) {
    const glm::vec3& d = onSurface ? hemisphere_[i] : sphere_[i];
    rays[i].direction = u * d.x + v * d.y + w * d.z;
    rays[i].origin = positionWorld - behind * rays[i].direction;
  }

  const Scene& scene = tracer_.scene();
  Surroundings count;
  const auto cast = [&](std::size_t begin, std::size_t end) {
    tracer_.trace(std::span(rays).subspan(begin, end - begin), std::span(hits).subspan(begin, end - begin));
    for (std::size_t i = begin; i < end; ++i) {
      const Hit& hit = hits[i];
      if (!hit) {
        count.missed += 1.0f;
        continue;
      }
      count.free = std::min(count.free, hit.distance);
      count.nearness += 1.0f / std::max(hit.distance, contact);
      const Instance& instance = scene.instances[hit.instance];
      if (hit.back && !scene.bothSides(instance, hit.triangle)) {
        count.back += 1.0f;
        if (hit.instance == own) count.ownBack += 1.0f;
      } else if (hit.distance < contact)
        count.near += 1.0f;
      if (playSpace_.seenAt(2 * (instance.firstTriangle + hit.triangle) + (hit.back ? 1u : 0u), hit.barycentric))
        count.seen += 1.0f;
    }
  };
  cast(0, kFirstRays);
  float raysCast = static_cast<float>(kFirstRays);
  const bool clearlyOutside = count.back + count.near == 0.0f && (onSurface || count.seen > kClearlySeen * raysCast);
  const bool mayBeGap = onSurface && count.seen > 0.0f && count.ownBack == 0.0f;
  const bool clearlyInside = count.back >= (onSurface ? kClearlyInsideSurface : kClearlyInside) * raysCast && !mayBeGap;
  if (!clearlyOutside && !clearlyInside) {
    cast(kFirstRays, kSeenRays);
    raysCast = static_cast<float>(kSeenRays);
  }
  for (float* share : {&count.back, &count.ownBack, &count.near, &count.seen, &count.missed, &count.nearness})
    *share /= raysCast;
  return count;
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
