// SPDX-License-Identifier: MIT
// Radiance of the voxels that cones read from the flux of their sides: the second half of RsmVoxels::light()
// (runtime/cones/rsm_voxels.cpp), whose bits these are. A thread a voxel.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_depth.glsl"
#include "lib/cone_rsm.glsl"

layout(rgba32f, binding = 0) writeonly uniform image2D radiance;

uniform float relumeRsmUnit;  // [W]
uniform vec3 relumeRsmEmissionScale;

ivec2 texelOf(uint number) {
  return ivec2(number % uint(RELUME_LIVE_SIDES_A_ROW), number / uint(RELUME_LIVE_SIDES_A_ROW));
}

// A sum's upper 24 bits, so that nothing is rounded.
float cutSum(uint high, uint low) {
  int below = max((high != 0u ? 32 + findMSB(high) : findMSB(low)) - 23, 0);
  uint top = below >= 32 ? high >> (below - 32) : below > 0 ? high << (32 - below) | low >> below : low;
  return float(top) * uintBitsToFloat(uint(127 + below) << 23);
}

vec3 radianceOf(uint side, vec4 light) {
  if (side == kRelumeNone) return vec3(0.0);
  uint at = 6u * side;
  vec3 flux = vec3(cutSum(rsmSum[at + 3u], rsmSum[at]), cutSum(rsmSum[at + 4u], rsmSum[at + 1u]),
                   cutSum(rsmSum[at + 5u], rsmSum[at + 2u])) * relumeRsmUnit;
  precise vec3 sent = flux * light.w + light.rgb * relumeRsmEmissionScale;
  return min(sent, vec3(RELUME_MAX_RADIANCE));
}

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  RelumeRsmVoxel voxel = rsmVoxel[i];
  vec3 front = radianceOf(voxel.front, voxel.frontLight), back = radianceOf(voxel.back, voxel.backLight);
#if RELUME_CONE_DIRECTIONS == 1
  front = back = mix(back, front, voxel.frontShare);
#endif
  float depth = kConeSolid;
  if (voxel.front != kRelumeNone)
    depth = relumeConeDepthOfWall(
        abs(vec3(voxel.axis >> 16 & 255u, voxel.axis >> 8 & 255u, voxel.axis & 255u) - 128.0));
  imageStore(radiance, texelOf(2u * i), vec4(front, float(voxel.axis)));
  imageStore(radiance, texelOf(2u * i + 1u), vec4(back, depth));
}
