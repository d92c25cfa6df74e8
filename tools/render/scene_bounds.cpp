// SPDX-License-Identifier: MIT
// See scene_bounds.h.
#include "tools/render/scene_bounds.h"

#include <glm/common.hpp>
#include <glm/vec4.hpp>

namespace relume {
namespace {

void add(const Scene& scene, const Instance& instance, SceneBounds& bounds) {
  for (const glm::vec3& p : scene.meshes[instance.mesh].position) {
    const glm::vec3 world(instance.toWorld * glm::vec4(p, 1.0f));
    bounds.min = bounds.empty ? world : glm::min(bounds.min, world);
    bounds.max = bounds.empty ? world : glm::max(bounds.max, world);
    bounds.empty = false;
  }
}

}  // namespace

SceneBounds boundsOf(const Scene& scene) {
  SceneBounds bounds;
  for (const Instance& instance : scene.instances) add(scene, instance, bounds);
  return bounds;
}

SceneBounds boundsOf(const Scene& scene, const Instance& instance) {
  SceneBounds bounds;
  add(scene, instance, bounds);
  return bounds;
}

}  // namespace relume
