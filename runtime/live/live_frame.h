// SPDX-License-Identifier: MIT
// What a frame of light without a bake is made from, on the CPU (live_caches.h) and in OpenGL (runtime/live_gl).
#pragma once

#include "relume/live_light.h"
#include "relume/result.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace relume {

struct LiveOptions {
  std::uint32_t raysPerCell = 64;  // [8..4096] a frame
};

// usage: raysPerCell out of range.
Status checkLiveOptions(const LiveOptions& options);
// usage: a number of the frame that is not finite or out of its range, a map of another size.
Status checkLiveFrame(const LiveFrame& frame);
Status checkLiveSky(const LiveSky& sky);
Error noMemoryForLiveLight();

// A frame's rays, the same for all cells.
struct LiveRays {
  std::vector<glm::vec3> direction, sky;  // unit; radiance of what lies behind all voxels [W/m²/sr]
};
LiveRays liveRays(std::uint32_t count, const LiveFrame& frame);

}  // namespace relume
