// SPDX-License-Identifier: MIT
// Where a sphere can be seen in an image (RCS Algorithm 1: the bounding box of a record's sphere).
#pragma once

#include "bake/scene/camera_rays.h"

#include <glm/vec3.hpp>

#include <cstdint>

namespace relume {

// Pixels [minX, maxX) x [minY, maxY); empty where max <= min.
struct ScreenBox {
  std::uint32_t minX = 0, minY = 0, maxX = 0, maxY = 0;
};

// Every pixel through which a point of the sphere can be seen, and few others; all of them along an axis where the
// sphere reaches around the eye, which the paper leaves open.
ScreenBox boxOfSphere(const CameraRays& camera, const glm::vec3& centerWorld, float radius);

}  // namespace relume
