// SPDX-License-Identifier: MIT
// A level of what cones read from the one below: RadianceMips::update(), which a test compares. A thread a voxel of its
// list.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_depth.glsl"
#include "lib/cone_list.glsl"
#include "lib/cone_unit.glsl"

layout(binding = RELUME_CONE_UNIT_FIRST) uniform sampler3D firstLevel;
layout(binding = RELUME_CONE_UNIT_LEVELS) uniform sampler3D furtherLevels;
layout(RELUME_CONE_LEVEL_FORMAT, binding = 0) writeonly uniform image3D levels;

uniform uvec3 relumeConeSize;     // of the level
uniform uvec3 relumeConeBelow;    // size of the one below
uniform uvec2 relumeConePlace;    // where along z both begin, this one and the one below
uniform bool relumeConeIsSecond;  // whether that is level 1

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  ivec3 v = relumeConeListed(i);
  for (uint d = 0u; d < uint(RELUME_CONE_DIRECTIONS); ++d) {
    vec4 part[8];
    for (int c = 0; c < 8; ++c) {
      ivec3 child = 2 * v + ivec3(c & 1, c >> 1 & 1, c >> 2), at = child + ivec3(d * relumeConeBelow.x, 0, 0);
      part[c] = vec4(0.0);
      if (any(greaterThanEqual(child, ivec3(relumeConeBelow)))) continue;
      at.z += int(relumeConePlace.y);
      part[c] = relumeConeIsSecond ? texelFetch(firstLevel, at, 0) : texelFetch(furtherLevels, at, 0);
    }
    imageStore(levels, v + ivec3(d * relumeConeSize.x, 0, relumeConePlace.x), relumeConeTogether(part, d));
  }
}
