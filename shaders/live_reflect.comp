// SPDX-License-Identifier: MIT
// What each side of a voxel sends out: albedo (direct + bounced) / pi + emission, as LiveCaches::bounce() and
// VoxelVolume::reflect() have it. The front's texel has the voxel's axis beside it, the back's the
// bits of VoxelLayer::emitters, where anything emits.
#include "shared/layout.h"
#define RELUME_LIVE_LAYERED
#include "lib/live_volume.glsl"
#include "lib/live_read.glsl"
#include "lib/live_threads.glsl"

layout(std430, binding = RELUME_LIVE_SLOT_SIDES) readonly buffer Sides { vec4 side[]; };
layout(std430, binding = RELUME_LIVE_SLOT_STENCILS) readonly buffer Stencils { uint stencil[]; };
layout(std430, binding = RELUME_LIVE_SLOT_VOXELS) readonly buffer Voxels { uvec2 voxelWord[]; };
layout(std430, binding = RELUME_LIVE_SLOT_DIRECT) readonly buffer Direct { vec4 direct[]; };
layout(rgba32f, binding = 0) writeonly uniform image2D radianceImage;

uniform float relumeBounceScale;
uniform vec3 relumeEmissionScale;
uniform int relumeFirstRow;  // of the image, that has this volume's sides

vec3 bounced(uint s, vec3 n) {
  uint word = stencil[5u * s];
  ivec3 first = ivec3(word & 1023u, word >> 10 & 1023u, word >> 20) + ivec3(-2, -2, relumeLiveLayer - 2);
  relumeLiveClear();
  for (uint k = 0u; k < 8u; ++k) {
    vec2 pair = unpackUnorm2x16(stencil[5u * s + 1u + k / 2u]);
    float weight = (k & 1u) == 0u ? pair.x : pair.y;
    if (weight == 0.0) continue;
    uint cache = texelFetch(relumeLiveCells, first + ivec3(k & 1u, k >> 1 & 1u, k >> 2), 0).w;
    relumeLiveAdd(cache >> 6, weight);
  }
  return relumeLiveIrradianceOfSum(n);
}

void main() {
  uint s = relumeLiveThread();
  if (s >= relumeLiveThreads) return;
  vec4 a = side[3u * s], b = side[3u * s + 1u], c = side[3u * s + 2u];
  vec3 e = direct[s].rgb;
  if (relumeBounceScale > 0.0) e += relumeBounceScale * bounced(s, b.xyz);
  vec3 radiance = 0.318309886 * vec3(a.w, b.w, c.w) * e + relumeEmissionScale * c.xyz;
  uint word = voxelWord[s / 2u].x;
  float beside = (s & 1u) == 0u ? float(word & 0xFFFFFFu) : relumeEmissionScale != vec3(0.0) ? float(word >> 24) : 0.0;
  ivec2 to = ivec2(s % uint(RELUME_LIVE_SIDES_A_ROW), s / uint(RELUME_LIVE_SIDES_A_ROW));
  imageStore(radianceImage, to + ivec2(0, relumeFirstRow), vec4(radiance, beside));
}
