// SPDX-License-Identifier: MIT
// Which caches a receiver reads: stencilAt() of runtime/live/cell_set.cpp, line by line.
#include "lib/live_volume.glsl"
#include "lib/live_sub_voxels.glsl"

// Of each standing voxel that has some: bits of its sub-voxels in x and y; in z its plane, a byte each of 127 times its
// unit normal and its place along that. [1/64 voxel from the middle]
layout(binding = RELUME_LIVE_UNIT_SUB_VOXELS) uniform usampler2D relumeLiveSubVoxels;

// Of a voxel that has some, whose brick this is.
uvec4 relumeLiveSubVoxelsOf(uvec4 brick, uint bit) {
  int number = int(brick.z + relumeLiveCountBefore(brick.xy, bit));
  ivec2 at = ivec2(number % RELUME_LIVE_SUB_VOXELS_A_ROW, number / RELUME_LIVE_SUB_VOXELS_A_ROW);
  return texelFetch(relumeLiveSubVoxels, at, 0);
}

// Whether a sub-voxel that stands is met on the way (runtime/voxels/march.h). [voxels]
bool relumeLiveIsHidden(vec3 eye, vec3 way) {
  relumeLiveRay ray = relumeLiveRayOf(eye, way);
  ivec3 v = ivec3(floor(eye)), cell = ivec3(-1);
  uvec4 brick = uvec4(0u);
  int entered = -1;
  float since = 0.0;
  uint sub;
  int across;
  for (int i = 0; i < 64; ++i) {
    if (relumeLiveHolds(v)) {
      if ((v >> 2) != cell) {
        cell = v >> 2;
        brick = relumeLiveCell(cell);
      }
      uint bit = relumeLiveBit(v);
      if (relumeLiveIsSet(brick.xy, bit) &&
          relumeLiveMeets(ray, v, relumeLiveSubVoxelsOf(brick, bit).xy, entered, since, 1.0, sub, across))
        return true;
    }
    vec3 t = relumeLiveCrossings(ray, v, 1.0);
    entered = relumeLiveFirstAxis(t);
    since = t[entered];
    if (since >= 1.0) return false;
    v[entered] += ray.along[entered];
  }
  return false;
}

// Out of the sub-voxels of another surface, to the side of its plane on which the place is; three times at most.
vec3 relumeLiveStepOut(vec3 place) {
  for (int tries = 0; tries < 3; ++tries) {
    ivec3 v = ivec3(floor(place));
    if (!relumeLiveHolds(v)) return place;
    uvec4 brick = relumeLiveCell(v >> 2);
    uint bit = relumeLiveBit(v);
    if (!relumeLiveIsSet(brick.xy, bit)) return place;
    uvec4 found = relumeLiveSubVoxelsOf(brick, bit);
    if (!relumeLiveIsSet(found.xy, relumeLiveBit(ivec3(floor(4.0 * place))))) return place;
    vec4 plane = vec4(ivec4(found.zzz << uvec3(24u, 16u, 8u), found.z) >> 24);
    vec3 axis = plane.xyz / 127.0;
    float height = dot(place - (vec3(v) + 0.5), axis) - plane.w / 64.0;
    place += axis * (height < 0.0 ? -0.125 : 0.125);
  }
  return place;
}

ivec3 relumeLiveCorner(int k) { return ivec3(k & 1, k >> 1 & 1, k >> 2); }

// The voxel that a cell's cache stands in, from the cell's corner.
ivec3 relumeLiveStands(uint cache) { return ivec3(cache & 3u, cache >> 2 & 3u, cache >> 4 & 3u); }

uint relumeLiveCacheOf(ivec3 cell) {
  if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, ivec3(relumeLiveSize)))) return kRelumeLiveNone;
  return relumeLiveCell(cell).w;
}

// The caches of eight cells, and where a place is between them: placeBetween().
vec3 relumeLiveShareOf(ivec3 first, vec3 at, out uint cache[8]) {
  vec3 aside[8];
  for (int k = 0; k < 8; ++k) {
    cache[k] = relumeLiveCacheOf(first + relumeLiveCorner(k));
    aside[k] = cache[k] == kRelumeLiveNone ? vec3(0.0) : 0.25 * vec3(relumeLiveStands(cache[k]) - 1);
  }
  vec3 share = at;
  for (int i = 0; i < 3; ++i) {
    vec3 u = clamp(share, 0.0, 1.0), x0 = mix(aside[0], aside[1], u.x), x1 = mix(aside[2], aside[3], u.x),
         x2 = mix(aside[4], aside[5], u.x), x3 = mix(aside[6], aside[7], u.x);
    share = at - mix(mix(x0, x1, u.y), mix(x2, x3, u.y), u.z);
  }
  return share;
}

bool relumeLiveHoldsFirst(ivec3 first) {
  return all(greaterThan(first, ivec3(-2))) && all(lessThan(first, ivec3(relumeLiveSize)));
}

// The cell of corner 0, the slots of the caches of all eight, and their weights, which sum to 1 or are 0: stencilOf() and
// readPlaceOf() of runtime/live/cell_set.cpp. [voxels]
void relumeLiveStencil(vec3 position, vec3 n, out ivec3 first, out uint slot[8], out float weight[8]) {
  vec3 size = abs(n);
  float lift = 0.25 * (max(max(size.x, size.y), size.z) + size.x + size.y + size.z) + 0.025;
  vec3 eye = relumeLiveStepOut(position + lift * n), at = 0.25 * (position + n) - 0.375;
  at = clamp(at, vec3(-2.0), vec3(relumeLiveSize));  // a place far away has no integers
  first = ivec3(floor(at));
  at -= vec3(first);
  uint cache[8];
  vec3 share = relumeLiveShareOf(first, at, cache);
  ivec3 beside = ivec3(greaterThan(share, vec3(1.0))) - ivec3(lessThan(share, vec3(0.0)));
  if (beside != ivec3(0) && relumeLiveHoldsFirst(first) && relumeLiveHoldsFirst(first + beside)) {
    first += beside;
    share = relumeLiveShareOf(first, at - vec3(beside), cache);
  }
  share = clamp(share, 0.0, 1.0);
  float before[8], beforeSum = 0.0, seenSum = 0.0;
  for (int k = 0; k < 8; ++k) {
    ivec3 corner = relumeLiveCorner(k);
    slot[k] = kRelumeLiveNone;
    before[k] = weight[k] = 0.0;
    if (cache[k] == kRelumeLiveNone) continue;
    slot[k] = cache[k] >> 6;
    vec3 stands = vec3(4 * (first + corner) + relumeLiveStands(cache[k])) + 0.5, toward = stands - eye;
    vec3 w = mix(1.0 - share, share, vec3(corner));
    float trilinear = max(w.x * w.y * w.z, 1e-4), height = dot(stands - position, n);
    before[k] = height > 0.0 ? trilinear : 1e-3 * trilinear;
    beforeSum += before[k];
    if (height <= 0.0 || (dot(toward, toward) > 1e-6 && relumeLiveIsHidden(eye, toward))) continue;
    weight[k] = trilinear;
    seenSum += trilinear;
  }
  bool sees = seenSum > 1e-3;
  float sum = sees ? seenSum : beforeSum;
  for (int k = 0; k < 8; ++k) weight[k] = sum > 0.0 ? (sees ? weight[k] : before[k]) / sum : 0.0;
}
