// SPDX-License-Identifier: MIT
// The voxel volume of light without a bake: a brick of 4 x 4 x 4 bits a cell (runtime/voxels/voxel_grid.h).
//
// relumeLiveCells: bits of voxels in x and y, and the number of the first of them. To receivers those that stand and have
// sub-voxels (runtime/voxels/sub_voxels.h), and in w the cell's cache, 64 times its slot and the voxel that it stands in,
// kRelumeLiveNone = none; to the gather those that stand; to cones all.
layout(binding = RELUME_LIVE_UNIT_CELLS) uniform usampler3D relumeLiveCells;
//
// RELUME_LIVE_NESTED: there are several, whose layers of cells follow one another in the texture; these are of the one
// that is read. RELUME_LIVE_LAYERED: of one of them, whichever.
#ifdef RELUME_LIVE_NESTED
vec3 relumeLiveOrigin;
float relumeLiveVoxel;
uvec3 relumeLiveSize;
int relumeLiveLayer;  // of relumeLiveCells, at which its cells begin
#else
uniform vec3 relumeLiveOrigin;  // [m] the corner of voxel (0, 0, 0)
uniform float relumeLiveVoxel;  // [m] edge; 0 = there is no light yet
uniform uvec3 relumeLiveSize;   // cells
#ifdef RELUME_LIVE_LAYERED
uniform int relumeLiveLayer;
#else
const int relumeLiveLayer = 0;
#endif
#endif

const uint kRelumeLiveNone = 0xFFFFFFFFu;

uvec4 relumeLiveCell(ivec3 cell) { return texelFetch(relumeLiveCells, cell + ivec3(0, 0, relumeLiveLayer), 0); }

bool relumeLiveHolds(ivec3 v) {
  return all(greaterThanEqual(v, ivec3(0))) && all(lessThan(v, 4 * ivec3(relumeLiveSize)));
}

uint relumeLiveBit(ivec3 v) { return uint((v.x & 3) | (v.y & 3) << 2 | (v.z & 3) << 4); }

bool relumeLiveIsSet(uvec2 bits, uint bit) { return ((bit < 32u ? bits.x : bits.y) >> (bit & 31u) & 1u) != 0u; }

uint relumeLiveCountBefore(uvec2 bits, uint bit) {
  uvec2 below = bit < 32u ? uvec2((1u << bit) - 1u, 0u) : uvec2(0xFFFFFFFFu, (1u << (bit - 32u)) - 1u);
  uvec2 count = uvec2(bitCount(bits & below));
  return count.x + count.y;
}

// Of the axes that are crossed at these times, the first.
int relumeLiveFirstAxis(vec3 t) { return t.y < t.x ? (t.z < t.y ? 2 : 1) : (t.z < t.x ? 2 : 0); }
