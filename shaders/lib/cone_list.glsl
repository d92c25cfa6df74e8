// SPDX-License-Identifier: MIT
// The voxels of a level that are not empty, or were not. All others hold zero.
layout(std430, binding = RELUME_CONE_SLOT_LIST) readonly buffer ConeList { uint coneList[]; };
uniform uint relumeConeFirstListed;  // of the level

ivec3 relumeConeListed(uint i) {
  uint word = coneList[relumeConeFirstListed + i];
  return ivec3(word & 1023u, word >> 10 & 1023u, word >> 20);
}
