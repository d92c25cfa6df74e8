// SPDX-License-Identifier: MIT
// No voxel is set.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/live_bricks.glsl"

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  uint row = 2u * relumeBrickCells.x;
  imageStore(relumeBricks, ivec3(i % row, i / row % relumeBrickCells.y, i / (row * relumeBrickCells.y)), uvec4(0u));
}
