// SPDX-License-Identifier: MIT
// What the host tells the runtime about this frame's light. Radiometric units throughout.
#pragma once

#include "relume/moving_shapes.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <functional>
#include <span>

namespace relume {

// By how much the length of a light's direction may differ from 1.
inline constexpr float kDirectionTolerance = 0.01f;

enum class LightKind : std::uint32_t { directional = 0, point = 1, spot = 2 };

// A punctual light as KHR_lights_punctual defines it.
struct Light {
  LightKind kind = LightKind::point;
  glm::vec3 intensity{1.0f};      // [0..1e20] point, spot: I [W/sr]; directional: E [W/m²]
  glm::vec3 positionWorld{0.0f};  // [m] within 1e9 of the origin on each axis
  // The way the light travels, of length 1. Lengths within 1 % of that (kDirectionTolerance) are normalised; any other
  // is refused.
  glm::vec3 direction{0, -1, 0};
  float range = 0.0f;                 // [m] [>= 0, finite] 0 = no limit; else smooth window (1 - (d/range)^4)^+
  float innerConeRad = 0.0f;          // [rad] [0..outerConeRad]
  float outerConeRad = 0.785398163f;  // [rad] [0..pi]
};

// Share [0..1] of light `light` (index into LightSetup::lights) that reaches a point with unit normal: the host's
// shadows. Called from the threads of the host's own ParallelFor. Numbers outside [0..1] are clamped, NaN is 0.
using Visibility = std::function<float(std::uint32_t light, const glm::vec3& positionWorld, const glm::vec3& normal)>;

// The same for many points of one light at once, for hosts to whom a call is dear: shadow maps, ray tracing, other
// languages. Write visible[i] for position[i] and normal[i]; at most 256 of them, all facing the light. Called from the
// threads of the host's own ParallelFor. [Size position = normal = visible; visible is 0 at first]
using VisibilityBatch = std::function<void(std::uint32_t light, std::span<const glm::vec3> positionWorld,
                                           std::span<const glm::vec3> normal, std::span<float> visible)>;

// This frame's light of one drivable material (relume/emitters.h), in place of what the level gave it: a colour, or an
// image that is put where the emissive texture is. It lights receivers alone: the host draws the emitter itself. Only
// the sides that the bake knows as emitting shine. LightSetup::emissionScale does not scale it.
struct MaterialEmission {
  std::uint32_t material = 0;  // index into Emitters::materials; findMaterial() has it by name
  glm::vec3 radiance{1.0f};    // [W/m²/sr] [0..1e9] of the whole material; with an image, a factor on it
  // [W/m²/sr] [0..1e9 each] [Size 0, or width * height as declared in RelightOptions::drivenImages] row 0 first, which
  // is at texture coordinate v = 0: the top one in glTF. Linear, Rec. 709. Products with `radiance` beyond 1e9 are 1e9.
  std::span<const glm::vec3> image{};
  // GL backend: name of a GL_TEXTURE_2D of the declared size, with the texels of `image`; 0 = none. It is read from its
  // mip levels, which the host has to make (glGenerateMipmap); any filterable colour format. Texels that are NaN or
  // negative count as 0, what is above 1e9 as 1e9.
  std::uint32_t texture = 0;
};

// One frame's light. Spans are read during relight() only.
struct LightSetup {
  std::span<const Light> lights{};
  Visibility visibility{};  // CPU backend; empty = nothing is in shadow. The GL backend takes GLSL: RelightOptions
  VisibilityBatch visibilityBatch{};  // CPU backend; in place of `visibility`
  // The host's own direct light: irradiance [W/m²] at each surfel, in place of `lights` and their visibility.
  // [Size 0 or n_S]
  std::span<const glm::vec3> surfelIrradiance{};
  // GL backend: direct light is what the host's shader has written by GlResolve::surfelGlsl(), in place of all of the
  // above. What it does not write anew stays as it was in the frame before.
  bool surfelIrradianceOnGpu = false;
  glm::vec3 emissionScale{1.0f};  // [0..1e20] factor on the surfels' baked emission and on movingParts'; 0 = off
  std::span<const glm::vec3> surfelEmission{};  // [W/m²/sr] [Size 0 or n_S] in place of baked emission
  // Materials whose light is not the baked one, each at most once, in any order; those not named shine as baked. Not
  // together with surfelEmission.
  std::span<const MaterialEmission> materialEmissions{};
  glm::vec3 skyRadiance{0.0f};              // [W/m²/sr] a constant sky; unseen without sky patches in the bake
  std::span<const glm::vec3> skyPatches{};  // [Size 0 or skyDirection.size()] radiance a patch, in place of the
                                            // constant; projectEnvironment() makes it from a map
  float bounceScale = 1.0f;                 // [0..1] share of last frame's caches added at the surfels; 0 = one bounce
  // What moves through the level and takes part in its indirect light, as it stands in this frame. It shadows the
  // bake's links, emits emissionScale times its shape's emission, whatever materialEmissions say, and reflects the
  // light that falls on it: that of `lights`, by the same visibility, and last frame's of the bake's grid. A part acts
  // on caches for which the sphere around it covers more than 0.02 sr. Nothing is done where there are none.
  // [Size 0..RelightOptions::movingParts]
  std::span<const MovingPart> movingParts{};
  const MovingShapes* movingShapes = nullptr;  // what movingParts name; not null where there are some
};

}  // namespace relume
