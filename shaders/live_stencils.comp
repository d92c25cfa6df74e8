// SPDX-License-Identifier: MIT
// The caches that each side of a voxel reads: once after voxels or caches have changed. Of five words the first has the
// cell of corner 0, counted from -2 on, and the others the weights of the eight corners.
#include "shared/layout.h"
#define RELUME_LIVE_LAYERED
#include "lib/live_stencil.glsl"
#include "lib/live_threads.glsl"

layout(std430, binding = RELUME_LIVE_SLOT_SIDES) readonly buffer Sides { vec4 side[]; };
layout(std430, binding = RELUME_LIVE_SLOT_STENCILS) writeonly buffer Stencils { uint stencil[]; };

void main() {
  uint s = relumeLiveThread();
  if (s >= relumeLiveThreads) return;
  ivec3 first;
  uint slot[8];
  float weight[8];
  relumeLiveStencil(side[3u * s].xyz, side[3u * s + 1u].xyz, first, slot, weight);
  uvec3 at = uvec3(first + 2);
  stencil[5u * s] = at.x | at.y << 10 | at.z << 20;
  for (uint k = 0u; k < 4u; ++k) stencil[5u * s + 1u + k] = packUnorm2x16(vec2(weight[2u * k], weight[2u * k + 1u]));
}
