// SPDX-License-Identifier: MIT
// A level that leaks light where receivers read the next room.
#pragma once

#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"

#include <glm/geometric.hpp>

#include <random>
#include <utility>

namespace relume::test {

// Two closed rooms beside each other, 10 cm of wall between them with its middle at x = wall.
inline constexpr float kHalfWall = 0.05f;
inline Scene twoRooms(float wall) {
  Scene scene;
  Mesh lit, dark;
  addBox(lit, {-4, 0, -3}, {wall - kHalfWall, 3, 3}, true);
  addBox(dark, {wall + kHalfWall, 0, -3}, {4.3f, 3, 3}, true);
  addInstance(scene, std::move(lit), "lit");
  addInstance(scene, std::move(dark), "dark");
  scene.cameras = {cameraAt({-2.1f, 1.4f, 0.3f}), cameraAt({2.2f, 1.4f, -0.4f})};
  return scene;
}

// A receiver in the dark room: from 1 cm off its walls, every other one near the wall between, whichever way it looks.
struct DarkReceiver {
  glm::vec3 position, normal;
};
class DarkReceivers {
 public:
  explicit DarkReceivers(float wall) : low_(wall + kHalfWall + 0.01f, 0.01f, -2.99f) {}
  DarkReceiver next() {
    glm::vec3 u(uniform_(random_), uniform_(random_), uniform_(random_));
    if (count_++ % 2) u.x *= 0.25f;
    return {low_ + (glm::vec3(4.29f, 2.99f, 2.99f) - low_) * u,
            glm::normalize(glm::vec3(gauss_(random_), gauss_(random_), gauss_(random_)) + 1e-6f)};
  }

 private:
  glm::vec3 low_;
  int count_ = 0;
  std::mt19937 random_{3};
  std::uniform_real_distribution<float> uniform_{0.0f, 1.0f};
  std::normal_distribution<float> gauss_;
};

}  // namespace relume::test
