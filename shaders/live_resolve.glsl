// SPDX-License-Identifier: MIT
// Light without a bake for a shader of the host's, as NestedCaches::irradiance() has it
// (runtime/live/nested_caches.h):
//
// vec3 relumeLiveIrradiance(vec3 positionWorld, vec3 n)   [W/m²] by all light but the punctual lights' own
// vec3 relumeLiveGlossy(vec3 positionWorld, vec3 n, vec3 r, float exponent)   mean radiance in a cos^exponent lobe
//                                                                             about r
//
// Both read the caches around a place once for an invocation: call them for one place and normal.
#include "shared/layout.h"
#define RELUME_LIVE_NESTED
#include "lib/live_stencil.glsl"
#include "lib/live_read.glsl"

// The volumes, from the outermost on.
uniform int relumeLiveVolumes;                          // 0 = there is no light yet
uniform vec3 relumeLiveOrigins[RELUME_LIVE_MAX_VOLUMES];  // as relumeLiveOrigin and what follows it, of each
uniform float relumeLiveVoxels[RELUME_LIVE_MAX_VOLUMES];
uniform uvec3 relumeLiveSizes[RELUME_LIVE_MAX_VOLUMES];
uniform int relumeLiveLayers[RELUME_LIVE_MAX_VOLUMES];
// VolumeReach of runtime/voxels/voxel_grid.h. Beyond the outermost's is the sky, whose light is cache 0.
uniform vec3 relumeLiveLows[RELUME_LIVE_MAX_VOLUMES];
uniform vec3 relumeLiveHighs[RELUME_LIVE_MAX_VOLUMES];

bool relumeLiveIsRead = false;

// Places and directions that are read for, as on the CPU; by bits, for GLSL may take it that nothing is NaN.
bool relumeLiveIsFinite(vec3 v) {
  return all(notEqual(floatBitsToUint(v) & 0x7F800000u, uvec3(0x7F800000u)));
}
bool relumeLiveIsDirection(vec3 n) { return relumeLiveIsFinite(n) && dot(n, n) < RELUME_MAX_NORMAL2; }
bool relumeLiveIsPlace(vec3 p) {
  return relumeLiveIsFinite(p) && all(lessThanEqual(abs(p), vec3(RELUME_MAX_COORDINATE)));
}

// VolumeReach::share(); outside an inner volume it is 0. [place: voxels]
float relumeLiveShare(int volume, vec3 place) {
  bool isWithin = all(greaterThanEqual(place, vec3(0.0))) && all(lessThan(place, 4.0 * vec3(relumeLiveSize)));
  if (volume > 0 && !isWithin) return 0.0;
  vec3 within = min(place - relumeLiveLows[volume], relumeLiveHighs[volume] - place);
  return clamp(min(min(within.x, within.y), within.z) / (4.0 * RELUME_LIVE_BLEND_CELLS), 0.0, 1.0);
}

void relumeLiveRead(vec3 positionWorld, vec3 n) {
  if (relumeLiveIsRead) return;
  relumeLiveIsRead = true;
  relumeLiveClear();
  float rest = 1.0, sky = 0.0;
  for (int v = relumeLiveVolumes - 1; v >= 0 && rest > 0.0; --v) {
    relumeLiveOrigin = relumeLiveOrigins[v];
    relumeLiveVoxel = relumeLiveVoxels[v];
    relumeLiveSize = relumeLiveSizes[v];
    relumeLiveLayer = relumeLiveLayers[v];
    vec3 place = (positionWorld - relumeLiveOrigin) / relumeLiveVoxel;
    float share = rest * relumeLiveShare(v, place), sum = 0.0;
    if (v == 0) sky = rest - share;
    if (share <= 0.0) continue;
    ivec3 first;
    uint slot[8];
    float weight[8];
    relumeLiveStencil(place, n, first, slot, weight);
    for (int k = 0; k < 8; ++k) {
      sum += weight[k];
      if (weight[k] > 0.0) relumeLiveAdd(slot[k], share * weight[k]);
    }
    // Far from surfaces small cells have no caches, and large ones do.
    if (sum > 0.0) rest -= share;
  }
  if (sky > 0.0) relumeLiveAdd(0u, sky);
  rest -= sky;
  if (rest > 0.0 && rest < 1.0) {
    for (int k = 0; k < 7; ++k) relumeLiveSum[k] /= 1.0 - rest;
  }
}

vec3 relumeLiveIrradiance(vec3 positionWorld, vec3 n) {
  if (!relumeLiveIsPlace(positionWorld) || !relumeLiveIsDirection(n)) return vec3(0.0);
  relumeLiveRead(positionWorld, n);
  return relumeLiveIrradianceOfSum(n);
}

vec3 relumeLiveGlossy(vec3 positionWorld, vec3 n, vec3 r, float exponent) {
  if (!relumeLiveIsPlace(positionWorld) || !relumeLiveIsDirection(n) || !relumeLiveIsDirection(r) ||
      !relumeLiveIsFinite(vec3(exponent)))
    return vec3(0.0);
  relumeLiveRead(positionWorld, n);
  // Of the lobe (n + 1) / 2 pi cos^n over its half of the sphere.
  vec3 factor = vec3(1.0, (exponent + 1.0) / (exponent + 2.0), exponent / (exponent + 3.0));
  return clamp(relumeLiveAlong(r, factor), vec3(0.0), vec3(relumeLiveMost));
}
