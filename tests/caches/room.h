// SPDX-License-Identifier: MIT
// A room of 4 x 3 x 6 m, and few caches for it.
#pragma once

#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"

#include <cstdint>
#include <utility>

namespace relume::test {

inline const glm::vec3 kRoomLow(-2, 0, -3), kRoomHigh(2, 3, 3);

inline Scene roomScene() {
  Scene scene;
  scene.name = "room";
  Mesh room;
  addBox(room, kRoomLow, kRoomHigh, true);
  addInstance(scene, std::move(room), "room");
  scene.cameras = {cameraAt({0.1f, 1.4f, 2.2f})};
  return scene;
}

// A room whose floor, in one piece, goes on under a thin wall across it, with its middle at x = `middle`.
inline constexpr float kWall = 0.23f, kHalfThickness = 0.05f;
inline Scene walledRoomScene(float middle = kWall, float halfThickness = kHalfThickness) {
  Scene scene;
  Mesh room, wall;
  addBox(room, {-4, 0, -3}, {4, 3, 3}, true);
  addBox(wall, {middle - halfThickness, 0, -3}, {middle + halfThickness, 3, 3}, false);
  addInstance(scene, std::move(room), "room");
  addInstance(scene, std::move(wall), "wall");
  scene.cameras = {cameraAt({-2, 1.4f, 0.3f}), cameraAt({2, 1.4f, -0.4f})};
  return scene;
}

inline void place(Placed& p, const CacheOptions& options, int threads = 0,
                  PlaySpaceOptions::Mode mode = PlaySpaceOptions::Mode::seen) {
  Context context;
  context.threads = threads;
  PlaySpaceOptions space = walks(1u << 16);
  space.mode = mode;
  place(p, options, space, context);
}

inline CacheOptions fewCaches(std::uint32_t count) {
  CacheOptions options;
  options.lightmapCaches = count;
  options.gridCaches = 200;
  return options;
}

}  // namespace relume::test
