// SPDX-License-Identifier: MIT
// Threads of the passes of light without a bake, of which there may be more than a dispatch has along one axis.
layout(local_size_x = RELUME_LIVE_GROUP) in;

uniform uint relumeLiveThreads;  // that have something to do

uint relumeLiveThread() {
  return gl_WorkGroupID.y * uint(RELUME_LIVE_MAX_GROUPS * RELUME_LIVE_GROUP) + gl_GlobalInvocationID.x;
}
