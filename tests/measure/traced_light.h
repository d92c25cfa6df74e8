// SPDX-License-Identifier: MIT
// Path-traced irradiance at chosen receivers, and how far a bake's is from it: what the benches of errors share.
#pragma once

#include "bake/base/random.h"
#include "bake/rays/ray_tracer.h"
#include "bake/reference/path_tracer.h"
#include "relume/bake_data.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

namespace relume::test {

inline constexpr float kPathPi = 3.14159265f;

struct TracedReceiver {
  glm::vec3 position, normal;
  std::array<glm::vec3, 2> half;  // [W/m²] irradiance by each half of the paths
  glm::vec3 truth() const { return 0.5f * (half[0] + half[1]); }
};

inline glm::vec3 sphereDirection(const glm::vec2& u) {
  const float z = 1.0f - 2.0f * u.x, r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  return {r * std::cos(2.0f * kPathPi * u.y), r * std::sin(2.0f * kPathPi * u.y), z};
}

inline glm::vec3 cosineDirection(const glm::vec3& n, const glm::vec2& u) {
  const glm::vec3 d = n + 0.9999f * sphereDirection(u);
  return glm::normalize(d);
}

struct TracedLevel {
  const Scene& scene;
  const RayTracer& tracer;
  std::vector<SceneLight> lights;
  bool emissive = false;
};

// Radiance that comes along a ray, by paths with light drawn at every vertex; emitters are met by chance.
inline glm::vec3 radiance(const TracedLevel& level, glm::vec3 origin, glm::vec3 direction, RandomStream& random) {
  glm::vec3 sum(0.0f), throughput(1.0f);
  for (int bounce = 0; bounce < 10; ++bounce) {
    const Hit hit = level.tracer.trace({origin, 0.0f, direction});
    if (!hit) break;
    const SurfacePoint p = hit.point();
    const Instance& instance = level.scene.instances[p.instance];
    const auto c = level.scene.corners(instance, p.triangle);
    glm::vec3 n = geometricNormal(level.scene, p), shading = shadingNormal(level.scene, p);
    if (level.emissive && (!hit.back || level.scene.bothSides(instance, p.triangle)))
      sum += throughput * emissionAt(level.scene, p);
    if (hit.back) n = -n, shading = -shading;
    origin = c[0] + (c[1] - c[0]) * p.barycentric.x + (c[2] - c[0]) * p.barycentric.y;
    origin += n * level.tracer.epsilonAt(origin);
    throughput *= albedoAt(level.scene, p);
    if (!level.lights.empty())
      sum += throughput / kPathPi * directIrradiance(level.tracer, level.lights, origin, shading);
    direction = cosineDirection(shading, random.uniform2());
    if (!(glm::dot(direction, n) > 0.0f)) break;
    if (bounce > 3) {
      const float keep = std::min(0.9f, std::max({throughput.x, throughput.y, throughput.z}));
      if (random.uniform() >= keep) break;
      throughput /= keep;
    }
  }
  return sum;
}

// Sets both halves of a receiver's irradiance.
inline void traceIrradiance(const TracedLevel& level, int paths, RandomStream& random, TracedReceiver& r) {
  for (glm::vec3& half : r.half) {
    glm::vec3 sum(0.0f);
    for (int k = 0; k < paths / 2; ++k)
      sum += radiance(level, r.position, cosineDirection(r.normal, random.uniform2()), random);
    half = kPathPi * sum / static_cast<float>(paths / 2);
  }
}

// The lights of these names, separated by commas.
inline std::vector<SceneLight> lightsNamed(const Scene& scene, const std::string& names) {
  std::vector<SceneLight> lights;
  for (const SceneLight& light : scene.lights) {
    if (("," + names + ",").find("," + light.name + ",") != std::string::npos) lights.push_back(light);
  }
  return lights;
}

// Irradiance of a bake's surfels by lights with traced shadows.
inline std::vector<glm::vec3> shadowedLight(const TracedLevel& level, const Surfels& surfels) {
  std::vector<glm::vec3> direct(surfels.count(), glm::vec3(0.0f));
  for (std::size_t s = 0; s < direct.size() && !level.lights.empty(); ++s) {
    const glm::vec3 p = surfels.positionWorld[s], n = surfels.normal[s];
    direct[s] = directIrradiance(level.tracer, level.lights, p + n * level.tracer.epsilonAt(p), n);
  }
  return direct;
}

struct TracedError {
  double rmse = 0.0, trimmed = 0.0, energy = 0.0;
};

// Relative to the mean square of the truth, its noise removed; trimmed: without the worst 1 % of receivers.
inline TracedError errorOf(std::span<const TracedReceiver> receivers, std::span<const glm::vec3> found) {
  std::vector<double> error;
  double square = 0.0, noise = 0.0, sum = 0.0, truth = 0.0;
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    const TracedReceiver& r = receivers[i];
    const glm::vec3 d = found[i] - r.truth(), n = 0.5f * (r.half[0] - r.half[1]);
    error.push_back(static_cast<double>(glm::dot(d, d)));
    noise += static_cast<double>(glm::dot(n, n));
    square += static_cast<double>(glm::dot(r.truth(), r.truth()));
    sum += static_cast<double>(found[i].x + found[i].y + found[i].z);
    truth += static_cast<double>(r.truth().x + r.truth().y + r.truth().z);
  }
  std::sort(error.begin(), error.end());
  double total = 0.0, kept = 0.0;
  for (std::size_t i = 0; i < error.size(); ++i) {
    total += error[i];
    if (static_cast<double>(i) < 0.99 * static_cast<double>(error.size())) kept += error[i];
  }
  return {std::sqrt(std::max(0.0, total - noise) / square), std::sqrt(std::max(0.0, kept - noise) / square),
          sum / truth};
}

}  // namespace relume::test
