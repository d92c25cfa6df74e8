// SPDX-License-Identifier: MIT
// Leaves of the senders, in blocks of a work group: a word that is the least node, then 16 bits a sender that lead on
// from it (runtime/passes/leaf_blocks.h).
layout(std430, binding = RELUME_SLOT_LEAF_NODE) readonly buffer RelumeLeafNode { uint relumeLeafNode[]; };

// Node of a sender's leaf; kRelumeNone where a block has no more senders.
uint relumeLeafOf(uint sender) {
  uint block = sender / uint(RELUME_SURFEL_GROUP) * uint(1 + RELUME_SURFEL_GROUP / 2), i = sender % uint(RELUME_SURFEL_GROUP);
  uint step = relumeLeafNode[block + 1u + (i >> 1)] >> (16u * (i & 1u)) & 0xFFFFu;
  return step == 0xFFFFu ? kRelumeNone : relumeLeafNode[block] + step;
}
