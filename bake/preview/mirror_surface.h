// SPDX-License-Identifier: MIT
// What a camera's ray meets, as a surface that scatters and mirrors by its material (relume/glossy.h).
#pragma once

#include "bake/preview/glossy_lobe.h"
#include "bake/preview/receiver.h"
#include "bake/rays/seen_surface.h"
#include "bake/scene/camera_rays.h"
#include "relume/bake/context.h"

#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace relume {

struct MirrorSurface {
  glm::vec3 normal{0.0f};                   // unit, bent by the normal map
  glm::vec3 diffuse{0.0f}, specular{0.0f};  // splitReflectance()
  glm::vec3 axis{0.0f};                     // unit, the reflected direction
  float exponent = 0.0f;                    // of the lobe; 0: nothing is seen

  // Whether radiance records carry the lobe.
  bool byRecords() const { return exponent > 0.0f && exponent <= 1.001f * kMaxRecordExponent; }
};

MirrorSurface mirrorAt(const Scene& scene, const Ray& ray, const SeenSurface& seen);

// At the centres of the camera's pixels, row by row. Incomplete when cancelled.
std::vector<MirrorSurface> findMirrors(const RayTracer& drawn, const CameraRays& camera, Context& context);

}  // namespace relume
