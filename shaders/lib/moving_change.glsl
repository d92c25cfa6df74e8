// SPDX-License-Identifier: MIT
// What moving parts change of a cache's light, as occlude_links.comp leaves it, added to the cache's sums as one cone of
// light: Change::addTo() of runtime/cpu/occlude_links.cpp.
layout(std430, binding = RELUME_SLOT_MOVING_LIGHT) readonly buffer MovingLight { vec4 movingLight[]; };

const float kMostScale = 2.0;  // of a change that was found in other light

void addChange(uint cache) {
  vec4 where = movingLight[2u * cache + 1u];
  if (where.w < 0.0) return;
  vec4 color = movingLight[2u * cache];
  if (color.w > 0.0) color.rgb *= min(relumeRgbToYCoCg(relumeUnpackColor(node[uint(where.w)])).x / color.w, kMostScale);
  vec4 c[RELUME_LUMA_WORDS];
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) c[w] = vec4(0.0);
  c[0].x = 1.0;
#if RELUME_LUMA_BANDS > 1 && !(RELUME_MAP && RELUME_MAP_IRRADIANCE)
  float size = length(where.xyz);
  if (size > 0.0) {
    // A cone of the same first band: its mean direction is as long as that of the rays.
    float scale[RELUME_LUMA_BANDS];
    relumeConeBandRatios(clamp(2.0 * size - 1.0, -1.0, 1.0), 3.54490770, scale);
    relumeEvaluateSh(where.xyz / size, scale, c);
  }
#endif
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] += color.x * c[w];
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    co[w] += color.y * c[w];
    cg[w] += color.z * c[w];
  }
}
