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
constexpr std::uint32_t kVolumeProbes = 64;        // points of a play volume
constexpr std::size_t kHiddenProbes = 32;          // rays of isHidden()
constexpr std::size_t kMostOthers = 2;             // of them that hit no back, or nothing, at a hidden point
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

glm::vec3 pointIn(const PlayVolume& volume, RandomStream& random) {
  const glm::vec2 xy = random.uniform2();
  const glm::vec4 inVolume(xy - 0.5f, random.uniform() - 0.5f, 1.0f);
  return glm::vec3(volume.toWorld * inVolume);
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

bool isHidden(const RayTracer& tracer, const glm::vec3& point) {
  constexpr std::size_t kPacket = 8;
  constexpr float kGoldenSection = 0.618033989f;
  std::array<Ray, kPacket> rays;
  std::array<Hit, kPacket> hits;
  std::size_t others = 0;
  for (std::size_t first = 0; first < kHiddenProbes && others <= kMostOthers; first += kPacket) {
    for (std::size_t k = 0; k < kPacket; ++k) {
      // Each packet goes around the point: one step of the spiral in so many is in it.
      const std::size_t step = k * (kHiddenProbes / kPacket) + first / kPacket;
      const float turn = kGoldenSection * static_cast<float>(step);
      const glm::vec2 u((static_cast<float>(step) + 0.5f) / float{kHiddenProbes}, turn - std::floor(turn));
      rays[k] = {point, 0.0f, uniformDirection(u)};
    }
    tracer.trace(rays, hits);
    for (const Hit& hit : hits) {
      const Scene& scene = tracer.scene();
      if (!hit || !hit.back || !scene.bothSides(scene.instances[hit.instance], hit.triangle)) ++others;
    }
  }
  return others <= kMostOthers;
}

StartSources::StartSources(const Scene& scene) : volumes(scene.volumes) {
  for (const std::uint32_t i : scene.playSpaceCameras()) cameras.push_back(scene.cameras[i]);
}

void StartSources::findHidden(const RayTracer& tracer, std::uint64_t seed, Context& context) {
  leavesOutHidden.assign(volumes.size(), 0);
  const std::vector<Material>& materials = tracer.scene().materials;
  if (std::none_of(materials.begin(), materials.end(), [](const Material& m) { return m.doubleSided; })) return;
  parallelChunks(context, "", volumes.size(), 1, [&](std::size_t v, std::size_t) {
    std::uint32_t hidden = 0;
    for (std::uint32_t i = 0; i < kVolumeProbes; ++i) {
      RandomStream random(seed, kStartStage + 1, i);
      hidden += isHidden(tracer, pointIn(volumes[v], random)) ? 1 : 0;
    }
    leavesOutHidden[v] = 2 * hidden < kVolumeProbes ? 1 : 0;
  });
}

Start drawStart(const StartSources& sources, RandomStream& random) {
  if (!sources.freePoints.empty()) {
    const glm::vec3 p = sources.freePoints[random.below(static_cast<std::uint32_t>(sources.freePoints.size()))];
    return {p, uniformDirection(random.uniform2())};
  }
  const auto cameras = static_cast<std::uint32_t>(sources.cameras.size());
  const std::uint32_t pick = random.below(cameras + static_cast<std::uint32_t>(sources.volumes.size()));
  if (pick < cameras) return fromCamera(sources.cameras[pick], random);
  const std::uint32_t v = pick - cameras;
  const glm::vec3 p = pointIn(sources.volumes[v], random);
  const bool mayBeHidden = !sources.leavesOutHidden.empty() && sources.leavesOutHidden[v] != 0;
  return {p, uniformDirection(random.uniform2()), false, mayBeHidden};
}

}  // namespace relume
