// SPDX-License-Identifier: MIT
// Both normals of a point on a surface, for those who need them together.
#pragma once

#include "relume/bake/scene.h"

namespace relume {

struct SurfaceNormals {
  glm::vec3 geometric{0.0f}, shading{0.0f};  // geometricNormal() and shadingNormal()
};
SurfaceNormals normalsAt(const Scene& scene, const SurfacePoint& p);

}  // namespace relume
