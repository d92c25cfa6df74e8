// SPDX-License-Identifier: MIT
// What a record adds to a pixel: w_k E'_k and w_k (RCS Eqs. (1) to (4), (8)), which are added up by blending. Gradients
// are those of bake/preview/record.h, operation by operation.
#include "shared/layout.h"
#include "lib/splat_weight.glsl"

layout(binding = RELUME_SPLAT_UNIT_LIT) uniform sampler2D relumeLit;
layout(location = RELUME_SPLAT_AT_GRADIENTS) uniform bool gradients;

// For each channel three: vector of reflected light, gradient x; vector of the sky's, gradient y; the sky's gradient, z.
flat in vec4 recordLight[RELUME_SPLAT_LIGHTS];

layout(location = 0) out vec4 reflectedSum;
layout(location = 1) out vec4 skySum;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 offset = texelFetch(relumePlace, pixel, 0).xyz - recordPosition.xyz;
  float w = 0.0, squared;
  vec3 reflected = vec3(0.0), sky = vec3(0.0);
  // Once or never. Most pixels of a box are out of reach, and a software rasteriser computes both sides of a condition,
  // but leaves a loop that none of its pixels is in: a fifth of its time.
  int count = isReached(offset, squared) ? 1 : 0;
  for (int once = 0; once < count; ++once) {
    vec4 facing = texelFetch(relumeFacing, pixel, 0);
    if (facing.xyz == vec3(0.0)) break;
    w = weightOf(offset, squared, facing.xyz, facing.w);
    if (!isPositive(w)) break;
    offset *= recordNormal.w;
    vec3 normal = gradients ? texelFetch(relumeLit, pixel, 0).xyz : recordNormal.xyz;
    for (int c = 0; c < 3; ++c) {
      vec4 x = recordLight[3 * c], y = recordLight[3 * c + 1], z = recordLight[3 * c + 2];
      reflected[c] = dotOf(normal, x.xyz) + dotOf(offset, vec3(x.w, y.w, z.w));
      sky[c] = dotOf(normal, y.xyz) + dotOf(offset, z.xyz);
      // Not max(): light that is no number is none, as on the CPU.
      if (!isPositive(reflected[c])) reflected[c] = 0.0;
      if (!isPositive(sky[c])) sky[c] = 0.0;
    }
  }
  if (!isPositive(w)) discard;
  reflectedSum = vec4(w * reflected, w);
  skySum = vec4(w * sky, 0.0);
}
