// SPDX-License-Identifier: MIT
// Bits of voxels in the making: a brick of 4 x 4 x 4 bits a cell, its two words beside each other along x.
layout(r32ui, binding = RELUME_LIVE_IMAGE_BRICKS) uniform uimage3D relumeBricks;
uniform uvec3 relumeBrickCells;

// Of a voxel, in its word.
uint relumeBrickBit(ivec3 v) { return 1u << ((v.x & 3) | (v.y & 3) << 2 | (v.z & 1) << 4); }

// Of voxels that lie in the word of this one.
void relumeAddBits(ivec3 v, uint bits) {
  imageAtomicOr(relumeBricks, ivec3(2 * (v.x >> 2) + (v.z >> 1 & 1), v.y >> 2, v.z >> 2), bits);
}
