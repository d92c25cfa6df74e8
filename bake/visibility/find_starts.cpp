// SPDX-License-Identifier: MIT
// See find_starts.h.
#include "bake/visibility/find_starts.h"

#include "bake/base/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr std::uint32_t kStartStage = 0x66726565;  // the random streams' stage
constexpr std::size_t kCandidates = 1u << 14;      // random points tried
constexpr std::uint32_t kProbes = 16;              // rays per candidate
constexpr float kMaxBackShare = 0.25f;             // largest share of backs among a free point's hits
constexpr float kMargin = 0.5f;  // of the level's size, added on all sides: a level may be seen from outside
// Of a level's second size: with a third of less, it is flat, or thin.
constexpr float kFlat = 1e-4f, kThin = 1e-2f;
constexpr float kDefaultAspect = 16.0f / 9.0f;  // of cameras whose aspect is the viewport's

// Whether rays in all directions hit something, and mostly fronts. A hit nearer than the precision of rays counts as a
// back: the gap between coplanar surfaces is no free space. Triangles that show both sides have only fronts.
bool isFree(const RayTracer& tracer, const glm::vec3& p, RandomStream& random) {
  std::array<Ray, kProbes> rays;
  std::array<Hit, kProbes> hits;
  for (Ray& ray : rays) ray = {p, 0.0f, uniformDirection(random.uniform2())};
  tracer.trace(rays, hits);
  std::uint32_t fronts = 0, backs = 0;
  for (const Hit& hit : hits) {
    if (!hit) continue;
    const bool sheet = tracer.scene().bothSides(tracer.scene().instances[hit.instance], hit.triangle);
    const bool inGap = hit.distance < tracer.epsilonAt(p);
    ++((hit.back && !sheet) || inGap ? backs : fronts);
  }
  return fronts > 0 && static_cast<float>(backs) <= kMaxBackShare * static_cast<float>(fronts + backs);
}

Start fromCamera(const Camera& camera, RandomStream& random) {
  const glm::mat4& m = camera.toWorld;
  const glm::vec3 right = glm::normalize(glm::vec3(m[0])), up = glm::normalize(glm::vec3(m[1]));
  const glm::vec3 forward = -glm::normalize(glm::vec3(m[2])), eye(m[3]);
  const bool throughFrustum = random.uniform() < 0.5f;
  const glm::vec2 u = random.uniform2();
  const float aspect = camera.aspect > 0.0f ? camera.aspect : kDefaultAspect;
  const glm::vec2 screen((2.0f * u.x - 1.0f) * aspect, 2.0f * u.y - 1.0f);
  if (camera.orthographic) return {eye + camera.yMag * (screen.x * right + screen.y * up), forward};
  if (!throughFrustum) return {eye, uniformDirection(u)};
  const float half = std::tan(0.5f * camera.yfovRad);
  return {eye, glm::normalize(forward + half * (screen.x * right + screen.y * up))};
}

}  // namespace

glm::vec3 uniformDirection(const glm::vec2& u) {
  const float z = 1.0f - 2.0f * u.x, radius = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const float angle = 6.28318530717959f * u.y;
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

std::vector<glm::vec3> findFreePoints(const RayTracer& tracer, std::uint64_t seed, Context& context) {
  const glm::vec3 size = tracer.boundsMax() - tracer.boundsMin();
  const float largest = std::max({size.x, size.y, size.z}), margin = kMargin * largest;
  const glm::vec3 low = tracer.boundsMin() - margin, extent = size + 2.0f * margin;
  // Points within the bounds of a flat level would lie a hair above its one surface, and see a hair of it.
  const float second = std::max({std::min(size.x, size.y), std::min(size.y, size.z), std::min(size.z, size.x)});
  glm::vec3 innerExtent = glm::max(size, kThin * second);
  for (int k = 0; k < 3; ++k) innerExtent[k] = size[k] < kFlat * second ? extent[k] : innerExtent[k];
  const glm::vec3 innerLow = tracer.boundsMin() - 0.5f * (innerExtent - size);

  // Draw half of the candidates within these bounds, and half within bounds widened by the margin.
  std::vector<glm::vec3> candidates(kCandidates);
  std::vector<std::uint8_t> isIn(kCandidates, 0);
  parallelChunks(context, "", kCandidates, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      RandomStream random(seed, kStartStage, i);
      const glm::vec2 xy = random.uniform2();
      const glm::vec3 u(xy, random.uniform());
      candidates[i] = i % 2 == 0 ? innerLow + u * innerExtent : low + u * extent;
      isIn[i] = isFree(tracer, candidates[i], random) ? 1 : 0;
    }
  });
  std::vector<glm::vec3> free;
  for (std::size_t i = 0; i < kCandidates; ++i) {
    if (isIn[i] != 0) free.push_back(candidates[i]);
  }
  return free;
}

StartSources::StartSources(const Scene& scene) : volumes(scene.volumes) {
  for (const std::uint32_t i : scene.playSpaceCameras()) cameras.push_back(scene.cameras[i]);
}

Start drawStart(const StartSources& sources, RandomStream& random) {
  if (!sources.freePoints.empty()) {
    const glm::vec3 p = sources.freePoints[random.below(static_cast<std::uint32_t>(sources.freePoints.size()))];
    return {p, uniformDirection(random.uniform2())};
  }
  const auto cameras = static_cast<std::uint32_t>(sources.cameras.size());
  const std::uint32_t pick = random.below(cameras + static_cast<std::uint32_t>(sources.volumes.size()));
  if (pick < cameras) return fromCamera(sources.cameras[pick], random);
  const glm::vec2 xy = random.uniform2();
  const glm::vec4 inVolume(xy - 0.5f, random.uniform() - 0.5f, 1.0f);
  return {glm::vec3(sources.volumes[pick - cameras].toWorld * inVolume), uniformDirection(random.uniform2()), false};
}

}  // namespace relume
