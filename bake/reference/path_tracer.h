// SPDX-License-Identifier: MIT
// Ground truth: a plain Lambertian path tracer on the same scene, rays and radiometry as the baker. What the camera
// sees may be glossy.
#pragma once

#include "bake/base/random.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/result.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relume {

struct ReferenceOptions {
  std::uint32_t width = 320, height = 180;  // [1..16384]
  std::uint32_t samplesPerPixel = 256;      // [1..1e6]
  std::uint32_t maxBounces = 12;            // [0..1024] reflections before the light arrives
  bool emissive = false;                    // emitting surfaces are on
  Sky sky;
  std::uint64_t seed = 1;
  std::optional<float>
      exponent{};      // [0..kMaxExponent] trace glossy layers as well, by lobes cos^exponent; empty = none
  bool gloss = false;  // trace glossy layers by the materials (relume/glossy.h) of the surfaces that the camera sees
  std::optional<float> occlusionFalloff{};  // [1/m] [0..1e6] trace the layer `open`; empty = not
};

// Pixel means by a box filter, row 0 on top, 3 floats a pixel. Layers as in an AOV set:
struct ReferenceImage {
  std::uint32_t width = 0, height = 0;
  std::vector<glm::vec3> direct;    // irradiance / pi by punctual lights, emitters and sky, albedo divided out
  std::vector<glm::vec3> indirect;  // irradiance / pi by light reflected at least once
  // (half A - half B) / 2 of the even and the odd samples; the square estimates the variance. Zero for one sample.
  std::vector<glm::vec3> directError, indirectError;
  // Mean radiance [W/m²/sr] in lobes cos^exponent about the reflected direction, as far as they lie above the surface:
  // straight from emitters and sky, and reflected at least once. Punctual lights have no size and are not in it. Misses
  // of the camera's rays count as black. Empty without ReferenceOptions::exponent and gloss. With gloss they are what
  // the surface mirrors of it, its reflectance included; the highlights of punctual lights are part of glossyDirect;
  // albedo is what the surface scatters (ReflectanceSplit::diffuse), normals are bent by normal maps, and radiance is
  // (direct + indirect) albedo + glossyDirect + glossyIndirect + emission. What other surfaces send is diffuse, as in a
  // bake.
  bool mirrors = false;  // whether ReferenceOptions::gloss was set
  std::vector<glm::vec3> glossyDirect, glossyIndirect, glossyDirectError, glossyIndirectError;
  std::vector<glm::vec3> albedo, emission;
  // Share of the cosine-weighted hemisphere about the normal that is open: what blocks it at distance d counts as
  // hidden by 1 / (1 + falloff d), 1 where the camera sees nothing. Empty without ReferenceOptions::occlusionFalloff.
  std::vector<float> open;
  std::vector<glm::vec3> position, normal;  // at the pixel centre; normal toward the viewer
  std::vector<float> depth;                 // [m] along the viewing axis at the pixel centre; 0 = nothing
};

// Render what a camera sees. `tracer` has what light travels among: what blocks, reflects and emits it. `drawn`, of the
// same scene, has what the camera sees and what casts shadows of the punctual lights; null: the same. direct and
// indirect are weighted by albedo inside a pixel (sum of radiance / sum of albedo) and 0 where a channel's albedo is 0.
// Same image at any thread count. usage: an option out of range; failed: cancelled.
Result<ReferenceImage> renderReference(const RayTracer& tracer, const Camera& camera,
                                       std::span<const SceneLight> lights, const ReferenceOptions& options,
                                       Context& context, const RayTracer* drawn = nullptr);

// Irradiance [W/m²] of punctual lights at a point, shadows by rays. normal must be unit.
glm::vec3 directIrradiance(const RayTracer& tracer, std::span<const SceneLight> lights, const glm::vec3& positionWorld,
                           const glm::vec3& normal);
// The same of many points at once: their shadow rays go in packets. [Size positionWorld = normal = irradiance]
void directIrradiance(const RayTracer& tracer, std::span<const SceneLight> lights,
                      std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                      std::span<glm::vec3> irradiance);
// The same without shadows: unshadowed irradiance of one light, and the direction toward it and its distance.
glm::vec3 lightIrradiance(const SceneLight& light, const glm::vec3& positionWorld, const glm::vec3& normal,
                          glm::vec3& toLight, float& distance);
// Radiance [W/m²/sr] of the punctual lights in a lobe cos^exponent about the unit direction `reflected`, shadows by
// rays: (n + 1) / (2 pi) cos^n of their irradiance across the ray. Lights below the plane of `geometric`, unit, are not
// seen.
glm::vec3 directHighlights(const RayTracer& tracer, std::span<const SceneLight> lights, const glm::vec3& positionWorld,
                           const glm::vec3& geometric, const glm::vec3& reflected, float exponent);

// A direction drawn from the lobe cos^exponent about a unit direction by two numbers of 0..1.
glm::vec3 lobeDirection(const glm::vec3& axis, float exponent, const glm::vec2& u);
// The same above the plane of `geometric`, unit; zero where next to nothing of the lobe is: interpolated normals
// reflect some rays below the surface.
glm::vec3 lobeDirectionAbove(const glm::vec3& axis, float exponent, const glm::vec3& geometric, RandomStream& random);

}  // namespace relume
