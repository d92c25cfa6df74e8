// SPDX-License-Identifier: MIT
// Rays through the bits of a moving shape, exactly (runtime/voxels/march.h), whose words are shapeWord[].

// Where the ray is along an axis when it leaves a brick along another at t: a guess, then as many crossings as come
// before. isFirst: of crossings at one t this axis' come first.
int whenLeaving(int v, int along, int ahead, float origin, float way, float inverse, float t, bool isFirst) {
  if (along == 0) return v;
  int low = v & ~3, last = along > 0 ? low + 3 : low;
  int at = clamp(int(origin + t * way), min(v, last), max(v, last));
  for (int i = 0; i < 3 && at != last; ++i) {
    float cross = (float(at + ahead) - origin) * inverse;
    if (!(cross < t || (cross == t && isFirst))) break;
    at += along;
  }
  for (int i = 0; i < 3 && at != v; ++i) {
    float cross = (float(at - along + ahead) - origin) * inverse;
    if (cross < t || (cross == t && isFirst)) break;
    at -= along;
  }
  return at;
}

// Of the axes that are crossed at these times, the first.
int firstAxis(vec3 t) { return t.y < t.x ? (t.z < t.y ? 2 : 1) : (t.z < t.x ? 2 : 0); }

// The first voxel set within [0, tMax), and when the ray enters it; t counts in lengths of the way. shape: its first word.
// origin, way [voxels]
bool march(uint shape, vec3 origin, vec3 way, float tMax, out ivec3 v, out float t) {
  ivec3 cells = ivec3(shapeWord[shape], shapeWord[shape + 1u], shapeWord[shape + 2u]), size = 4 * cells;
  ivec3 along = ivec3(greaterThan(way, vec3(1e-12))) - ivec3(lessThan(way, vec3(-1e-12)));
  bvec3 never = equal(along, ivec3(0));
  vec3 inverse = 1.0 / mix(way, vec3(1.0), never);
  ivec3 ahead = max(along, ivec3(0));
  v = ivec3(0);
  t = 0.0;
  int entered = -1;
  for (int a = 0; a < 3; ++a) {
    if (origin[a] >= 0.0 && origin[a] < float(size[a])) continue;
    bool below = origin[a] < 0.0;
    if (below ? along[a] <= 0 : along[a] >= 0) return false;
    float enters = ((below ? 0.0 : float(size[a])) - origin[a]) * inverse[a];
    if (enters < t) continue;
    t = enters;
    entered = a;
  }
  if (!(t < tMax)) return false;
  vec3 at = origin + t * way;
  // Rounding may put the place of entry a little outside.
  if (entered >= 0 && (any(lessThan(at, vec3(-0.5))) || any(greaterThan(at, vec3(size) + 0.5)))) return false;
  v = clamp(ivec3(floor(at)), ivec3(0), size - 1);
  if (entered >= 0) v[entered] = along[entered] > 0 ? 0 : size[entered] - 1;
  ivec3 cell = ivec3(-1);
  uvec2 brick = uvec2(0u);
  // No ray crosses more planes than this, of 32 voxels an axis.
  for (int i = 0; i < 128; ++i) {
    if ((v >> 2) != cell) {
      cell = v >> 2;
      uint word = shape + RELUME_SHAPE_BITS + 2u * uint((cell.z * cells.y + cell.y) * cells.x + cell.x);
      brick = uvec2(shapeWord[word], shapeWord[word + 1u]);
    }
    if (brick == uvec2(0u)) {
      ivec3 low = v & ~3;
      vec3 leaves = mix((vec3(low + 4 * ahead) - origin) * inverse, vec3(1e30), never);
      int axis = firstAxis(leaves);
      t = leaves[axis];
      if (t >= 1e30) return false;
      ivec3 next = ivec3(whenLeaving(v.x, along.x, ahead.x, origin.x, way.x, inverse.x, t, 0 < axis),
                         whenLeaving(v.y, along.y, ahead.y, origin.y, way.y, inverse.y, t, 1 < axis),
                         whenLeaving(v.z, along.z, ahead.z, origin.z, way.z, inverse.z, t, 2 < axis));
      next[axis] = along[axis] > 0 ? low[axis] + 4 : low[axis] - 1;
      v = next;
    } else {
      uint bit = uint((v.x & 3) | (v.y & 3) << 2 | (v.z & 1) << 4);
      if ((((v.z & 2) == 0 ? brick.x : brick.y) >> bit & 1u) != 0u) return true;
      vec3 leaves = mix((vec3(v + ahead) - origin) * inverse, vec3(1e30), never);
      int axis = firstAxis(leaves);
      t = leaves[axis];
      v[axis] += along[axis];
    }
    if (t >= tMax || any(lessThan(v, ivec3(0))) || any(greaterThanEqual(v, size))) return false;
  }
  return false;
}
