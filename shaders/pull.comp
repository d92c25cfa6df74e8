// SPDX-License-Identifier: MIT
// Step 3: radiosity averaged up the hierarchy (PIC 4.1, 4.3; runtime/passes/pull_schedule.h). A work group pulls whole
// subtrees, a run of nodes after the other; then, with RELUME_PULL_TOP 1, one group pulls what is above them in rounds.
#include "shared/layout.h"
#include "lib/pack.glsl"

#ifdef RELUME_VULKAN
layout(constant_id = 0) const uint RELUME_PULL_THREADS = 1u;
layout(local_size_x_id = 0) in;
#else
layout(local_size_x = RELUME_PULL_THREADS) in;
#endif

layout(std430, binding = RELUME_SLOT_PULL) readonly buffer Pull { uint pull[]; };
layout(std430, binding = RELUME_SLOT_RUNS) readonly buffer Runs { uvec2 run[]; };
layout(std430, binding = RELUME_SLOT_ROUNDS) readonly buffer Rounds { uint begin[]; };
layout(std430, binding = RELUME_SLOT_NODES) coherent buffer Nodes { uint node[]; };

RELUME_PARAMETERS(RELUME_PULL_PARAMETERS)

const uint kNodeMask = (1u << kRelumePullNodeBits) - 1u;

// word: of inner node number `inner`.
void pullNode(uint parent, uint inner, uint word) {
  uint child = 1u + 2u * inner;
  vec3 first = relumeUnpackColor(node[child]), second = relumeUnpackColor(node[child + 1u]);
  float weight = float(word & 0xFFFFu) / float(kRelumePullWeightOne);
  node[parent] = relumePackColor(second + weight * (first - second), relumeDither(parent));
}

void finishRound() {
  memoryBarrierBuffer();
  barrier();
}

void main() {
#if RELUME_PULL_TOP
  for (uint round = relumeFirst; round < relumeEndRound; ++round) {
    uint end = begin[round + 1u];
    for (uint i = begin[round] + gl_LocalInvocationID.x; i < end; i += uint(RELUME_PULL_THREADS)) {
      uvec2 one = run[i];
      uint inner = one.y & kNodeMask;
      pullNode(one.x & kNodeMask, inner, pull[inner]);
    }
    finishRound();
  }
#else
  uint group = relumeFirst + gl_WorkGroupID.x, end = begin[group + 1u];
  for (uint r = begin[group]; r < end; ++r) {
    uvec2 word = run[r];
    uint firstNode = word.x & kNodeMask, firstInner = word.y & kNodeMask;
    uint count = word.x >> kRelumePullNodeBits | word.y >> kRelumePullNodeBits << (32u - kRelumePullNodeBits);
    for (uint i = gl_LocalInvocationID.x; i < count; i += uint(RELUME_PULL_THREADS)) {
      uint inner = firstInner + i, own = pull[inner];
      pullNode(firstNode + (own >> 16), inner, own);
    }
    finishRound();
  }
#endif
}
