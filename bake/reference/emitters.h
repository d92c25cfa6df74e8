// SPDX-License-Identifier: MIT
// The emitting triangles of a level as one light: points on them are drawn by area times radiance.
#pragma once

#include "bake/base/random.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/scene.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// A point drawn on an emitter.
struct EmitterSample {
  glm::vec3 position{0.0f};  // [m]
  glm::vec3 normal{0.0f};    // unit, geometric, front side
  glm::vec3 radiance{0.0f};  // [W/m²/sr] of the side it emits from
  glm::vec3 emission{0.0f};  // [W/m²/sr] the material's factor: the same without textures
  bool bothSides = false;
  float density = 0.0f;  // [1/m²] probability per area
};

class EmittingTriangles {
 public:
  // Collect the emitting triangles of the fixed instances, or of all that are drawn.
  explicit EmittingTriangles(const Scene& scene, RayGeometry geometry = RayGeometry::fixed);

  bool empty() const { return cumulative_.empty(); }
  // Draw a point; density 0 when there is no emitter.
  EmitterSample sample(RandomStream& random) const;
  // The same by numbers of the caller's: u [0..1) chooses the triangle, v [0..1)² the point on it.
  EmitterSample sample(double u, const glm::vec2& v) const;
  // Draw by what would arrive at a point if nothing were in the way, where the triangles are few enough to ask each of
  // them; else as above. `chances` is replaced: cumulative, one for each triangle; empty: no triangle faces the point.
  // normal must be unit.
  void aim(const glm::vec3& positionWorld, const glm::vec3& normal, std::vector<float>& chances) const;
  EmitterSample sample(std::span<const float> chances, double u, const glm::vec2& v) const;
  static constexpr std::size_t kMaxAimed = 64;  // triangles
  // [W/m²] Irradiance if nothing were in the way and no emitter had a texture, in closed form: what means of many
  // connections' openIrradiance() come to. Normals must be unit. Not known where there are more than kMaxOpen
  // triangles.
  bool knowsOpenIrradiance() const { return !few_.empty() && few_.size() <= kMaxOpen; }
  glm::vec3 openIrradiance(const glm::vec3& positionWorld, const glm::vec3& shading, const glm::vec3& geometric) const;
  static constexpr std::size_t kMaxOpen = 16;  // triangles
  // [1/m²] probability per area with which sample() finds this point; 0 where nothing emits.
  float density(const SurfacePoint& p) const;

 private:
  struct Triangle {
    glm::vec3 center, normal;  // [m]; unit, front side
    float area;                // [m²]
    float power;               // area x luminance
    glm::vec3 emission;        // [W/m²/sr] the material's factor
    bool bothSides;
  };
  EmitterSample pointOn(std::size_t k, const glm::vec2& v) const;

  const Scene& scene_;
  std::vector<std::uint32_t> instance_, triangle_;  // [Size emitters]
  std::vector<double> cumulative_;                  // [Size emitters] power up to and with this one, sums to 1
  std::vector<Triangle> few_;                       // [Size emitters, or 0 where there are more than kMaxAimed]
  std::vector<float> perInstance_;                  // [1/m²] [Size instances] density on an instance's triangles
};

// How a point that was drawn on an emitter is seen from a surface.
struct EmitterConnection {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] toward the surface; zero where something is in the way
  glm::vec3 emission{0.0f};  // [W/m²/sr] the material's factor, whatever is in the way
  float cosine = 0.0f;       // at the surface; zero: the two do not face each other, and nothing else has a meaning
  float cosEmitter = 0.0f;   // at the emitter
  float distance = 0.0f;     // [m]
  float density = 0.0f;      // [1/m²] probability per area

  // [W/m²] Irradiance over the probability of having drawn the point: L cos cosEmitter / (d² density).
  glm::vec3 irradiance() const;
  // [W/m²] The same if nothing were in the way and the emitter had no texture.
  glm::vec3 openIrradiance() const;

 private:
  float solidAngle() const;  // [sr] projected, over the probability
};

// Connect a sample with a surface by a shadow ray from `origin`, which lies a little off it. Normals must be unit.
EmitterConnection connectEmitter(const RayTracer& tracer, const EmitterSample& sample, const glm::vec3& origin,
                                 const glm::vec3& shading, const glm::vec3& geometric);

}  // namespace relume
