// SPDX-License-Identifier: MIT
// Light of caches that have other slots now: those that were there before keep theirs, those that have entered a volume
// begin with that of the cache around them, the others have none yet.
#include "shared/layout.h"
#include "lib/live_threads.glsl"

layout(binding = RELUME_LIVE_UNIT_LIGHT) uniform sampler2D oldLight;
layout(rgba32f, binding = 0) writeonly uniform image2D newLight;
layout(std430, binding = RELUME_LIVE_SLOT_CARRY) readonly buffer Carry { uint oldSlot[]; };  // kBegins: not its own

const uint kNone = 0xFFFFFFFFu, kBegins = 0x80000000u;
const float kLeast = 1e-30;  // [W/m²/sr] so that what is dark has a sign

ivec2 cacheAt(uint slot) {
  return ivec2(7u * (slot % uint(RELUME_LIVE_CACHES_A_ROW)), slot / uint(RELUME_LIVE_CACHES_A_ROW));
}

void main() {
  uint slot = relumeLiveThread();
  if (slot >= relumeLiveThreads) return;
  uint from = oldSlot[slot];
  for (int k = 0; k < 7; ++k) {
    vec4 texel = from != kNone ? texelFetch(oldLight, cacheAt(from & ~kBegins) + ivec2(k, 0), 0) : vec4(0.0);
    if (k == 6 && (from & kBegins) != 0u) texel.w = -max(abs(texel.w), kLeast);
    imageStore(newLight, cacheAt(slot) + ivec2(k, 0), texel);
  }
}
