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

// Irradiance [W/m²] at a point with unit normal by one light, shadows left out.
glm::vec3 directIrradiance(const Light& light, const glm::vec3& positionWorld, const glm::vec3& normal);

}  // namespace relume
