// SPDX-License-Identifier: MIT
// The largest channel of all voxels that cones read, by its bits, for lib/cone_unit.glsl. A thread a voxel.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_voxels.glsl"

layout(std430, binding = RELUME_CONE_SLOT_BRIGHTEST) buffer ConeBrightest { uint coneBrightest; };

uniform uint relumeConeFirst;  // voxel of the volume

shared uint brightest;  // of the work group

// 0 of what is no number.
float mostOf(vec3 radiance) {
  float most = max(max(radiance.r, radiance.g), radiance.b);
  return most > 0.0 ? min(most, RELUME_MAX_RADIANCE) : 0.0;
}

void main() {
  uint i = relumeLiveThread();
  if (gl_LocalInvocationIndex == 0u) brightest = 0u;
  barrier();
  if (i < relumeLiveThreads) {
    uint side = 2u * (relumeConeFirst + i);
    float most = max(mostOf(texelFetch(relumeConeRadiance, relumeConeTexel(side), 0).rgb),
                     mostOf(texelFetch(relumeConeRadiance, relumeConeTexel(side + 1u), 0).rgb));
    if (most > 0.0) atomicMax(brightest, floatBitsToUint(most));
  }
  barrier();
  if (gl_LocalInvocationIndex == 0u && brightest != 0u) atomicMax(coneBrightest, brightest);
}
