// SPDX-License-Identifier: MIT
// Level 1 of what cones read, from the voxels: RadianceMips::update(), which a test compares. A thread a voxel of its
// list.
#define RELUME_LIVE_LAYERED
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/live_volume.glsl"
#include "lib/cone_depth.glsl"
#include "lib/cone_voxels.glsl"
#include "lib/cone_list.glsl"
#include "lib/cone_unit.glsl"

layout(RELUME_CONE_LEVEL_FORMAT, binding = 0) writeonly uniform image3D level;

uniform uint relumeConePlace;  // where along z the volume's own begins

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  ivec3 v = relumeConeListed(i);
  uvec4 cell = relumeLiveCell(v >> 1);
  vec4 front[8], back[8];
  float frontShare[8];  // of the area
  for (int c = 0; c < 8; ++c) {
    uint bit = relumeLiveBit(2 * v + ivec3(c & 1, c >> 1 & 1, c >> 2));
    front[c] = vec4(0.0);
    back[c] = vec4(0.0);
    frontShare[c] = 0.0;
    if (relumeLiveIsSet(cell.xy, bit)) {
      uint number = cell.z + relumeLiveCountBefore(cell.xy, bit);
      front[c] = texelFetch(relumeConeRadiance, relumeConeTexel(2u * number), 0);
      back[c] = texelFetch(relumeConeRadiance, relumeConeTexel(2u * number + 1u), 0);
      frontShare[c] = texelFetch(relumeConeSides, relumeConeTexel(4u * number), 0).w;
    }
  }
  for (uint d = 0u; d < uint(RELUME_CONE_DIRECTIONS); ++d) {
    vec4 part[8];
    for (int c = 0; c < 8; ++c) {
      float cosine = dot(relumeConeFront(front[c].w), relumeConeAxis(d)), depth = back[c].w;
      vec3 radiance = cosine < 0.0 ? front[c].rgb : back[c].rgb;
#if RELUME_CONE_DIRECTIONS > 1
      if (front[c].w > 0.0) {
        cosine = abs(cosine) / 127.0;
        // Of a surface that has one side alone, that side.
        vec3 edge = frontShare[c] == 1.0 ? front[c].rgb : frontShare[c] == 0.0 ? back[c].rgb : radiance;
        radiance = mix(edge, radiance, cosine);
        depth *= max(cosine, 0.1);
      }
#endif
      part[c] = vec4(depth / relumeConeUnit() * radiance, depth);
    }
    imageStore(level, ivec3(d * 2u * relumeLiveSize.x, 0, relumeConePlace) + v, relumeConeTogether(part, d));
  }
}
