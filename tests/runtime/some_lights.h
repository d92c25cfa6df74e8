// SPDX-License-Identifier: MIT
// Lights for tests of both backends.
#pragma once

#include "relume/lights.h"

#include <glm/geometric.hpp>

#include <array>
#include <vector>

namespace relume::test {

// A light of each kind, for the room of makeSyntheticBake().
inline std::vector<Light> someLights() {
  std::vector<Light> lights(3);
  lights[0] = {
      .kind = LightKind::directional, .intensity = {3, 2, 1}, .direction = glm::normalize(glm::vec3(1, -2, 0.5f))};
  lights[1] = {.kind = LightKind::point, .intensity = {5, 9, 20}, .positionWorld = {2, 1, 1}, .range = 8.0f};
  lights[2] = {.kind = LightKind::spot,
               .intensity = {90, 30, 10},
               .positionWorld = {9, 3, 3},
               .direction = glm::normalize(glm::vec3(-1, -1, 0)),
               .innerConeRad = 0.3f,
               .outerConeRad = 0.7f};
  return lights;
}

// A red lamp and a bluish sun: each channel has light of its own.
inline std::array<Light, 2> lampAndSun() {
  return {
      Light{.kind = LightKind::point, .intensity = {60, 1, 1}, .positionWorld = {2, 1, 1}},
      Light{
          .kind = LightKind::directional, .intensity = {1, 2, 3}, .direction = glm::normalize(glm::vec3(1, -2, 0.5f))}};
}

}  // namespace relume::test
