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

// The cell of corner 0, the slots of the caches of all eight, and their weights, which sum to 1 or are 0. [voxels]
void relumeLiveStencil(vec3 position, vec3 n, out ivec3 first, out uint slot[8], out float weight[8]) {
  vec3 size = abs(n);
  float lift = 0.25 * (max(max(size.x, size.y), size.z) + size.x + size.y + size.z) + 0.025;
  vec3 eye = relumeLiveStepOut(position + lift * n), at = 0.25 * (position + 0.5 * n) - 0.5;
  at = clamp(at, vec3(-2.0), vec3(relumeLiveSize));  // a place far away has no integers
  first = ivec3(floor(at));
  vec3 share = at - vec3(first);
  float before[8], beforeSum = 0.0, seenSum = 0.0;
  for (int k = 0; k < 8; ++k) {
    ivec3 corner = ivec3(k & 1, k >> 1 & 1, k >> 2), cell = first + corner;
    slot[k] = kRelumeLiveNone;
    before[k] = weight[k] = 0.0;
    if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, ivec3(relumeLiveSize)))) continue;
    uint cache = relumeLiveCell(cell).w;
    if (cache == kRelumeLiveNone) continue;
    slot[k] = cache >> 6;
    uint voxel = cache & 63u;
    vec3 stands = vec3(4 * cell + ivec3(voxel & 3u, voxel >> 2 & 3u, voxel >> 4)) + 0.5, toward = stands - eye;
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
