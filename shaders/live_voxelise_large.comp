// SPDX-License-Identifier: MIT
// The voxels of triangles that live_voxelise.comp has left: a work group for each and for each block of the grid, whose
// threads, RELUME_LANES of them, go through the same pieces and share their rows of voxels.
#include "shared/layout.h"
#include "lib/live_cut.glsl"

layout(local_size_x = RELUME_LANES) in;

layout(std430, binding = RELUME_LIVE_SLOT_LARGE) buffer Large {
  uvec3 groups;
  uint count;
  uint unfinished;
  uint large[];
};

void main() {
  uint at = gl_WorkGroupID.z * uint(RELUME_LIVE_MAX_GROUPS) + gl_WorkGroupID.y, block = gl_WorkGroupID.x;
  if (at >= count) return;
  ivec3 voxels = 4 * ivec3(relumeBrickCells), side = ivec3(RELUME_LIVE_BLOCK);
  uvec3 blocks = uvec3((voxels + side - 1) / side);
  ivec3 begin = side * ivec3(block % blocks.x, block / blocks.x % blocks.y, block / (blocks.x * blocks.y));
  int thread = int(gl_LocalInvocationID.x);
  if (!relumeCutAndSet(relumePlaced(large[at]), begin, min(begin + side, voxels) - 1, ivec2(thread & 7, thread >> 3),
                       ivec2(8, RELUME_LANES / 8)))
    unfinished = 1u;
}
