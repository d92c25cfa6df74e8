// SPDX-License-Identifier: MIT
// What look-ups of all kinds do with the caches of a stencil.
#pragma once

#include "runtime/shared/resolve.h"
#include "runtime/shared/stencil.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

// A receiver whose normal can shade: nothing is read for others. False for NaN.
inline bool canShade(const glm::vec3& normal) { return glm::dot(normal, normal) <= kMaxNormal2; }

// Interpolated bands 0 and 1 of Y, Co and Cg, as far as they are there.
struct FirstBands {
  glm::vec3 constant{0.0f};
  std::array<glm::vec3, 3> linear{};  // vectors along the light

  // Those of a cache with weight w. [Size cache = bands.stride()]
  void add(const CacheBands& bands, const float* cache, float w) {
    const std::size_t begin[3] = {0, bands.lumaCount(), bands.lumaCount() + bands.chromaCount()};
    for (int channel = 0; channel < 3; ++channel) {
      const float* c = cache + begin[channel];
      constant[channel] += w * c[0];
      if ((channel == 0 ? bands.lumaBands : bands.chromaBands) < 2) continue;
      linear[static_cast<std::size_t>(channel)] += w * glm::vec3(c[3], c[1], c[2]);
    }
  }
};

// Co and Cg in proportion to Y, by least squares over coefficients 0 to 3. Squares of bright light would overflow: Y is
// measured in its largest coefficient.
inline glm::vec2 chromaOverLuma(const FirstBands& first) {
  const glm::vec3 magnitude = glm::abs(first.linear[0]);
  const float largest = std::max({std::abs(first.constant.x), magnitude.x, magnitude.y, magnitude.z});
  if (!(largest > 0.0f)) return glm::vec2(0.0f);
  const float constant = first.constant.x / largest;
  const glm::vec3 linear = first.linear[0] / largest;
  const auto product = [&](std::size_t channel) {
    return constant * first.constant[static_cast<int>(channel)] + glm::dot(linear, first.linear[channel]);
  };
  return glm::vec2(product(1), product(2)) / product(0);
}

}  // namespace relume
