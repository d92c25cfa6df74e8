// SPDX-License-Identifier: MIT
// Rays against the instances of a scene, by Embree, which ray_tracer_state.h and bundle_tree.h include.
// Alpha-masked texels let rays through. Thread-safe after construction. Hits are the same on any processor, with any
// instruction set, in packets and alone, but for about one ray in a million where small triangles overlap
// (docs/notes/determinism.md).
#pragma once

#include "relume/bake/scene.h"
#include "relume/result.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>

namespace relume {

struct Ray {
  glm::vec3 origin{0.0f};
  float tMin = 0.0f;                                    // [m]
  glm::vec3 direction{0.0f};                            // unit
  float tMax = std::numeric_limits<float>::infinity();  // [m]
};

struct Hit {
  float distance = std::numeric_limits<float>::infinity();  // [m] infinite = nothing hit
  std::uint32_t instance = kNone;
  std::uint32_t triangle = 0;  // within the instance
  glm::vec2 barycentric{0.0f};
  bool back = false;  // the back side of the triangle was hit
  explicit operator bool() const { return instance != kNone; }
  SurfacePoint point() const { return {instance, triangle, barycentric}; }
};

// How the rays of one call relate. coherent: neighbours start at one point in nearly the same direction, so that a
// packet walks the structure together. A hint for speed; hits do not depend on it.
enum class RayOrder { mixed, coherent };

// How much work goes into the acceleration structure. thorough: rays are 1.13 times as fast, and building takes four
// times as long (0.29 s against 0.07 s on 262k triangles), which pays from about ten million rays on. bundles:
// thorough, and in addition a structure for RayBundle (0.1 s, built on another thread) unless the level is too large
// for it; quickBundles: quick, and that. shadows: quick, for those who ask for occluded() alone: where surfaces
// overlap, which of them is hit is not looked into, which is half of the work.
enum class RayStructure { quick, thorough, bundles, quickBundles, shadows };
inline bool isQuick(RayStructure s) { return s != RayStructure::thorough && s != RayStructure::bundles; }
inline bool isForBundles(RayStructure s) { return s == RayStructure::bundles || s == RayStructure::quickBundles; }

// Which instances rays meet. fixed: those that are baked. drawn: dynamic ones, too.
enum class RayGeometry { fixed, drawn };

class RayTracer {
 public:
  // Builds the acceleration structure. isa: "avx2", "avx512", "sse4.2" or "" (best). unsupported: the processor has not
  // got it; memory; failed: Embree's own message.
  static Result<RayTracer> create(const Scene& scene, const std::string& isa, Context& context,
                                  RayStructure structure = RayStructure::thorough,
                                  RayGeometry geometry = RayGeometry::fixed);
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;
  ~RayTracer();

  Hit trace(const Ray& ray) const;
  // Nearest hits of many rays, traced in packets. [Size hits >= rays]
  void trace(std::span<const Ray> rays, std::span<Hit> hits, RayOrder order = RayOrder::mixed) const;
  bool occluded(const Ray& ray) const;
  // occluded[i] = 1 where ray i is blocked. [Size occluded >= rays]
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;

  const Scene& scene() const;
  RayGeometry geometry() const;
  std::string description() const;  // "embree 3.13.5 isa=avx2"
  // World bounds of the instances that rays meet. [m]
  glm::vec3 boundsMin() const;
  glm::vec3 boundsMax() const;
  // Distance [m] off a surface at which rays from it should start: a small multiple of the spacing of floats there.
  float epsilonAt(const glm::vec3& positionWorld) const;

 private:
  friend class RayBundle;
  struct State;
  explicit RayTracer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
