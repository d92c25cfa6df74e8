// SPDX-License-Identifier: MIT
// Direct light of each side of a voxel at up to four places: VoxelVolume::lightDirectly(), which a test compares.
// host_visibility.glsl is the host's LiveCachesGlOptions::visibilityGlsl. It has names of its own: what is global here
// begins with relume, against clashes.
#include "shared/layout.h"
#include "lib/direct_light.glsl"
#include "lib/live_threads.glsl"
#include "host_visibility.glsl"

layout(std430, binding = RELUME_LIVE_SLOT_SAMPLES) readonly buffer RelumeSamples { uvec4 relumeSampleWord[]; };
layout(std430, binding = RELUME_LIVE_SLOT_VOXELS) readonly buffer RelumeVoxels { uvec2 relumeVoxelWord[]; };
layout(std430, binding = RELUME_LIVE_SLOT_LIGHTS) readonly buffer RelumeLights { RelumeLight relumeLight[]; };
layout(std430, binding = RELUME_LIVE_SLOT_DIRECT) writeonly buffer RelumeDirect { vec4 relumeDirect[]; };

uniform vec3 relumeLiveOrigin;
uniform float relumeLiveVoxel;
uniform uint relumeLightCount;

// Four signed bytes.
ivec4 relumeBytesOf(uint word) { return ivec4(int(word << 24), int(word << 16), int(word << 8), int(word)) >> 24; }

// Of one place: [1/64 voxel from the voxel's middle] and 127 times the unit normal; how many of the four it stands for.
vec3 relumeLightAt(uvec2 word, vec3 middle) {
  ivec4 low = relumeBytesOf(word.x), high = relumeBytesOf(word.y);
  if (high.z == 0) return vec3(0.0);
  vec3 n = normalize(vec3(low.w, high.xy));
  vec3 at = relumeLiveOrigin + relumeLiveVoxel * (middle + vec3(low.xyz) / 64.0 + RELUME_LIVE_LIFT * n);
  // Of a disc of its share of the voxel's face
  float radius = relumeLiveVoxel * sqrt(float(high.z) / (4.0 * 3.14159265));
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < relumeLightCount; ++i) {
    vec3 e = relumeDirectIrradiance(relumeLight[i], at, n, radius);
    if (e != vec3(0.0)) sum += e * relumeClampedVisibility(relumeVisibility(i, at, n));
  }
  return 0.25 * float(high.z) * sum;
}

void main() {
  uint s = relumeLiveThread();
  if (s >= relumeLiveThreads) return;
  uint at = relumeVoxelWord[s / 2u].y;
  vec3 middle = vec3(at & 1023u, at >> 10 & 1023u, at >> 20) + 0.5;
  uvec4 first = relumeSampleWord[2u * s], second = relumeSampleWord[2u * s + 1u];
  relumeDirect[s] = vec4(relumeLightAt(first.xy, middle) + relumeLightAt(first.zw, middle) +
                         relumeLightAt(second.xy, middle) + relumeLightAt(second.zw, middle), 0.0);
}
