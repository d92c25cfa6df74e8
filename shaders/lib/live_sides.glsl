// SPDX-License-Identifier: MIT
// Threads of passes over the sides of voxels, of which there may be more than a dispatch has along one axis.
layout(local_size_x = RELUME_LIVE_GROUP) in;

uniform uint relumeLiveSides;

uint relumeLiveSide() { return gl_WorkGroupID.y * uint(RELUME_LIVE_MAX_GROUPS * RELUME_LIVE_GROUP) + gl_GlobalInvocationID.x; }
