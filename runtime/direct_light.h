// SPDX-License-Identifier: MIT
// Light of punctual lights at one point, as KHR_lights_punctual defines them, read in radiometric units.
#pragma once

#include "relume/lights.h"

#include <glm/vec3.hpp>

namespace relume {

// What is multiplied with the cosine between a spot's direction and a receiver, less the cosine of its outer angle: the
// smooth edge, 1 inside the inner angle.
struct SpotEdge {
  float cosOuter = 0.0f, scale = 0.0f;
};
SpotEdge spotEdge(const Light& light);

// Irradiance [W/m²] with unit normal by one light, shadows left out: at a point, or the mean over a disc of that radius
// [m] about it. Of a point light that is what the disc sees of the light's directions, over its area, within 13 %: a
// light right before a surfel lights it by at most the half of space, and surfels side by side by all of it.
glm::vec3 directIrradiance(const Light& light, const glm::vec3& positionWorld, const glm::vec3& normal,
                           float radius = 0.0f);

// From so many radii on a disc is lit as its middle is: by then they differ by a hundredth.
inline constexpr float kDiscReach = 8.0f;

}  // namespace relume
