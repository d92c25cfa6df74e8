// SPDX-License-Identifier: MIT
// The colours of signed differences, one map for all pictures of them.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

// Blue at -1, white at 0, red at 1; sRGB [0..1].
inline glm::vec3 diverging(float t) {
  const float s = std::clamp(std::abs(t), 0.0f, 1.0f);
  return glm::mix(glm::vec3(1.0f), t < 0.0f ? glm::vec3(0.13f, 0.40f, 0.67f) : glm::vec3(0.70f, 0.09f, 0.17f), s);
}

}  // namespace relume
