// SPDX-License-Identifier: MIT
// Flux of a reflective shadow map into the voxels that its texels lie in: the first half of RsmVoxels::light()
// (runtime/cones/rsm_voxels.cpp), line by line, whose sums these are to the bit. A thread a texel. What is out of range
// or not finite lights nothing.
#include "shared/layout.h"
#include "lib/is_within.glsl"
#include "lib/live_threads.glsl"
#include "lib/live_volume.glsl"
#include "lib/cone_rsm.glsl"

layout(binding = RELUME_CONE_UNIT_RSM_PLACES) uniform sampler2D places;
layout(binding = RELUME_CONE_UNIT_RSM_NORMALS) uniform sampler2D normals;
layout(binding = RELUME_CONE_UNIT_RSM_FLUX) uniform sampler2D fluxes;

uniform uint relumeRsmSide;  // texels along a row
uniform float relumeRsmPerMetre;
uniform float relumeRsmPerWatt;
uniform float relumeRsmLargest;  // [W] flux is cut there

// The side that has the flux of a voxel's side that a surface faces, kRelumeNone = none.
uint sideAt(ivec3 v, ivec3 normal) {
  if (!relumeLiveHolds(v)) return kRelumeNone;
  uvec4 cell = texelFetch(relumeLiveCells, v >> 2, 0);
  uint bit = relumeLiveBit(v);
  if (!relumeLiveIsSet(cell.xy, bit)) return kRelumeNone;
  uint number = cell.z + relumeLiveCountBefore(cell.xy, bit), word = rsmVoxel[number].axis;
  ivec3 facing = normal * (ivec3(word >> 16 & 255u, word >> 8 & 255u, word & 255u) - 128);
  return facing.x + facing.y + facing.z >= 0 ? rsmVoxel[number].front : rsmVoxel[number].back;
}

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  ivec2 at = ivec2(i % relumeRsmSide, i / relumeRsmSide);
  vec4 seen = texelFetch(places, at, 0);
  vec3 normal = texelFetch(normals, at, 0).xyz, flux = texelFetch(fluxes, at, 0).rgb;
  if (!(relumeIsWithin(seen.www, 1e30) && seen.w > 0.0) || !relumeIsWithin(seen.xyz, RELUME_MAX_COORDINATE) ||
      !relumeIsWithin(normal, 2.0) || !relumeIsWithin(flux, 1e30))
    return;
  uvec3 units = uvec3(clamp(flux, vec3(0.0), vec3(relumeRsmLargest)) * relumeRsmPerWatt);
  if (units == uvec3(0u)) return;

  precise vec3 place = (seen.xyz - relumeLiveOrigin) * relumeRsmPerMetre;
  vec3 end = vec3(4u * relumeLiveSize) + 1.0;
  if (any(lessThan(place, vec3(-1.0))) || any(greaterThanEqual(place, end))) return;
  precise vec3 bytes = 127.0 * normal + 0.5;
  ivec3 steps = ivec3(floor(place * 64.0)), turned = ivec3(floor(bytes));
  ivec3 size = abs(turned), here = steps >> 6;
  int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  ivec3 beside = ivec3(0);
  beside[axis] = (steps[axis] & 63) < 32 ? -1 : 1;
  uint side = sideAt(here, turned);
  if (side == kRelumeNone) side = sideAt(here + beside, turned);
  if (side == kRelumeNone) side = sideAt(here - beside, turned);
  if (side == kRelumeNone) return;
  for (uint k = 0u; k < 3u; ++k) {
    if (units[k] == 0u) continue;
    uint before = atomicAdd(rsmSum[6u * side + k], units[k]);
    if (before + units[k] < before) atomicAdd(rsmSum[6u * side + 3u + k], 1u);
  }
}
