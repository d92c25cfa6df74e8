// SPDX-License-Identifier: MIT
// A level that leaks light where receivers read the next room.
#pragma once

#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"

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

}  // namespace relume::test
