// SPDX-License-Identifier: MIT
// Lights as a C host hands them over.
#pragma once

#include "relume/lights.h"
#include "relume/relume.h"

#include <cstring>
#include <span>
#include <vector>

namespace relume::test {

inline std::vector<relume_light> cLights(std::span<const Light> lights) {
  std::vector<relume_light> all;
  for (const Light& light : lights) {
    relume_light c{};
    c.kind = static_cast<relume_light_kind>(light.kind);
    std::memcpy(c.intensity, &light.intensity, sizeof c.intensity);
    std::memcpy(c.position, &light.positionWorld, sizeof c.position);
    std::memcpy(c.direction, &light.direction, sizeof c.direction);
    c.range = light.range;
    c.inner_cone_radians = light.innerConeRad;
    c.outer_cone_radians = light.outerConeRad;
    all.push_back(c);
  }
  return all;
}

}  // namespace relume::test
