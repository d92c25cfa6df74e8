// SPDX-License-Identifier: MIT
// What the pixels of a camera show, as receivers of light: the geometry buffer (RCS 4.2, step 1).
#pragma once

#include "bake/preview/gather.h"
#include "bake/rays/seen_surface.h"
#include "bake/scene/camera_rays.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <vector>

namespace relume {

// Receivers of what a camera sees.
class ReceiverMaker {
 public:
  explicit ReceiverMaker(const CameraRays& camera);
  // A surface without a shading normal has its plane's; without either, the receiver's normal is zero.
  PixelReceiver at(const SeenSurface& seen) const;

 private:
  glm::vec3 origin_, forward_;
  bool orthographic_;
  float pixel_;  // [m] width of a pixel at depth 1, or at any depth of an orthographic view
};

// At the pixels' centres, row by row; a zero normal where nothing is seen. Incomplete when cancelled.
std::vector<PixelReceiver> findReceivers(const RayTracer& drawn, const CameraRays& camera, Context& context);

}  // namespace relume
