// SPDX-License-Identifier: MIT
// The sky as light without a bake sees it: radiance by direction.
#pragma once

#include "relume/live_light.h"

#include <glm/vec3.hpp>

namespace relume {

// Radiance from a unit direction: of a map bilinear, across its border the nearest texel. The map has its size.
glm::vec3 skyAlong(const LiveSky& sky, const glm::vec3& direction);

}  // namespace relume
