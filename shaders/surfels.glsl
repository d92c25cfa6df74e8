// SPDX-License-Identifier: MIT
// Surfels for a compute shader of the host's that lights them itself (GlResolve::surfelGlsl()): one invocation per slot
// i < relumeSurfelSlots, which writes what arrives at it. Some slots are padding: what is written there is not read.
#include "shared/layout.h"
#include "lib/pack.glsl"

layout(std430, RELUME_AT(RELUME_SURFELS_SET, RELUME_SURFELS_SLOT_WORDS)) readonly buffer RelumeSurfelWords { uvec4 relumeSurfelWord[]; };
layout(std430, RELUME_AT(RELUME_SURFELS_SET, RELUME_SURFELS_SLOT_LIGHT)) writeonly buffer RelumeSurfelLight { vec4 relumeSurfelLight[]; };

#ifdef RELUME_VULKAN
// Of the level, so that a shader can be compiled before there is one.
layout(std140, RELUME_AT(RELUME_SURFELS_SET, RELUME_SURFELS_SLOT_UNIFORMS)) uniform RelumeSurfelsBlock { RelumeSurfels relumeSurfels; };
#define relumeSurfelSlots relumeSurfels.slots
#define RELUME_SURFEL_ORIGIN relumeSurfels.origin
#define RELUME_SURFEL_STEP relumeSurfels.step_
#define RELUME_SURFEL_RADIUS relumeSurfels.radius
#else
const uint relumeSurfelSlots = RELUME_SURFEL_SLOTS;
#endif

// [m] world
vec3 relumeSurfelPosition(uint i) {
  uvec4 word = relumeSurfelWord[i];
  return RELUME_SURFEL_ORIGIN + RELUME_SURFEL_STEP * vec3(word.x & 0xFFFFu, word.x >> 16, word.y & 0xFFFFu);
}

// unit
vec3 relumeSurfelNormal(uint i) { return relumeUnpackDirection(relumeSurfelWord[i].z, 12); }

// [m] of a disc of the surfel's area; the same for all
float relumeSurfelRadius(uint i) { return RELUME_SURFEL_RADIUS; }

// Direct irradiance [W/m²], shadows included. Negative numbers and those that are not finite count as 0.
void relumeSetSurfelIrradiance(uint i, vec3 irradiance) { relumeSurfelLight[i] = vec4(irradiance, 0.0); }
