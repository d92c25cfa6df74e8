// SPDX-License-Identifier: MIT
// Sub-voxels in the way of a ray that goes voxel by voxel: VoxelMarch::meets() of runtime/voxels/march.h.

// Written as all names here that a host's shader may have under another prefix.
struct relumeLiveRay {
  vec3 origin, inverse;  // [voxels]; 1 / the way, 1 along axes that it does not go
  ivec3 along, ahead;    // which way it goes: -1, 0 or 1; 1 where it goes up
};

relumeLiveRay relumeLiveRayOf(vec3 origin, vec3 way) {
  ivec3 along = ivec3(greaterThan(way, vec3(1e-12))) - ivec3(lessThan(way, vec3(-1e-12)));
  return relumeLiveRay(origin, 1.0 / mix(way, vec3(1.0), equal(along, ivec3(0))), along, max(along, ivec3(0)));
}

// When it crosses the faces ahead of a cube, of which there are so many in a voxel's edge.
vec3 relumeLiveCrossings(relumeLiveRay ray, ivec3 at, float cube) {
  return mix((cube * vec3(at + ray.ahead) - ray.origin) * ray.inverse, vec3(1e30), equal(ray.along, ivec3(0)));
}

// Whether it meets one of these sub-voxels of a voxel before it leaves that or ends. entered: across a plane of which
// axis it came in, at `since`; -1 = it begins there. sub: the sub-voxel's bit; across: as `entered`, of that.
bool relumeLiveMeets(relumeLiveRay ray, ivec3 v, uvec2 subVoxels, int entered, float since, float end, out uint sub,
                     out int across) {
  ivec3 low = 4 * v, s = clamp(ivec3(floor(4.0 * ray.origin)), low, low + 3), last = low + 3 * ray.ahead;
  sub = 0u;
  across = entered;
  for (int a = 0; a < 3; ++a) {
    if (entered < 0 || a == entered || ray.along[a] == 0) continue;
    for (int i = 0; i < 3 && s[a] != last[a]; ++i) {
      float cross = (0.25 * float(s[a] + ray.ahead[a]) - ray.origin[a]) * ray.inverse[a];
      if (!(cross < since || (cross == since && a < entered))) break;
      s[a] += ray.along[a];
    }
  }
  // No ray passes more sub-voxels of a voxel than this.
  for (int i = 0; i < 10 && (s >> 2) == v; ++i) {
    sub = relumeLiveBit(s);
    if (relumeLiveIsSet(subVoxels, sub)) return true;
    vec3 t = relumeLiveCrossings(ray, s, 0.25);
    int axis = relumeLiveFirstAxis(t);
    if (t[axis] >= end) return false;
    s[axis] += ray.along[axis];
    across = axis;
  }
  return false;
}
