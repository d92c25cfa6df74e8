// SPDX-License-Identifier: MIT
// How much of a record a pixel reads (RCS Eqs. (2) to (4)), for fragments of a record's splat: weights are those of
// bake/preview/weights.cpp, operation by operation.

layout(binding = RELUME_SPLAT_UNIT_PLACE) uniform sampler2D relumePlace;
layout(binding = RELUME_SPLAT_UNIT_FACING) uniform sampler2D relumeFacing;
layout(location = RELUME_SPLAT_AT_ACCURACY) uniform float accuracy;
layout(location = RELUME_SPLAT_AT_WEIGHT) uniform int weightKind;
layout(location = RELUME_SPLAT_AT_GUARDED) uniform bool guarded;

flat in vec4 recordPosition;
flat in vec4 recordNormal;
flat in float recordNear;

const float kNear = 4.0, kLeastError = 0.1, kBehind = 0.05;
const float kTabellionAccuracy = 0.15, kTabellionCosine = 0.984808;

// In the order of glm's.
float dotOf(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

// As std::max() has it, of what is no number as well.
float larger(float a, float b) { return a < b ? b : a; }

// By the bits, as drivers may take comparisons with what is no number either way.
bool isPositive(float a) {
  uint bits = floatBitsToUint(a);
  return bits != 0u && bits < 0x7F800000u;
}

// Whether a receiver is within the record's reach. offset [m]: the receiver less p_k; squared [m²]: its length's.
bool isReached(vec3 offset, out float squared) {
  precise float sum = dotOf(offset, offset);
  precise float reach2 = recordPosition.w * recordPosition.w;
  squared = sum;
  return isPositive(recordPosition.w) && squared <= reach2;
}

// Of a receiver that is; 0 where the record has no say.
float weightOf(vec3 offset, float squared, vec3 normal, float occluder) {
  float a = accuracy, reach = recordPosition.w;
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
