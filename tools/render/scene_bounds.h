// SPDX-License-Identifier: MIT
// The box that holds all triangles' vertices of a level, dynamic ones with them.
#pragma once

#include "relume/bake/scene.h"

namespace relume {

struct SceneBounds {
  glm::vec3 min{0.0f}, max{0.0f};  // [m]
  bool empty = true;               // the level has no vertex
};

SceneBounds boundsOf(const Scene& scene);
// Of one of its instances.
SceneBounds boundsOf(const Scene& scene, const Instance& instance);

}  // namespace relume
