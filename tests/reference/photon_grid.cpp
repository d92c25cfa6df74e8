// SPDX-License-Identifier: MIT
// See photon_grid.h.
#include "tests/reference/photon_grid.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/reference/path_tracer.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/stencil.h"
#include "tests/measure/traced_light.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume::test {
namespace {

constexpr float kPi = kPathPi;
// Parts of a trace, each with a grid of its own: sums do not depend on how many threads there are.
constexpr std::size_t kParts = 4;
// [spacings] by which a way is longer at both ends, so that surfaces on the box count as passed.
constexpr float kReach = 1e-3f;
constexpr int kMaxBounces = 64;

// The part of a way within a box, as parameters of from + t (to - from); false where there is none.
bool clipWay(const glm::vec3& from, const glm::vec3& way, const glm::vec3& low, const glm::vec3& high, float& begin,
             float& end) {
  begin = 0.0f;
  end = 1.0f;
  for (int a = 0; a < 3; ++a) {
    if (way[a] == 0.0f) {
      if (from[a] < low[a] || from[a] > high[a]) return false;
      continue;
    }
    const float t0 = (low[a] - from[a]) / way[a], t1 = (high[a] - from[a]) / way[a];
    begin = std::max(begin, std::min(t0, t1));
    end = std::min(end, std::max(t0, t1));
  }
  return begin < end;
}

// A photon as it leaves its light.
struct Emitted {
  Ray ray;
  glm::vec3 flux{0.0f};  // [W], or 0: nothing to trace
};

Emitted emitPunctual(const RayTracer& tracer, const SceneLight& light, RandomStream& random) {
  Emitted photon;
  const glm::vec3 middle = 0.5f * (tracer.boundsMin() + tracer.boundsMax());
  if (light.kind == LightKind::directional) {
    const float radius = 0.5f * glm::distance(tracer.boundsMin(), tracer.boundsMax());
    const glm::vec2 u = random.uniform2();
    const glm::vec3 d = glm::normalize(light.direction);
    const glm::vec3 side =
        glm::normalize(glm::cross(d, std::abs(d.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
    const float r = radius * std::sqrt(u.x), turn = 2.0f * kPi * u.y;
    photon.ray = {middle - 2.0f * radius * d + r * (std::cos(turn) * side + std::sin(turn) * glm::cross(d, side)), 0.0f,
                  d};
    photon.flux = kPi * radius * radius * light.intensity;
    return photon;
  }
  glm::vec3 d = sphereDirection(random.uniform2());
  float solidAngle = 4.0f * kPi;
  if (light.kind == LightKind::spot) {
    // Uniform in the outer cone.
    const glm::vec3 axis = glm::normalize(light.direction);
    const float low = std::cos(light.outerConeRad), cosine = low + (1.0f - low) * random.uniform();
    const glm::vec3 across = d - glm::dot(d, axis) * axis;
    const float length = glm::length(across);
    if (!(length > 0.0f)) return photon;
    d = cosine * axis + std::sqrt(1.0f - cosine * cosine) / length * across;
    solidAngle = 2.0f * kPi * (1.0f - low);
  }
  // Intensity is what a surface a metre off would receive.
  glm::vec3 toLight;
  float distance = 0.0f;
  photon.ray = {light.positionWorld, 0.0f, d};
  photon.flux = solidAngle * lightIrradiance(light, light.positionWorld + d, -d, toLight, distance);
  return photon;
}

Emitted emitSurface(const RayTracer& tracer, const EmittingTriangles& emitters, RandomStream& random) {
  const EmitterSample sample = emitters.sample(random);
  if (!(sample.density > 0.0f)) return {};
  const bool back = sample.bothSides && random.uniform() < 0.5f;
  const glm::vec3 n = back ? -sample.normal : sample.normal;
  Emitted photon;
  photon.ray = {sample.position + n * tracer.epsilonAt(sample.position), 0.0f, cosineDirection(n, random.uniform2())};
  photon.flux = (sample.bothSides ? 2.0f : 1.0f) * kPi / sample.density * sample.radiance;
  return photon;
}

void tracePhoton(const RayTracer& tracer, Emitted photon, RandomStream& random, PhotonGrid& grid) {
  const Scene& scene = tracer.scene();
  const float far = 4.0f * glm::distance(tracer.boundsMin(), tracer.boundsMax());
  for (int bounce = 0; bounce < kMaxBounces; ++bounce) {
    const Hit hit = tracer.trace(photon.ray);
    const float distance = hit ? hit.distance : far;
    if (bounce > 0) grid.addWay(photon.ray.origin, photon.ray.origin + distance * photon.ray.direction, photon.flux);
    if (!hit) return;
    const SurfacePoint p = hit.point();
    const glm::vec3 albedo = albedoAt(scene, p);
    const float keep = std::max({albedo.x, albedo.y, albedo.z});
    if (random.uniform() >= keep) return;
    photon.flux *= albedo / keep;
    glm::vec3 n = geometricNormal(scene, p);
    if (hit.back) n = -n;
    const auto c = scene.corners(scene.instances[p.instance], p.triangle);
    const glm::vec3 at = c[0] + (c[1] - c[0]) * p.barycentric.x + (c[2] - c[0]) * p.barycentric.y;
    photon.ray = {at + n * tracer.epsilonAt(at), 0.0f, cosineDirection(n, random.uniform2())};
  }
}

}  // namespace

PhotonGrid::PhotonGrid(const glm::vec3& low, const glm::vec3& high, const glm::uvec3& resolution,
                       PhotonEstimator estimator)
    : low_(low),
      spacing_((high - low) / glm::vec3(resolution - 1u)),
      resolution_(resolution),
      estimator_(estimator),
      vectors_(std::size_t{resolution.x} * resolution.y * resolution.z) {}

float PhotonGrid::side(const glm::uvec3& point, int axis) const {
  const bool border = point[axis] == 0 || point[axis] + 1 == resolution_[axis];
  return border ? 0.5f * spacing_[axis] : spacing_[axis];
}

float PhotonGrid::faceArea(const glm::uvec3& point, int axis) const {
  return side(point, (axis + 1) % 3) * side(point, (axis + 2) % 3);
}

float PhotonGrid::cellVolume(const glm::uvec3& point) const { return side(point, 0) * side(point, 1) * side(point, 2); }

void PhotonGrid::addVector(const glm::uvec3& point, int axis, const glm::vec3& w, const glm::vec3& flux) {
  Vectors& vectors = vectors_[indexOf(point)];
  for (std::size_t k = 0; k < 3; ++k) vectors[k][halfOf(w, axis)] += flux[static_cast<int>(k)] * w;
}

void PhotonGrid::addWay(const glm::vec3& from, const glm::vec3& to, const glm::vec3& flux) {
  if (estimator_ == PhotonEstimator::length)
    addCells(from, to, flux);
  else
    addFaces(from, to, flux);
}

void PhotonGrid::addFaces(const glm::vec3& from, const glm::vec3& to, const glm::vec3& flux) {
  const glm::vec3 begin = (from - low_) / spacing_, way = (to - from) / spacing_;
  const glm::vec3 w = -glm::normalize(to - from), last(resolution_ - 1u);
  for (int a = 0; a < 3; ++a) {
    if (way[a] == 0.0f) continue;
    const float first = std::min(begin[a], begin[a] + way[a]) - kReach,
                end = std::max(begin[a], begin[a] + way[a]) + kReach;
    const float cosine = std::max(std::abs(w[a]), kMinCosine);
    for (float plane = std::max(std::ceil(first), 0.0f); plane <= std::min(end, last[a]); plane += 1.0f) {
      glm::vec3 p = begin + (plane - begin[a]) / way[a] * way;
      p[a] = plane;
      const glm::vec3 inside = glm::clamp(p, glm::vec3(0.0f), last), off = glm::abs(p - inside);
      if (std::max({off.x, off.y, off.z}) > kReach) continue;
      const glm::uvec3 point(inside + 0.5f);
      const float scale = 1.0f / (faceArea(point, a) * (estimator_ == PhotonEstimator::corrected ? cosine : 1.0f));
      addVector(point, a, w, scale * flux);
    }
  }
}

void PhotonGrid::addCells(const glm::vec3& from, const glm::vec3& to, const glm::vec3& flux) {
  const glm::vec3 start = (from - low_) / spacing_, way = (to - from) / spacing_;
  const glm::vec3 last(resolution_ - 1u);
  float t = 0.0f, end = 1.0f;
  if (!clipWay(start, way, glm::vec3(0.0f), last, t, end)) return;
  const float length = glm::distance(from, to);
  const glm::vec3 w = (from - to) / length;
  glm::uvec3 cell(glm::clamp(start + t * way, glm::vec3(0.0f), last) + 0.5f);
  while (t < end) {
    // Where the way leaves the dual cell.
    float next = end;
    int axis = -1;
    for (int a = 0; a < 3; ++a) {
      if (way[a] == 0.0f) continue;
      const float border = static_cast<float>(cell[a]) + (way[a] > 0.0f ? 0.5f : -0.5f);
      const float at = (border - start[a]) / way[a];
      if (at < next) next = at, axis = a;
    }
    if (next > t) {
      const glm::vec3 share = (next - t) * length / cellVolume(cell) * flux;
      for (int a = 0; a < 3; ++a) addVector(cell, a, w, share);
      t = next;
    }
    if (axis < 0) return;
    if (way[axis] > 0.0f ? cell[axis] + 1 == resolution_[axis] : cell[axis] == 0) return;
    way[axis] > 0.0f ? ++cell[axis] : --cell[axis];
  }
}

void PhotonGrid::add(const PhotonGrid& other) {
  for (std::size_t i = 0; i < vectors_.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t half = 0; half < 6; ++half) vectors_[i][k][half] += other.vectors_[i][k][half];
    }
  }
}

glm::vec3 PhotonGrid::irradiance(const glm::vec3& position, const glm::vec3& normal, bool smooth,
                                 DirectionWeights weights) const {
  const glm::vec3 p = glm::clamp((position - low_) / spacing_, glm::vec3(0.0f), glm::vec3(resolution_ - 1u));
  const glm::uvec3 cell = glm::min(glm::uvec3(p), resolution_ - 2u);
  const glm::vec3 f = p - glm::vec3(cell);
  std::array<std::array<glm::vec3, 3>, 3> halves{};  // of each colour
  const auto add = [&](const glm::uvec3& at, float weight) {
    const Vectors& vectors = vectors_[indexOf(at)];
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t a = 0; a < 3; ++a) halves[k][a] += weight * vectors[k][halfOf(normal, static_cast<int>(a))];
    }
  };
  if (smooth) {
    const std::array<float, 4> x = splineWeights(f.x), y = splineWeights(f.y), z = splineWeights(f.z);
    for (std::uint32_t k = 0; k < 64; ++k) {
      const glm::uvec3 offset(k & 3, k >> 2 & 3, k >> 4);
      add(glm::min(glm::max(cell + offset, glm::uvec3(1)) - 1u, resolution_ - 1u),
          x[offset.x] * y[offset.y] * z[offset.z]);
    }
  } else {
    const std::array<float, 8> weight = trilinear(f);
    for (std::uint32_t c = 0; c < 8; ++c) add(cell + cornerOffset(c), weight[c]);
  }
  glm::vec3 e;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::vec3 parts = axisParts(halves[k], normal, weights);
    e[static_cast<int>(k)] = parts.x + parts.y + parts.z;
  }
  return glm::max(e, glm::vec3(0.0f));
}

void tracePhotons(const RayTracer& tracer, const PhotonLight& light, std::uint64_t photons, std::uint64_t seed,
                  PhotonGrid& grid, Context& context) {
  const std::size_t sources = light.lights.size() + (light.emitters != nullptr ? 1 : 0);
  if (sources == 0) return;
  std::vector<PhotonGrid> parts(kParts, grid);
  parallelChunks(context, "", kParts, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      for (std::uint64_t i = part; i < photons; i += kParts) {
        // Lights take turns.
        RandomStream random(seed, 0x70686F74, i);
        const std::size_t source = i % sources;
        Emitted photon = source < light.lights.size() ? emitPunctual(tracer, light.lights[source], random)
                                                      : emitSurface(tracer, *light.emitters, random);
        photon.flux *= static_cast<float>(sources) / static_cast<float>(photons);
        if (photon.flux != glm::vec3(0.0f)) tracePhoton(tracer, photon, random, parts[part]);
      }
    }
  });
  for (const PhotonGrid& part : parts) grid.add(part);
}

}  // namespace relume::test
