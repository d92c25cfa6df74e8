// SPDX-License-Identifier: MIT
// Lights that no bake was trained on, spread over a level by rules of our own.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/scene.h"

#include <vector>

namespace relume::test {

// Direct irradiance of a punctual light on a surface, shadowed, mean of the colours [W/m²].
float directIrradiance(const RayTracer& tracer, const SceneLight& light, const glm::vec3& positionWorld,
                       const glm::vec3& normal);

// Suns from all around, 30 to 90 degrees above the horizon, one the same solid angle.
std::vector<SceneLight> makeSuns(std::uint32_t count);
// Spots at random places in the open, looking at random, half cones of 15 to 40 degrees.
std::vector<SceneLight> makeSpots(const RayTracer& tracer, const PlaySpace& space, std::uint32_t count);
// A point light at equal distances along the longest of all shortest ways between places in the open that are near the
// ground.
std::vector<SceneLight> makeTorchPath(const RayTracer& tracer, const PlaySpace& space, std::uint32_t count);

}  // namespace relume::test
