// SPDX-License-Identifier: MIT
// A light's intensity as people set it: how strong it is, which is its brightest channel, and its colour, which is the
// rest. A change of one leaves the other.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>

namespace relume {

// Of a light that is turned down: dark enough, and it keeps its colour.
inline constexpr float kLeastStrength = 1e-6f;

inline float strengthOf(const glm::vec3& intensity) { return std::max({intensity.x, intensity.y, intensity.z}); }

// [0..1] White of one that is dark.
inline glm::vec3 colorOfLight(const glm::vec3& intensity) {
  const float most = strengthOf(intensity);
  return most > 0.0f ? intensity / most : glm::vec3(1.0f);
}

inline glm::vec3 withStrength(const glm::vec3& intensity, float strength) {
  return std::max(strength, kLeastStrength) * colorOfLight(intensity);
}

// A colour counts by its hue and saturation alone, however bright it is; black has neither, and changes nothing.
inline glm::vec3 withColor(const glm::vec3& intensity, const glm::vec3& color) {
  const glm::vec3 shown = glm::clamp(color, 0.0f, 1.0f);
  return strengthOf(shown) > 0.0f ? std::max(strengthOf(intensity), kLeastStrength) * colorOfLight(shown) : intensity;
}

}  // namespace relume
