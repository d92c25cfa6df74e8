// SPDX-License-Identifier: MIT
// Voxels that reflective shadow maps light, and the flux of their sides in integers: runtime/cones/rsm_voxels.h.
layout(std430, binding = RELUME_CONE_SLOT_RSM_VOXELS) readonly buffer RsmVoxels { RelumeRsmVoxel rsmVoxel[]; };
layout(std430, binding = RELUME_CONE_SLOT_RSM_SUMS) buffer RsmSums { uint rsmSum[]; };
