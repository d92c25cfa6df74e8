// SPDX-License-Identifier: MIT
// The voxels that triangles overlap, one thread a triangle. Those that have to be cut and reach far are left to
// live_voxelise_large.comp, whose indirect dispatch this counts.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/live_cut.glsl"

const int kFar = 32;  // [voxels]

layout(std430, binding = RELUME_LIVE_SLOT_LARGE) buffer Large {
  uvec3 groups;
  uint count;
  uint unfinished;
  uint large[];
};

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  RelumePiece whole = relumePlaced(i);
  ivec3 first = relumeFirstVoxel(whole), last = relumeLastVoxel(whole), size = last - first;
  if (min(min(size.x, size.y), size.z) < 0) return;
  if (relumeCountPieces(whole) == 0u) {
    relumeSetVoxels(whole, first, last, ivec2(0), ivec2(1));
  } else if (max(max(size.x, size.y), size.z) < kFar) {
    relumeCutAndSet(whole, first, last, ivec2(0), ivec2(1));
  } else {
    uint at = atomicAdd(count, 1u);
    large[at] = i;
    atomicMax(groups.y, min(at + 1u, uint(RELUME_LIVE_MAX_GROUPS)));
    atomicMax(groups.z, at / uint(RELUME_LIVE_MAX_GROUPS) + 1u);
  }
}
