// SPDX-License-Identifier: MIT
// Direct light at the surfels, behind Relume's surfels and scene.glsl: what lights the pixels lights them, too.
layout(local_size_x = 64) in;
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < relumeSurfelSlots)
    relumeSetSurfelIrradiance(i, directIrradiance(relumeSurfelPosition(i), relumeSurfelNormal(i)));
}
