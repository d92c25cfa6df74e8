// SPDX-License-Identifier: MIT
// Light without a bake for a shader of the host's, as LiveCaches::irradiance() has it (runtime/live/live_caches.h):
//
// vec3 relumeLiveIrradiance(vec3 positionWorld, vec3 n)   [W/m²] by all light but the punctual lights' own
// vec3 relumeLiveGlossy(vec3 positionWorld, vec3 n, vec3 r, float exponent)   mean radiance in a cos^exponent lobe
//                                                                             about r
//
// Both read the caches around a place once for an invocation: call them for one place and normal.
#include "shared/layout.h"
#include "lib/live_stencil.glsl"
#include "lib/live_read.glsl"

bool relumeLiveIsRead = false;

void relumeLiveRead(vec3 positionWorld, vec3 n) {
  if (relumeLiveIsRead) return;
  relumeLiveIsRead = true;
  relumeLiveClear();
  if (relumeLiveVoxel == 0.0) return;
  ivec3 first;
  uint slot[8];
  float weight[8];
  relumeLiveStencil((positionWorld - relumeLiveOrigin) / relumeLiveVoxel, n, first, slot, weight);
  for (int k = 0; k < 8; ++k) {
    if (weight[k] > 0.0) relumeLiveAdd(slot[k], weight[k]);
  }
}

vec3 relumeLiveIrradiance(vec3 positionWorld, vec3 n) {
  relumeLiveRead(positionWorld, n);
  return relumeLiveIrradianceOfSum(n);
}

vec3 relumeLiveGlossy(vec3 positionWorld, vec3 n, vec3 r, float exponent) {
  relumeLiveRead(positionWorld, n);
  // Of the lobe (n + 1) / 2 pi cos^n over its half of the sphere.
  vec3 factor = vec3(1.0, (exponent + 1.0) / (exponent + 2.0), exponent / (exponent + 3.0));
  return clamp(relumeLiveAlong(r, factor), vec3(0.0), vec3(relumeLiveMost));
}
