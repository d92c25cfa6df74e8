// SPDX-License-Identifier: MIT
// Reflective shadow maps of plates, for tests.
#pragma once

#include "runtime/live/rsm_image.h"

#include <numbers>
#include <vector>

namespace relume::test {

// A plate that fills [-1, 1]² at height 0 and faces up.
inline float plateArea() { return 4.0f; }

struct LitPlate {
  std::uint32_t side;
  std::vector<RsmTexel> texel;

  explicit LitPlate(std::uint32_t texels, const glm::vec3& radiance = glm::vec3(1.0f)) : side(texels) {
    const float step = 2.0f / static_cast<float>(side);
    for (std::uint32_t i = 0; i < side * side; ++i) {
      RsmTexel t;
      t.positionWorld = {(static_cast<float>(i % side) + 0.5f) * step - 1.0f, 0.0f,
                         (static_cast<float>(i / side) + 0.5f) * step - 1.0f};
      t.normal = {0, 1, 0};
      t.area = step * step;
      t.flux = std::numbers::pi_v<float> * t.area * radiance;
      texel.push_back(t);
    }
  }
  // Somewhere else, facing another way; both axes of the plate are unit.
  void place(const glm::vec3& middle, const glm::vec3& right, const glm::vec3& up, const glm::vec3& normal) {
    for (RsmTexel& t : texel) {
      t.positionWorld = middle + t.positionWorld.x * right + t.positionWorld.z * up;
      t.normal = normal;
    }
  }
  RsmImage image() const { return {texel, side, 1}; }
};

}  // namespace relume::test
