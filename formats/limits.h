// SPDX-License-Identifier: MIT
// How large the numbers of a level and of a bake may be. Within these bounds no square of a distance, of an area or of
// a radiance leaves single precision; what a punctual light arrives with is never squared. The importer, the validator
// and the runtime refuse what is beyond.
#pragma once

#include <glm/vec3.hpp>

#include <cmath>

namespace relume {

// [m] What a level may have along an axis, positions and sizes: eight times the Earth's diameter. A float is exact to
// 4 m there. The fourth power of the widest distance, the square of a large triangle's area, is 1e34: representable.
inline constexpr float kMaxLevelCoordinate = 1e8f;
// [m] What a bake may have along an axis: room for a grid and caches around the widest level.
inline constexpr float kMaxCoordinate = 1e9f;
// [W/m²/sr] Emission: pi times it, radiosity, is below the 2^32 W/m² that the runtime's packed colours hold. The sun
// has 2e7.
inline constexpr float kMaxRadiance = 1e9f;
// [W/sr] or [W/m²] Intensity of a punctual light. At its nearest, a tenth of a millimetre, it lights with 1e8 times it.
inline constexpr float kMaxIntensity = 1e20f;

// False for NaN.
inline bool isWithin(const glm::vec3& v, float max) {
  return std::abs(v.x) <= max && std::abs(v.y) <= max && std::abs(v.z) <= max;
}

// Whether all channels are from 0 to kMaxRadiance. False for NaN.
inline bool isRadiance(const glm::vec3& v) {
  return isWithin(v, kMaxRadiance) && v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f;
}

}  // namespace relume
