// SPDX-License-Identifier: MIT
// What radiance of the levels is counted in. Halves end at 65504, and radiance times optical depth may be anything: the
// unit is a power of two for which the brightest voxel is from 4096 to 8192, and depths are at most kConeSolid.
#if RELUME_CONE_HALVES
#define RELUME_CONE_LEVEL_FORMAT rgba16f
layout(std430, binding = RELUME_CONE_SLOT_BRIGHTEST) readonly buffer ConeBrightest { uint coneBrightest; };
// [W/m²/sr]
float relumeConeUnit() { return uintBitsToFloat((max(coneBrightest >> 23, 53u) - 12u) << 23); }
#else
#define RELUME_CONE_LEVEL_FORMAT rgba32f
float relumeConeUnit() { return 1.0; }
#endif
