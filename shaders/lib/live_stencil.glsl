// SPDX-License-Identifier: MIT
// Which caches a receiver reads: stencilAt() of runtime/live/cell_set.cpp, line by line.
#include "lib/live_volume.glsl"

// The plane of each standing voxel: 127 times its unit normal, and its place along that. [1/64 voxel from the middle]
layout(binding = RELUME_LIVE_UNIT_PLANES) uniform isampler2D relumeLivePlanes;

// Whether a voxel that stands is met on the way, voxel by voxel (runtime/voxels/march.h). [voxels]
bool relumeLiveIsHidden(vec3 eye, vec3 way) {
  ivec3 v = ivec3(floor(eye)), along = ivec3(greaterThan(way, vec3(1e-12))) - ivec3(lessThan(way, vec3(-1e-12)));
  vec3 inverse = 1.0 / mix(way, vec3(1.0), equal(along, ivec3(0)));
  ivec3 ahead = max(along, ivec3(0)), cell = ivec3(-1);
  uvec2 bits = uvec2(0u);
  for (int i = 0; i < 64; ++i) {
    if (relumeLiveHolds(v)) {
      if ((v >> 2) != cell) {
        cell = v >> 2;
        bits = relumeLiveCell(cell).xy;
      }
      if (relumeLiveIsSet(bits, relumeLiveBit(v))) return true;
    }
    vec3 t = mix((vec3(v + ahead) - eye) * inverse, vec3(1e30), equal(along, ivec3(0)));
    int axis = relumeLiveFirstAxis(t);
    if (t[axis] >= 1.0) return false;
    v[axis] += along[axis];
  }
  return false;
}

// Out of the voxel of another surface, to the side of its plane on which the place is; three times at most.
vec3 relumeLiveStepOut(vec3 place) {
  for (int tries = 0; tries < 3; ++tries) {
    ivec3 v = ivec3(floor(place));
    if (!relumeLiveHolds(v)) return place;
    uvec4 brick = relumeLiveCell(v >> 2);
    uint bit = relumeLiveBit(v);
    if (!relumeLiveIsSet(brick.xy, bit)) return place;
    int number = int(brick.z + relumeLiveCountBefore(brick.xy, bit));
    ivec2 at = ivec2(number % RELUME_LIVE_PLANES_A_ROW, number / RELUME_LIVE_PLANES_A_ROW);
    if (at.y >= textureSize(relumeLivePlanes, 0).y) return place;
    vec4 plane = vec4(texelFetch(relumeLivePlanes, at, 0));
    vec3 axis = plane.xyz / 127.0;
    float height = dot(place - (vec3(v) + 0.5), axis) - plane.w / 64.0;
    place += axis * (height < 0.0 ? -0.5 : 0.5);
  }
  return place;
}

// The cell of corner 0, the slots of the caches of all eight, and their weights, which sum to 1 or are 0. [voxels]
void relumeLiveStencil(vec3 position, vec3 n, out ivec3 first, out uint slot[8], out float weight[8]) {
  vec3 size = abs(n);
  float lift = 0.5 * (max(max(size.x, size.y), size.z) + size.x + size.y + size.z) + 0.05;
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
