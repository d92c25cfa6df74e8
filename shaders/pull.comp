// SPDX-License-Identifier: MIT
// Step 3: radiosity averaged up the hierarchy (PIC 4.1, 4.3), the levels lastLevel .. firstLevel. Many groups take one
// level; one group may take several small ones, waiting between them.
#include "shared/layout.h"
#include "lib/pack.glsl"

layout(local_size_x = RELUME_PULL_GROUP) in;

layout(std430, binding = RELUME_SLOT_CHILD) readonly buffer Child { uint child[]; };
layout(std430, binding = RELUME_SLOT_WEIGHT) readonly buffer Weight { float firstWeight[]; };
layout(std430, binding = RELUME_SLOT_LEVELS) readonly buffer Levels { uint levelBegin[]; };
layout(std430, binding = RELUME_SLOT_NODES) coherent buffer Nodes { uvec2 node[]; };

uniform uint relumeFirstLevel;
uniform uint relumeLastLevel;

void main() {
  uint threads = gl_NumWorkGroups.x * uint(RELUME_PULL_GROUP);
  for (uint level = relumeLastLevel + 1u; level-- > relumeFirstLevel;) {
    uint end = levelBegin[level + 1u];
    for (uint i = levelBegin[level] + gl_GlobalInvocationID.x; i < end; i += threads) {
      uint c = child[i];
      if ((c & kRelumeLeafBit) != 0u) continue;
      vec3 first = relumeUnpackNode(node[c]), second = relumeUnpackNode(node[c + 1u]);
      node[i] = relumePackNode(mix(second, first, firstWeight[i]));
    }
    if (level > relumeFirstLevel) {
      memoryBarrierBuffer();
      barrier();
    }
  }
}
