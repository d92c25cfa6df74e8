// SPDX-License-Identifier: MIT
// Volumes that lie in one another as cones read them, from the outermost on: what lib/live_volume.glsl and
// lib/cone_trace.glsl name is of the one that was entered last.
uniform uint relumeConeVolumes;                           // how many there are
uniform vec3 relumeConeCorners[RELUME_LIVE_MAX_VOLUMES];  // [m] of voxel (0, 0, 0)
uniform float relumeConeEdges[RELUME_LIVE_MAX_VOLUMES];   // [m] of a voxel
uniform uvec3 relumeConeCells[RELUME_LIVE_MAX_VOLUMES];   // how many
uniform uvec3 relumeConeKinds[RELUME_LIVE_MAX_VOLUMES];   // layer of cells; levels above the voxels; open faces
// Of each level of each along z, of level 1 in its own texture.
uniform uint relumeConeOffset[RELUME_LIVE_MAX_VOLUMES * RELUME_CONE_MAX_LEVELS];

uint relumeConeVolume, relumeConeLevelCount;

void relumeConeEnter(uint volume) {
  relumeConeVolume = volume;
  relumeLiveOrigin = relumeConeCorners[volume];
  relumeLiveVoxel = relumeConeEdges[volume];
  relumeLiveSize = relumeConeCells[volume];
  relumeLiveLayer = int(relumeConeKinds[volume].x);
  relumeConeLevelCount = relumeConeKinds[volume].y;
}

float relumeConeAlongZ(int level) {
  return float(relumeConeOffset[relumeConeVolume * uint(RELUME_CONE_MAX_LEVELS) + uint(level)]);
}

vec3 relumeConeOrigin(vec3 world) { return world; }

// shareOfSample() of runtime/cones/nested_cones.h.
float relumeConeShare(vec3 place, float width) {
  uint open = relumeConeKinds[relumeConeVolume].z;
  float blend = 4.0 * RELUME_LIVE_BLEND_CELLS, inside = blend;
  for (int k = 0; k < 3; ++k) {
    if ((open >> k & 1u) != 0u) inside = min(inside, place[k] - width);
    if ((open >> (3 + k) & 1u) != 0u) inside = min(inside, 4.0 * float(relumeLiveSize[k]) - place[k] - width);
  }
  return max(inside / blend, 0.0);
}
