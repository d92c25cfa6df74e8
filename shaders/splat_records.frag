// SPDX-License-Identifier: MIT
// What a record adds to a pixel: w_k E'_k and w_k (RCS Eqs. (1) to (4), (8)), which are added up by blending. Weights and
// gradients are those of bake/preview/weights.cpp and record.h, operation by operation.
#include "shared/layout.h"

layout(binding = RELUME_SPLAT_UNIT_PLACE) uniform sampler2D relumePlace;
layout(binding = RELUME_SPLAT_UNIT_FACING) uniform sampler2D relumeFacing;
layout(binding = RELUME_SPLAT_UNIT_LIT) uniform sampler2D relumeLit;
layout(location = RELUME_SPLAT_AT_ACCURACY) uniform float accuracy;
layout(location = RELUME_SPLAT_AT_WEIGHT) uniform int weightKind;
layout(location = RELUME_SPLAT_AT_GUARDED) uniform bool guarded;
layout(location = RELUME_SPLAT_AT_GRADIENTS) uniform bool gradients;

flat in vec4 recordPosition;
flat in vec4 recordNormal;
flat in float recordNear;
// For each channel three: vector of reflected light, gradient x; vector of the sky's, gradient y; the sky's gradient, z.
flat in vec4 recordLight[RELUME_SPLAT_LIGHTS];

layout(location = 0) out vec4 reflectedSum;
layout(location = 1) out vec4 skySum;

const float kNear = 4.0, kLeastError = 0.1, kBehind = 0.05;
const float kTabellionAccuracy = 0.15, kTabellionCosine = 0.984808;

// In the order of glm's.
float dotOf(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

// As std::max() has it, of what is no number as well.
float larger(float a, float b) { return a < b ? b : a; }

// 0 where the record has no say. offset [m]: the receiver less p_k.
float weightOf(vec3 offset, vec3 normal, float occluder) {
  float a = accuracy, reach = recordPosition.w;
  precise float squared = dotOf(offset, offset);
  precise float reach2 = reach * reach;
  if (!(squared <= reach2)) return 0.0;
  precise float turn = larger(0.0, 1.0 - dotOf(normal, recordNormal.xyz));
  precise float accuracy2 = a * a;
  if (turn > accuracy2 && weightKind != RELUME_SPLAT_TABELLION) return 0.0;
  if (guarded) {
    precise float ahead = 0.5 * dotOf(offset, normal + recordNormal.xyz);
    if (ahead < -kBehind * reach / a) return 0.0;
  }
  precise float away = sqrt(squared);
  if (guarded && recordNear > kNear * (away + occluder)) return 0.0;
  if (weightKind == RELUME_SPLAT_TABELLION) {
    float angle = sqrt(turn / (1.0 - kTabellionCosine)) * kTabellionAccuracy / a;
    return larger(0.0, 1.0 - larger(away / reach, angle));
  }
  precise float error = larger(a * away / reach + sqrt(turn), kLeastError * a);
  if (error > a) return 0.0;
  precise float ward = 1.0 / error;
  precise float smoothed = ward - 1.0 / a;
  return weightKind == RELUME_SPLAT_WARD ? ward : smoothed;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 facing = texelFetch(relumeFacing, pixel, 0);
  if (facing.xyz == vec3(0.0)) discard;
  vec3 offset = texelFetch(relumePlace, pixel, 0).xyz - recordPosition.xyz;
  float w = weightOf(offset, facing.xyz, facing.w);
  if (!(w > 0.0)) discard;
  offset *= recordNormal.w;
  vec3 normal = gradients ? texelFetch(relumeLit, pixel, 0).xyz : recordNormal.xyz;
  vec3 reflected, sky;
  for (int c = 0; c < 3; ++c) {
    vec4 x = recordLight[3 * c], y = recordLight[3 * c + 1], z = recordLight[3 * c + 2];
    reflected[c] = dotOf(normal, x.xyz) + dotOf(offset, vec3(x.w, y.w, z.w));
    sky[c] = dotOf(normal, y.xyz) + dotOf(offset, z.xyz);
  }
  // Not max(): light that is no number is none, as on the CPU.
  for (int c = 0; c < 3; ++c) {
    if (!(reflected[c] > 0.0)) reflected[c] = 0.0;
    if (!(sky[c] > 0.0)) sky[c] = 0.0;
  }
  reflectedSum = vec4(w * reflected, w);
  skySum = vec4(w * sky, 0.0);
}
