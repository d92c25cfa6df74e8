// SPDX-License-Identifier: MIT
// Sums of splats into the picture (RCS Eq. (1)): irradiance [W/m²] where a record has a say, and what was there before
// elsewhere.
//
// RELUME_SPLAT_PACKED: reflected light and the sky's together as the bits of floats; in w the pixel's normal, and 127
// where there is light, for shaders that read between pixels.
#include "shared/layout.h"

layout(binding = RELUME_SPLAT_UNIT_SUM) uniform sampler2D relumeSum;
layout(binding = RELUME_SPLAT_UNIT_SUM_SKY) uniform sampler2D relumeSumSky;

#ifdef RELUME_SPLAT_PACKED
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
#ifdef RELUME_SPLAT_PACKED
  light.xyz = floatBitsToUint(sum.xyz / sum.w + sky);
  light.w = packSnorm4x8(vec4(texelFetch(relumeFacing, pixel, 0).xyz, 1.0));
#else
  reflected = vec4(sum.xyz / sum.w, sum.w);
  fromSky = vec4(sky, sum.w);
#endif
}
