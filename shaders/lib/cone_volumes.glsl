// SPDX-License-Identifier: MIT
// Volumes that lie in one another as cones read them, from the outermost on: what lib/live_volume.glsl and
// lib/cone_trace.glsl name is of the one that was entered last.
uniform uint relumeConeVolumes;                           // how many there are
uniform vec3 relumeConeCorners[RELUME_LIVE_MAX_VOLUMES];  // [m] of voxel (0, 0, 0)
uniform float relumeConeEdges[RELUME_LIVE_MAX_VOLUMES];   // [m] of a voxel
uniform uvec3 relumeConeCells[RELUME_LIVE_MAX_VOLUMES];   // how many
uniform uvec2 relumeConeKinds[RELUME_LIVE_MAX_VOLUMES];   // layer of cells; levels above the voxels
uniform vec3 relumeConeLows[RELUME_LIVE_MAX_VOLUMES];     // VolumeReach of runtime/voxels/voxel_grid.h
uniform vec3 relumeConeHighs[RELUME_LIVE_MAX_VOLUMES];
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

// VolumeReach::share().
float relumeConeShare(vec3 place, float width) {
  vec3 within = min(place - relumeConeLows[relumeConeVolume], relumeConeHighs[relumeConeVolume] - place) - width;
  return clamp(min(min(within.x, within.y), within.z) / (4.0 * RELUME_LIVE_BLEND_CELLS), 0.0, 1.0);
}
