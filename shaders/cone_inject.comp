// SPDX-License-Identifier: MIT
// Radiance that the passes of the caches found (live_reflect.comp) into the voxels that cones read.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_depth.glsl"

layout(binding = RELUME_CONE_UNIT_SOURCE) uniform sampler2D found;
layout(rgba32f, binding = 0) writeonly uniform image2D radiance;
layout(std430, binding = RELUME_CONE_SLOT_SOURCES) readonly buffer Sources { vec2 source[]; };  // voxel, front's share

uniform uvec2 relumeConeFirst;  // voxel of the volume, here and in what was found

ivec2 texelOf(uint number) {
  return ivec2(number % uint(RELUME_LIVE_SIDES_A_ROW), number / uint(RELUME_LIVE_SIDES_A_ROW));
}

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  uint from = floatBitsToUint(source[i].x);
  vec4 front = vec4(0.0), back = vec4(0.0, 0.0, 0.0, kConeSolid);
  if (from != 0xFFFFFFFFu) {
    from = 2u * (relumeConeFirst.y + from);
    front = texelFetch(found, texelOf(from), 0);
    back.rgb = texelFetch(found, texelOf(from + 1u), 0).rgb;
    uint word = uint(front.w);
    vec3 axis = abs(vec3(word >> 16 & 255u, word >> 8 & 255u, word & 255u) - 128.0);
    back.w = relumeConeDepthOfWall(axis);
#if RELUME_CONE_DIRECTIONS == 1
    front.rgb = back.rgb = mix(back.rgb, front.rgb, source[i].y);
#endif
  }
  uint to = 2u * (relumeConeFirst.x + i);
  imageStore(radiance, texelOf(to), front);
  imageStore(radiance, texelOf(to + 1u), back);
}
