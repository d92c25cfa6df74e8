// SPDX-License-Identifier: MIT
// Light of caches that have other slots now: those that were there before keep theirs, those that have entered a volume
// go on from that of the cache around them, the others have none yet.
#include "shared/layout.h"
#include "lib/live_threads.glsl"

layout(binding = RELUME_LIVE_UNIT_LIGHT) uniform sampler2D oldLight;
layout(rgba32f, binding = 0) writeonly uniform image2D newLight;
layout(std430, binding = RELUME_LIVE_SLOT_CARRY) readonly buffer Carry { uint oldSlot[]; };

const uint kNone = 0xFFFFFFFFu;
const float kUnlit = -1e-30;  // [W/m²/sr] of what has never gathered

ivec2 cacheAt(uint slot) {
  return ivec2(7u * (slot % uint(RELUME_LIVE_CACHES_A_ROW)), slot / uint(RELUME_LIVE_CACHES_A_ROW));
}

void main() {
  uint slot = relumeLiveThread();
  if (slot >= relumeLiveThreads) return;
  uint from = oldSlot[slot];
  for (int k = 0; k < 7; ++k) {
    vec4 texel = vec4(0.0, 0.0, 0.0, k == 6 ? kUnlit : 0.0);
    if (from != kNone) texel = texelFetch(oldLight, cacheAt(from) + ivec2(k, 0), 0);
    imageStore(newLight, cacheAt(slot) + ivec2(k, 0), texel);
  }
}
