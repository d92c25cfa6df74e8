// SPDX-License-Identifier: MIT
// Sums of splats into the picture (RCS Eq. (1)): irradiance [W/m²] where a record has a say, and what was there before
// elsewhere.
//
// RELUME_SPLAT_PACKED: reflected light and the sky's together as the bits of floats; in w the pixel's normal, and 127
// where there is light, for shaders that read between pixels.
// RELUME_SPLAT_ORDER: what lobes mirror (splat_mirrors.frag), black where that is negative; and the sum of weights.
#include "shared/layout.h"

layout(binding = RELUME_SPLAT_UNIT_SUM) uniform sampler2D relumeSum;
layout(binding = RELUME_SPLAT_UNIT_SUM_SKY) uniform sampler2D relumeSumSky;

#if defined(RELUME_SPLAT_ORDER)
layout(location = 0) out vec4 mirrored;
const float kLeastShare = 0.25;  // of a lobe that must be seen: less is not made up for
#elif defined(RELUME_SPLAT_PACKED)
layout(binding = RELUME_SPLAT_UNIT_FACING) uniform sampler2D relumeFacing;
layout(location = 0) out uvec4 light;
#else
layout(location = 0) out vec4 reflected;
layout(location = 1) out vec4 fromSky;
#endif

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(relumeSum, pixel, 0);
  if (!(sum.w > 0.0)) discard;
  vec3 sky = texelFetch(relumeSumSky, pixel, 0).xyz / sum.w;
#if defined(RELUME_SPLAT_ORDER)
  mirrored = vec4(max(sum.xyz / sum.w / max(sky.x, kLeastShare), vec3(0.0)), sum.w);
#elif defined(RELUME_SPLAT_PACKED)
  light.xyz = floatBitsToUint(sum.xyz / sum.w + sky);
  light.w = packSnorm4x8(vec4(texelFetch(relumeFacing, pixel, 0).xyz, 1.0));
#else
  reflected = vec4(sum.xyz / sum.w, sum.w);
  fromSky = vec4(sky, sum.w);
#endif
}
