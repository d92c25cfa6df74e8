// SPDX-License-Identifier: MIT
// Step 3: radiosity averaged up the hierarchy (PIC 4.1, 4.3). A work group pulls whole subtrees, a round of nodes after
// the other (runtime/gl/pull_schedule.h); a second dispatch of one group pulls what is above them.
#include "shared/layout.h"
#include "lib/pack.glsl"

layout(local_size_x = RELUME_PULL_THREADS) in;

layout(std430, binding = RELUME_SLOT_PULL) readonly buffer Pull { uvec2 pull[]; };
layout(std430, binding = RELUME_SLOT_ROUNDS) readonly buffer Rounds { uint roundBegin[]; };
layout(std430, binding = RELUME_SLOT_GROUPS) readonly buffer Groups { uint groupBegin[]; };
layout(std430, binding = RELUME_SLOT_NODES) coherent buffer Nodes { uint node[]; };

uniform uint relumeFirstGroup;

void main() {
  uint group = relumeFirstGroup + gl_WorkGroupID.x;
  uint end = groupBegin[group + 1u];
  for (uint round = groupBegin[group]; round < end; ++round) {
    uint last = roundBegin[round + 1u];
    for (uint i = roundBegin[round] + gl_LocalInvocationID.x; i < last; i += uint(RELUME_PULL_THREADS)) {
      uvec2 word = pull[i];
      uint parent = word.x & ((1u << kRelumePullNodeBits) - 1u), child = 1u + 2u * (word.y & ((1u << (kRelumePullNodeBits - 1u)) - 1u));
      uint weight = word.x >> kRelumePullNodeBits | word.y >> (kRelumePullNodeBits - 1u) << (32u - kRelumePullNodeBits);
      vec3 first = relumeUnpackColor(node[child]), second = relumeUnpackColor(node[child + 1u]);
      node[parent] = relumePackColor(second + float(weight) / float(kRelumePullWeightOne) * (first - second), relumeDither(parent));
    }
    if (round + 1u < end) {
      memoryBarrierBuffer();
      barrier();
    }
  }
}
