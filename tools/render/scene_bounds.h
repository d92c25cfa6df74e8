// SPDX-License-Identifier: MIT
// The box that holds all triangles' vertices of a level, dynamic ones with them, and boxes made of it.
#pragma once

#include "relume/bake/scene.h"

#include <array>
#include <optional>

namespace relume {

struct SceneBounds {
  glm::vec3 min{0.0f}, max{0.0f};  // [m]
  bool empty = true;               // the level has no vertex
};

SceneBounds boundsOf(const Scene& scene);
// Of one of its instances.
SceneBounds boundsOf(const Scene& scene, const Instance& instance);
// The part of a level where light without a bake is wanted, of one that is much wider than its play volumes (a house on
// a ground of kilometres): what lies within their longest side of them. Nothing = all of it.
std::optional<SceneBounds> livePartOf(const Scene& scene);
SceneBounds joined(const SceneBounds& a, const SceneBounds& b);
float longestSide(const SceneBounds& bounds);  // [m]
float diagonal(const SceneBounds& bounds);     // [m]
// [m²] Of what of a triangle lies in a box.
double areaWithin(const SceneBounds& box, const std::array<glm::vec3, 3>& triangle);

}  // namespace relume
