// SPDX-License-Identifier: MIT
// Light of caches that have other slots now: those that were there before keep theirs, the others have none yet.
#include "shared/layout.h"

layout(local_size_x = RELUME_LIVE_GROUP) in;

layout(binding = RELUME_LIVE_UNIT_LIGHT) uniform sampler2D oldLight;
layout(rgba32f, binding = 0) writeonly uniform image2D newLight;
layout(std430, binding = RELUME_LIVE_SLOT_CARRY) readonly buffer Carry { uint oldSlot[]; };

uniform uint relumeLiveCaches;

ivec2 cacheAt(uint slot) {
  return ivec2(7u * (slot % uint(RELUME_LIVE_CACHES_A_ROW)), slot / uint(RELUME_LIVE_CACHES_A_ROW));
}

void main() {
  uint slot = gl_GlobalInvocationID.x;
  if (slot >= relumeLiveCaches) return;
  uint from = oldSlot[slot];
  for (int k = 0; k < 7; ++k) {
    vec4 texel = vec4(0.0, 0.0, 0.0, k == 6 ? -1.0 : 0.0);
    if (from != 0xFFFFFFFFu) texel = texelFetch(oldLight, cacheAt(from) + ivec2(k, 0), 0);
    imageStore(newLight, cacheAt(slot) + ivec2(k, 0), texel);
  }
}
