// SPDX-License-Identifier: MIT
// Step 2, first half: last frame's irradiance at the surfels whose normal is not the light map's (RELUME_BOUNCE_GRID 0) or
// that read the grid (1), one thread each. It goes to the leaf's slot among the nodes, where light_surfels.comp finds it.
#include "resolve.glsl"
#include "lib/leaf_node.glsl"
#include "lib/pack.glsl"

layout(local_size_x = RELUME_SURFEL_GROUP) in;

layout(std430, binding = RELUME_SLOT_SURFELS) readonly buffer Surfels { uvec4 surfel[]; };
#if RELUME_BOUNCE_GRID
layout(std430, binding = RELUME_SLOT_GRIDDED) readonly buffer Gridded { uint griddedWord[]; };
#endif
layout(std430, binding = RELUME_SLOT_NODES) writeonly buffer Nodes { uint node[]; };

RELUME_PARAMETERS(RELUME_BOUNCE_PARAMETERS)

#if RELUME_BOUNCE_GRID
// relumeIrradianceGrid() with weights made beforehand.
vec3 bounce(uint s, vec3 normal, uint receiver) {
  vec4 lobe[RELUME_LUMA_LAYERS];
  relumeMakeLobe(normal, vec2(0.0, 1.0), 1.0, lobe);
  RelumeGridSum sum = RelumeGridSum(vec3(0.0), 0.0, mat3x4(0.0), 0.0);
  uint i = s - relumeFirstSurfel, end = griddedWord[i + 1u];
  for (uint k = griddedWord[i]; k < end; ++k) {
    uint share = griddedWord[k];
    relumeAddWeighted(share & ((1u << kRelumeCacheBits) - 1u), float(share >> kRelumeCacheBits) / 1023.0, false, lobe, sum);
  }
  return relumeFinish(sum.e, sum.first, sum.upper, normal, 1.0);
}
#else
vec3 bounce(uint s, vec3 normal, uint receiver) { return relumeIrradianceLightmap(relumeUnpackUnorm16x2(receiver), normal); }
#endif

void main() {
  uint s = relumeFirstSurfel + gl_GlobalInvocationID.x;
  if (s >= relumeEndSurfel) return;
  uint leaf = relumeLeafOf(s);
  if (leaf == kRelumeNone) return;
  uvec4 word = surfel[s];
  vec3 e = bounce(s, relumeUnpackDirection(word.z, 12), word.w);
  node[leaf] = relumePackColor(e, relumeDither(leaf));
}
