// SPDX-License-Identifier: MIT
// Rays through the bits of a moving shape, voxel by voxel: those that runtime/voxels/march.h meets, which crosses empty
// bricks in one step. Words of shapes are shapeWord[].

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
  // No ray crosses more planes than this, of 32 voxels an axis.
  for (int i = 0; i < 100; ++i) {
    ivec3 cell = v >> 2;
    uint word = RELUME_SHAPE_BITS + 2u * uint((cell.z * cells.y + cell.y) * cells.x + cell.x) + uint(v.z >> 1 & 1);
    if ((shapeWord[shape + word] >> ((v.x & 3) | (v.y & 3) << 2 | (v.z & 1) << 4) & 1u) != 0u) return true;
    vec3 leaves = mix((vec3(v + ahead) - origin) * inverse, vec3(1e30), never);
    int axis = firstAxis(leaves);
    t = leaves[axis];
    v[axis] += along[axis];
    if (t >= tMax || any(lessThan(v, ivec3(0))) || any(greaterThanEqual(v, size))) return false;
  }
  return false;
}
