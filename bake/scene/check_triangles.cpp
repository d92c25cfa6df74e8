// SPDX-License-Identifier: MIT
// See check_triangles.h.
#include "bake/scene/check_triangles.h"

#include <algorithm>

namespace relume {
namespace {

bool hasTriangles(const Scene& scene, bool withDynamic) {
  return std::any_of(scene.instances.begin(), scene.instances.end(), [&](const Instance& instance) {
    return (withDynamic || instance.baked()) && !scene.meshes[instance.mesh].triangle.empty();
  });
}

Error noTriangle(const Scene& scene, const std::string& purpose, const std::string& kinds) {
  return {ErrorCode::failed, "scene \"" + scene.name + "\" has no triangle to " + purpose +
                                 ": no mesh has one (points and lines are left out), or every node is " + kinds +
                                 " in extras.relume"};
}

}  // namespace

Status checkBakedTriangles(const Scene& scene) {
  return hasTriangles(scene, false) ? done() : Status(noTriangle(scene, "bake", "\"dynamic\" or \"ignore\""));
}

Status checkDrawnTriangles(const Scene& scene) {
  return hasTriangles(scene, true) ? done() : Status(noTriangle(scene, "draw", "\"ignore\""));
}

}  // namespace relume
