// SPDX-License-Identifier: MIT
// See pack_lights.h.
#include "runtime/passes/pack_lights.h"

#include "runtime/light_window.h"

#include <cmath>
#include <cstddef>

namespace relume::gpu {

void packLights(std::span<const Light> lights, std::pmr::vector<gl::RelumeLight>& packed) {
  packed.resize(lights.size());
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Light& from = lights[i];
    gl::RelumeLight& to = packed[i];
    const bool directional = from.kind == LightKind::directional, spot = from.kind == LightKind::spot;
    const float cosOuter = std::cos(from.outerConeRad);
    const float coneScale = spot ? 1.0f / std::max(std::cos(from.innerConeRad) - cosOuter, 0.001f) : 0.0f;
    to.position = glm::vec4(from.positionWorld, directional ? -1.0f : inverseRangeSquared(from.range));
    // A point light's direction may hold anything, also what is not finite.
    to.direction = directional || spot ? glm::vec4(from.direction, coneScale) : glm::vec4(0.0f);
    to.intensity = glm::vec4(from.intensity, spot ? -cosOuter * coneScale : 1.0f);
  }
}

}  // namespace relume::gpu
