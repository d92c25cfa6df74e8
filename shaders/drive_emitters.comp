// SPDX-License-Identifier: MIT
// Before step 2, in frames that drive materials: the emission of a run of emitter entries (include/relume/emitters.h), one
// thread each: baked, a colour, or an image read at the entry's taps; DrivenEmission::radiance() of
// runtime/shared/driven_emission.h, which a test compares.
#include "shared/layout.h"
#include "lib/pack.glsl"

layout(local_size_x = RELUME_SURFEL_GROUP) in;

layout(std430, binding = RELUME_SLOT_EMITTERS) readonly buffer Emitters { RelumeEmitter emitter[]; };
layout(std430, binding = RELUME_SLOT_EMISSION) writeonly buffer Emission { uint emissionColor[]; };

layout(binding = RELUME_UNIT_EMISSION) uniform sampler2D relumeImage;

RELUME_PARAMETERS(RELUME_DRIVE_PARAMETERS)

vec3 imageAt(RelumeEmitter e) {
  vec2 size = vec2(textureSize(relumeImage, 0));
  float level = log2(max(e.tapWidth * sqrt(size.x * size.y), 1.0));
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; ++k) sum += textureLod(relumeImage, relumeUnpackUnorm16x2(e.tap[k]), level).rgb;
  return 0.25 * sum;
}

void main() {
  uint i = relumeFirstEntry + gl_GlobalInvocationID.x;
  if (i >= relumeEndEntry) return;
  RelumeEmitter e = emitter[i];
  vec3 radiance = relumeFactor;
  if (relumeDrivenBy == kRelumeBaked) {
    if (relumeFactor == vec3(1.0)) {
      emissionColor[e.slot] = e.baked;
      return;
    }
    radiance *= relumeUnpackColor(e.baked);
  }
  if (relumeDrivenBy == kRelumeImage) radiance *= imageAt(e);
  // A number that is not finite would never leave the bounces.
  radiance = mix(min(max(radiance, vec3(0.0)), vec3(RELUME_MAX_RADIANCE)), vec3(0.0), isnan(radiance));
  emissionColor[e.slot] = relumePackColor(radiance, relumeDither(i));
}
