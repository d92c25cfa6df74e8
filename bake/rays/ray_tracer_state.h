// SPDX-License-Identifier: MIT
// What a RayTracer holds, for the files that build it and those that trace with it. See ray_tracer.cpp.
#pragma once

#include "bake/rays/bundle/bundle_tree.h"
#include "bake/rays/hit_points.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"

#include <embree3/rtcore.h>
#if defined(__SSE2__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace relume {

inline constexpr float kEpsilonUlps = 16.0f;  // a hit's position is off by a few roundings of its coordinates
// Of a level far from the origin, which is traced around its own centre, that is off by the roundings of the world's
// coordinates alone: of the place, of the step off the surface, and of either's sum.
inline constexpr float kFarEpsilonUlps = 4.0f;

// Flush denormals in this thread while rays are traced. Only then: exact predicates elsewhere need denormals.
class FlushDenormals {
 public:
#if defined(__SSE2__)
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON); }
  ~FlushDenormals() { _mm_setcsr(saved_); }

 private:
  unsigned saved_;
#else
  FlushDenormals() {}
  ~FlushDenormals() {}
#endif
 public:
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;
};

struct DeviceDeleter {
  void operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
};
struct SceneDeleter {
  void operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }
};
using DevicePtr = std::unique_ptr<RTCDeviceTy, DeviceDeleter>;
using ScenePtr = std::unique_ptr<RTCSceneTy, SceneDeleter>;

inline float largest(const glm::vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

inline Corners cornersAt(const float* vertices, std::uint32_t triangle) {
  Corners c;
  std::memcpy(&c, vertices + 9 * static_cast<std::size_t>(triangle), sizeof c);
  return c;
}

// What the alpha test of a geometry needs to find the point of the surface that a ray meets.
struct MaskedMesh {
  const Scene* scene = nullptr;
  std::uint32_t instance = kNone;   // any instance of the mesh: all have the same texture coordinates
  const float* vertices = nullptr;  // [Size 9 x triangles] Embree's, in the space in which it passes rays to filters
};

inline RTCRay toEmbree(const Ray& ray, const glm::vec3& shift) {
  RTCRay r{};
  r.org_x = ray.origin.x - shift.x;
  r.org_y = ray.origin.y - shift.y;
  r.org_z = ray.origin.z - shift.z;
  r.dir_x = ray.direction.x;
  r.dir_y = ray.direction.y;
  r.dir_z = ray.direction.z;
  r.tnear = ray.tMin;
  r.tfar = ray.tMax;
  r.mask = 0xFFFFFFFFu;
  return r;
}

struct RayTracer::State {
  const Scene* scene = nullptr;
  RayGeometry geometry = RayGeometry::fixed;
  DevicePtr device;  // released after the scenes
  std::vector<ScenePtr> shared;
  ScenePtr top;
  std::vector<std::unique_ptr<MaskedMesh>> masked;
  std::vector<std::uint32_t> instance;  // [Size geometries] instance of a geometry id of the top scene
  std::vector<const float*> vertices;   // [Size geometries] Embree's, as traced, 9 per triangle; null where shared
  glm::vec3 shift{0.0f};                // [m] traced coordinates are world minus shift
  glm::vec3 boundsMin{0.0f}, boundsMax{0.0f};  // [m]
  float epsilonFloor = 0.0f;                   // [m]
  float rounding = 0.0f;                       // [m] of traced coordinates
  std::vector<std::vector<std::uint8_t>>
      overlaps;  // [Size geometries][Size triangles, 0 where shared] 1: overlaps others
  std::vector<std::vector<std::uint8_t>> buried;  // [Size geometries][Size triangles or 0] 1: not traced (ray_piles.h)
  BundleTree bundles;                             // empty: bundles are traced in packets
  unsigned width = 1;                             // rays per packet
  std::string error, description;

  static void onError(void* self, RTCError, const char* text) {
    auto& state = *static_cast<State*>(self);
    if (state.error.empty()) state.error = text;
  }

  // The top scene's geometry that was hit, an instance where it is one.
  static unsigned idOf(unsigned geomId, unsigned instanceId) {
    return instanceId != RTC_INVALID_GEOMETRY_ID ? instanceId : geomId;
  }
  bool isBuried(unsigned id, std::uint32_t triangle) const { return !buried[id].empty() && buried[id][triangle] != 0; }
  Corners cornersOf(unsigned id, std::uint32_t triangle) const;
  void prefetch(unsigned count, const unsigned* geomId, const unsigned* instanceId, const unsigned* triangle) const;
  // Hits of rays on triangles of geometries (or instances) of the top scene. geomId: invalid = nothing hit.
  template <unsigned Width>
  void toHits(std::span<const Ray> rays, const unsigned* geomId, const unsigned* instanceId, const unsigned* triangle,
              std::span<Hit> hits) const;
  Hit resolveTie(const Ray& ray, unsigned id, std::uint32_t triangle, float distance) const;
  void findOverlaps(Context& context);
  BundleTree makeBundleTree(const Context& context) const;
  void noteOverlapsInBundleTree();
};

}  // namespace relume
