// SPDX-License-Identifier: MIT
// What moving parts change of a cache's light, as occlude_links.comp leaves it, added to the cache's sums as two cones of
// light: Change::addTo() of runtime/cpu/occlude_links.cpp.
layout(std430, binding = RELUME_SLOT_MOVING_LIGHT) readonly buffer MovingLight { vec4 movingLight[]; };

const float kMostScale = 2.0;  // of a change that was found in other light

// direction: the mean of the cone's
void addCone(vec3 color, vec3 direction) {
  vec4 c[RELUME_LUMA_WORDS];
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) c[w] = vec4(0.0);
  c[0].x = 1.0;
#if RELUME_LUMA_BANDS > 1 && !(RELUME_MAP && RELUME_MAP_IRRADIANCE)
  float size = length(direction);
  if (size > 0.0) {
    // A cone of the same first band: its mean direction is as long as that of the rays.
    float scale[RELUME_LUMA_BANDS];
    relumeConeBandRatios(clamp(2.0 * size - 1.0, -1.0, 1.0), 3.54490770, scale);
    relumeEvaluateSh(direction / size, scale, c);
  }
#endif
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] += color.x * c[w];
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    co[w] += color.y * c[w];
    cg[w] += color.z * c[w];
  }
}

void addChange(uint cache) {
  uint at = RELUME_CHANGE_WORDS * cache;
  vec4 where = movingLight[at + 1u];
  if (where.w == RELUME_CHANGE_NOT_NEAR) return;
  vec4 color = movingLight[at], lamps = movingLight[at + 2u], lampsWhere = movingLight[at + 3u];
  float scale = 1.0;
  // What lamps give does not go with the light that is hidden.
  if (where.w >= 0.0 && color.w > 0.0 && abs(color.x) >= abs(lamps.x))
    scale = min(relumeRgbToYCoCg(relumeUnpackColor(node[uint(where.w)])).x / color.w, kMostScale);
  if (where.w >= 0.0) addCone(scale * color.rgb, where.xyz);
  if (lampsWhere.w > 0.0) addCone(scale * lamps.rgb, lampsWhere.xyz / lampsWhere.w);
}
