// SPDX-License-Identifier: MIT
// What each side of a voxel sends out in the light of a bake: the mean of the surfels that lie on it, by how squarely
// they face it; without any albedo (direct + what the grid has there) / pi + emission. SurfelVoxels::light(), which a
// test compares. The front's texel has the voxel's axis beside it.
#include "resolve.glsl"
#include "lib/live_threads.glsl"
#include "lib/pack.glsl"

layout(std430, binding = RELUME_LIVE_SLOT_SIDES) readonly buffer Sides { vec4 side[]; };
layout(std430, binding = RELUME_LIVE_SLOT_NODES) readonly buffer Nodes { uint node[]; };
layout(std430, binding = RELUME_LIVE_SLOT_VOXELS) readonly buffer Voxels { uvec2 voxelWord[]; };
layout(std430, binding = RELUME_LIVE_SLOT_DIRECT) readonly buffer Direct { vec4 direct[]; };
// Where the surfels of each standing side begin, and the last one's end; then two words each: node, weight.
layout(std430, binding = RELUME_LIVE_SLOT_SENDERS) readonly buffer Senders { uint sender[]; };
layout(rgba32f, binding = 0) writeonly uniform image2D radianceImage;

uniform vec3 relumeLiveOrigin;
uniform float relumeLiveVoxel;
uniform uint relumeBakeSides;  // standing ones
uniform vec3 relumeEmissionScale;

void main() {
  uint s = relumeLiveThread();
  if (s >= relumeLiveThreads) return;
  const float invPi = 0.318309886;
  uint i = 0u, end = 0u;
  if (s < relumeBakeSides) {
    i = sender[s];
    end = sender[s + 1u];
  }
  vec3 radiance;
  if (i < end) {
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (; i < end; ++i) {
      uint at = relumeBakeSides + 1u + 2u * i;
      float weight = uintBitsToFloat(sender[at + 1u]);
      sum += weight * relumeUnpackColor(node[sender[at]]);
      weights += weight;
    }
    radiance = invPi / weights * sum;
  } else {
    vec4 a = side[3u * s], b = side[3u * s + 1u], c = side[3u * s + 2u];
    vec3 e = direct[s].rgb + relumeIrradianceGrid(relumeLiveOrigin + relumeLiveVoxel * a.xyz, b.xyz);
    radiance = invPi * vec3(a.w, b.w, c.w) * e + relumeEmissionScale * c.xyz;
  }
  float axis = (s & 1u) == 0u ? float(voxelWord[s / 2u].x & 0xFFFFFFu) : 0.0;
  imageStore(radianceImage, ivec2(s % uint(RELUME_LIVE_SIDES_A_ROW), s / uint(RELUME_LIVE_SIDES_A_ROW)),
             vec4(radiance, axis));
}
