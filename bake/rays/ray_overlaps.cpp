// SPDX-License-Identifier: MIT
// Resolves ties: rays that meet several triangles at one point, on an edge or where surfaces overlap. Overlaps are
// found beforehand. At a tie, a second query names all triangles, and a rule takes one of them.
#include "bake/rays/ray_tracer_state.h"

#include "bake/base/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <tuple>
#include <vector>

namespace relume {
namespace {

constexpr float kMaxPerDepth = 100.0f;  // distance along the ray per distance in depth, limited for grazing rays

// A query whose filter notes every triangle that the ray meets and lets the ray pass.
template <class Note>
struct EveryHit : RTCIntersectContext {
  explicit EveryHit(const Note& note) : note_(note) {
    rtcInitIntersectContext(this);
    filter = &onHits;
  }
  void trace(RTCScene scene, const RTCRay& ray) {
    RTCRayHit rayHit{};
    rayHit.ray = ray;
    rayHit.hit.geomID = rayHit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, this, &rayHit);
  }

 private:
  static void onHits(const RTCFilterFunctionNArguments* args) {
    for (unsigned i = 0; i < args->N; ++i) {
      if (args->valid[i] != -1) continue;
      const unsigned above = RTCHitN_instID(args->hit, args->N, i, 0);
      static_cast<const EveryHit*>(args->context)
          ->note_(above != RTC_INVALID_GEOMETRY_ID ? above : RTCHitN_geomID(args->hit, args->N, i),
                  RTCHitN_primID(args->hit, args->N, i));
      args->valid[i] = 0;
    }
  }
  const Note& note_;
};

// 1 for the vertices of a mesh that very many triangles share.
std::vector<std::uint8_t> crowdedVertices(const Mesh& mesh) {
  constexpr std::uint32_t kCrowd = 1000;  // [triangles]
  if (mesh.triangle.size() < kCrowd) return {};
  std::vector<std::uint32_t> count(mesh.position.size(), 0);
  for (const glm::uvec3& t : mesh.triangle) {
    for (int k = 0; k < 3; ++k) ++count[t[k]];
  }
  std::vector<std::uint8_t> crowded(count.size());
  std::transform(count.begin(), count.end(), crowded.begin(), [](std::uint32_t n) { return n >= kCrowd ? 1 : 0; });
  return crowded;
}

}  // namespace

// Of all triangles around a hit, take the first of those whose front is hit: a sheet that is modelled twice, once for
// each side, then shows on either side the triangle made for it.
Hit RayTracer::State::resolveTie(const Ray& ray, unsigned id, std::uint32_t triangle, float distance) const {
  const auto rank = [&](unsigned anyId, std::uint32_t any) {
    const Corners c = cornersOf(anyId, any);
    return std::tuple(glm::dot(glm::cross(c[1] - c[0], c[2] - c[0]), ray.direction) > 0.0f, anyId, any);
  };
  auto first = rank(id, triangle);
  const auto note = [&](unsigned otherId, std::uint32_t other) {
    // Where thousands overlap, most come after a front: their corners are not looked up.
    const auto& [isBack, firstId, firstTriangle] = first;
    if (!isBack && std::tie(otherId, other) >= std::tie(firstId, firstTriangle)) return;
    first = std::min(first, rank(otherId, other));
  };
  const Corners c = cornersOf(id, triangle);
  const glm::vec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
  const float perDepth =
      glm::length(normal) / std::max(std::abs(glm::dot(normal, ray.direction)), std::numeric_limits<float>::min());
  const float around = (rounding + kEpsilonUlps * std::numeric_limits<float>::epsilon() * distance) *
                       std::clamp(perDepth, 1.0f, kMaxPerDepth);
  RTCRay near = toEmbree(ray, shift);
  near.tnear = std::max(near.tnear, distance - around);
  near.tfar = std::min(near.tfar, distance + around);
  EveryHit query(note);
  query.trace(top.get(), near);
  std::tie(std::ignore, id, triangle) = first;
  HitPoints<1> point;
  point.put(0, cornersOf(id, triangle), ray.origin - shift, ray.direction, ray.tMin, ray.tMax);
  findHitPoints(point);
  return {point.distance[0], instance[id], triangle, point.barycentric(0), point.facing[0] > 0.0f};
}

// Mark the triangles that lie in the plane of another one and overlap it, as tested near the corners and the middle of
// the last edge of either. Corners that very many triangles share are left out: where 100,000 needles meet, a ray meets
// the boxes of a quarter of them.
void RayTracer::State::findOverlaps(Context& context) {
  // Barycentric test points: near each corner, in order, and the middle of the last edge.
  constexpr std::array<glm::vec2, 4> kPoints = {{{0.04f, 0.04f}, {0.92f, 0.04f}, {0.04f, 0.92f}, {0.48f, 0.48f}}};
  constexpr std::size_t kGrain = 2048;  // [triangles]
  std::vector<std::size_t> first{0};    // of each geometry's triangles
  std::vector<std::vector<std::uint8_t>> crowded(scene->meshes.size());
  for (unsigned id = 0; id < vertices.size(); ++id) {
    const std::uint32_t mesh = scene->instances[instance[id]].mesh;
    if (vertices[id] != nullptr) {
      overlaps[id].resize(scene->meshes[mesh].triangle.size());
      if (crowded[mesh].empty()) crowded[mesh] = crowdedVertices(scene->meshes[mesh]);
    }
    first.push_back(first.back() + overlaps[id].size());
  }
  parallelChunks(context, "", first.back(), kGrain, [&](std::size_t begin, std::size_t end) {
    const FlushDenormals flush;
    auto id = static_cast<unsigned>(std::upper_bound(first.begin(), first.end(), begin) - first.begin()) - 1;
    for (std::size_t i = begin; i < end; ++i) {
      while (i >= first[id + 1]) ++id;
      const auto t = static_cast<std::uint32_t>(i - first[id]);
      if (isBuried(id, t)) continue;
      const auto note = [&](unsigned otherId, std::uint32_t other) {
        if (otherId == id && other == t) return;
        std::atomic_ref(overlaps[id][t]).store(1, std::memory_order_relaxed);
        if (!overlaps[otherId].empty()) std::atomic_ref(overlaps[otherId][other]).store(1, std::memory_order_relaxed);
      };
      EveryHit query(note);
      const Corners c = cornersAt(vertices[id], t);
      const glm::vec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
      const float length = glm::length(normal);
      if (!(length > 0.0f)) continue;
      const std::uint32_t mesh = scene->instances[instance[id]].mesh;
      const glm::uvec3& corners = scene->meshes[mesh].triangle[t];
      for (int k = 0; k < 4; ++k) {
        if (k < 3 && !crowded[mesh].empty() && crowded[mesh][corners[k]] != 0) continue;
        const glm::vec2 at = kPoints[static_cast<std::size_t>(k)];
        Ray ray;
        ray.direction = normal / length;
        ray.origin = c[0] + (c[1] - c[0]) * at.x + (c[2] - c[0]) * at.y - rounding * ray.direction;
        ray.tMax = 2.0f * rounding;
        query.trace(top.get(), toEmbree(ray, glm::vec3(0.0f)));
      }
    }
  });
}

}  // namespace relume
