// SPDX-License-Identifier: MIT
// A room of 8 x 4 x 4 m with a red wall across it at x = 0, instance kWall, and a lamp in the left half.
#pragma once

#include "relume/bake/scene.h"
#include "tests/rays/make_scene.h"

#include <cstdint>

namespace relume::test {

inline constexpr std::uint32_t kWall = 1;

// Add the room and the wall; returns the material of the room's walls. Without finish().
inline std::uint32_t addWalledRoom(Scene& scene) {
  const std::uint32_t grey = addMaterial(scene, glm::vec3(0.6f)), red = addMaterial(scene, {0.7f, 0.2f, 0.1f});
  addInstance(scene, box({-4, 0, -2}, {4, 4, 2}, true, grey));
  addInstance(scene, box({-0.3f, 0, -2}, {0.3f, 4, 2}, false, red));
  return grey;
}

inline SceneLight lampOfWalledRoom() {
  SceneLight lamp;
  lamp.positionWorld = {-2.0f, 3.0f, 0.3f};
  lamp.intensity = glm::vec3(20.0f);
  return lamp;
}

}  // namespace relume::test
