// SPDX-License-Identifier: MIT
// For fragment shaders of the host's that draw triangles into the bits of a voxel volume (CRC Section 5): three
// orthographic views, a pixel a column of voxels, and each triangle in the one along which it is seen most.
// VoxelsGl::rasterView() has the views; no face is culled, and no depth is tested.
//
// Deviation: views are drawn one by one, and image atomics set the bits, in place of a geometry shader, logic operations
// and a merge pass.
#include "shared/layout.h"
#include "lib/live_bricks.glsl"

uniform vec3 relumeRasterOrigin;  // [m] the corner of voxel (0, 0, 0)
uniform float relumeRasterVoxel;  // [m] edge
uniform uint relumeRasterAxis;    // along which this view looks

// Sets the voxel of a fragment, or discards it. [m] the fragment's place, as interpolated.
void relumeVoxelWrite(vec3 positionWorld) {
  vec3 n = abs(cross(dFdx(positionWorld), dFdy(positionWorld)));
  // Where two axes are alike both views draw: rounding must not let each leave it to the other.
  if (n[relumeRasterAxis] < 0.999 * max(max(n.x, n.y), n.z)) discard;
  ivec3 v = ivec3(floor((positionWorld - relumeRasterOrigin) / relumeRasterVoxel));
  if (any(lessThan(v, ivec3(0))) || any(greaterThanEqual(v, 4 * ivec3(relumeBrickCells)))) discard;
  relumeAddBits(v, relumeBrickBit(v));
}
