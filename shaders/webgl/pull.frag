// SPDX-License-Identifier: MIT
// Step 3 as fragment passes (PIC 4.1, 4.3): a draw per level of the hierarchy, deepest first, from one of two textures into the
// other, by the parity of the level. With RELUME_JOIN 1, at the end, all nodes from where they were made into one list.
#include "webgl/lists.glsl"
#include "lib/pack.glsl"

uniform usampler2D relumeTree;     // of each node: first child, second child, weight of the first, parity of its own level
uniform usampler2D relumeSenders;  // packed radiosity of the leaves
uniform usampler2D relumeEven;
uniform usampler2D relumeOdd;
uniform uint relumeBegin, relumeEnd;

layout(location = 0) out uint relumeRadiosity;

const uint kLeaf = 0x80000000u;

// A child is a node, or kLeaf with a sender's number.
uint valueOf(uint child, usampler2D nodes) {
  return (child & kLeaf) != 0u ? relumeWord(relumeSenders, child & ~kLeaf) : relumeWord(nodes, child);
}

void main() {
  uint node = relumeElement();
  if (node < relumeBegin || node >= relumeEnd) discard;
  uvec4 entry = texelFetch(relumeTree, relumeTexelOf(node), 0);
#if RELUME_JOIN
  // Leaves name themselves as their first child.
  bool leaf = entry.x == entry.y;
  if (leaf) relumeRadiosity = relumeWord(relumeSenders, entry.x & ~kLeaf);
  else relumeRadiosity = entry.w == 0u ? relumeWord(relumeEven, node) : relumeWord(relumeOdd, node);
#else
  if (entry.x == entry.y) discard;
#if RELUME_ODD
  vec3 first = relumeUnpackColor(valueOf(entry.x, relumeEven)), second = relumeUnpackColor(valueOf(entry.y, relumeEven));
#else
  vec3 first = relumeUnpackColor(valueOf(entry.x, relumeOdd)), second = relumeUnpackColor(valueOf(entry.y, relumeOdd));
#endif
  relumeRadiosity = relumePackColor(second + uintBitsToFloat(entry.z) * (first - second), relumeDither(node));
#endif
}
