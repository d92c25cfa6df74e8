// SPDX-License-Identifier: MIT
// The voxels of a level that are not empty. All others hold zero.
layout(std430, binding = RELUME_CONE_SLOT_OCCUPIED) readonly buffer ConeOccupied { uint coneOccupied[]; };
uniform uint relumeConeFirstOccupied;  // of the level
uniform bool relumeConeClears;         // they are to be zero as well

ivec3 relumeConeOccupied(uint i) {
  uint word = coneOccupied[relumeConeFirstOccupied + i];
  return ivec3(word & 1023u, word >> 10 & 1023u, word >> 20);
}
