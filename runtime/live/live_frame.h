// SPDX-License-Identifier: MIT
// What a frame of light without a bake is made from, on the CPU (live_light.h) and in OpenGL (runtime/live_gl).
#pragma once

#include "relume/result.h"
#include "runtime/live/live_sky.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace relume {

struct LiveOptions {
  std::uint32_t raysPerCell = 64;  // [8..4096] a frame
};

struct LiveFrame {
  glm::vec3 emissionScale{1.0f};  // [>= 0] factor on the voxels' emission
  float bounceScale = 1.0f;       // [0..1] share of last frame's caches that voxels reflect; 0 = one bounce
  float keep = 0.0f;              // [0..1) share of last frame's caches that stays: exp(-seconds / 0.15) hides noise
  LiveSky sky;
  std::uint32_t raySet = 0;   // which of the sets of rays, evenly turned against each other: count the frames
  bool freezeVoxels = false;  // gather once more from the voxels as they are lit: more rays, no bounce more
};

// usage: raysPerCell out of range.
Status checkLiveOptions(const LiveOptions& options);
// usage: a number of the frame that is not finite or out of its range, a map of another size.
Status checkLiveFrame(const LiveFrame& frame);

// A frame's rays, the same for all cells.
struct LiveRays {
  std::vector<glm::vec3> direction, sky;  // unit; radiance of what lies behind all voxels [W/m²/sr]
};
LiveRays liveRays(std::uint32_t count, const LiveFrame& frame);

}  // namespace relume
