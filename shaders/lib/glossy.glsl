// SPDX-License-Identifier: MIT
// Step 6 for glossy receivers: runtime/shared/glossy.h says what is computed; a test runs both. Included by resolve.glsl.
//   vec3 relumeGlossyLightmap(vec2 uv, vec3 r, float exponent)
//   vec3 relumeGlossyGrid(vec3 positionWorld, vec3 n, vec3 r, float exponent)
//   float relumeGlossyExponent(float roughness), float relumeGlossyShare(float roughness): include/relume/glossy.h
// Mean radiance [W/m²/sr] in a cos^exponent lobe about the unit direction r, the reflected one, away from the surface.

float relumeGlossyExponent(float roughness) {
  float alpha2 = roughness * roughness * roughness * roughness;
  return alpha2 * RELUME_MAX_EXPONENT > 0.5 ? clamp(0.5 / alpha2 - 0.5, 1.0, RELUME_MAX_EXPONENT) : RELUME_MAX_EXPONENT;
}

float relumeGlossyShare(float roughness) { return smoothstep(0.4, 0.6, roughness); }

// s_l(n) of cosineLobeFactors(), formats/sh.h.
void relumeGlossyFactors(float exponent, out float s[RELUME_LUMA_BANDS]) {
  float n = relumeFinite(exponent) ? clamp(exponent, 0.0, RELUME_MAX_EXPONENT) : 0.0;
  s[0] = 1.0;
#if RELUME_LUMA_BANDS > 1
  s[1] = (n + 1.0) / (n + 2.0);
#endif
  for (int l = 2; l < RELUME_LUMA_BANDS; ++l) s[l] = s[l - 2] * (n + 2.0 - float(l)) / (n + 1.0 + float(l));
}

// What the lobe has of the half of the sphere whose pole is at `cosine` from its axis, in the bands of the light map.
float relumeShareAbove(float s[RELUME_LUMA_BANDS], float cosine) {
  float c = clamp(cosine, -1.0, 1.0), c2 = c * c, share = 0.5;
#if RELUME_MAP_LUMA_BANDS > 1
  share += 0.75 * s[1] * c;
#endif
#if RELUME_MAP_LUMA_BANDS > 3
  share -= 0.4375 * s[3] * 0.5 * c * (5.0 * c2 - 3.0);
#endif
#if RELUME_MAP_LUMA_BANDS > 5
  share += 0.34375 * s[5] * 0.125 * c * ((63.0 * c2 - 70.0) * c2 + 15.0);
#endif
#if RELUME_MAP_LUMA_BANDS > 7
  share -= 0.29296875 * s[7] * 0.0625 * c * (((429.0 * c2 - 693.0) * c2 + 315.0) * c2 - 35.0);
#endif
  return max(share, 0.25);
}

// Radiance as RGB from its sum in Y, Co, Cg. c: coefficients 0 to 3 of each; upper: Y's light by bands that chroma lacks.
vec3 relumeFinishGlossy(vec3 sum, mat3x4 c, float upper) {
#if RELUME_CHROMA_FOLLOWS
  sum.yz = c[0].x > 0.0 ? sum.x * vec2(c[1].x, c[2].x) / c[0].x : vec2(0.0);
#elif RELUME_CHROMA_BANDS < RELUME_LUMA_BANDS
  float square = dot(c[0], c[0]);
  if (square > 0.0) sum.yz += upper / square * vec2(dot(c[0], c[1]), dot(c[0], c[2]));
#endif
  return max(relumeYCoCgToRgb(sum), vec3(0.0));
}

vec3 relumeGlossyLightmap(vec2 uv, vec3 r, float exponent) {
#if RELUME_MAP_IRRADIANCE
  // Irradiance caches know no direction.
  return relumeIrradianceLightmap(uv, r, r) * 0.318309886;
#else
  if (!relumeFinite(uv.x) || !relumeFinite(uv.y) || !relumeCanShade(r)) return vec3(0.0);
  uv = relumePointInSight(uv);
  vec4 normal = relumeMapNormal(uv);
  if (!(normal.w > 0.0)) return vec3(0.0);
  float s[RELUME_LUMA_BANDS];
  relumeGlossyFactors(exponent, s);
  vec4 lobe[RELUME_LUMA_LAYERS];
  relumeEvaluateSh(r, s, lobe);

  vec4 y0 = relumeMapY(uv, 0);
  vec4 co0 = relumeMapCo(uv, 0);
  vec4 cg0 = relumeMapCg(uv, 0);
  vec3 sum = vec3(dot(lobe[0], y0), dot(lobe[0], co0), dot(lobe[0], cg0));
  float upper = dot(lobe[0] * relumePastChroma(0, RELUME_MAP_CHROMA_BANDS), y0);
  for (int layer = 1; layer < RELUME_LAYERS(RELUME_MAP_LUMA_BANDS); ++layer) {
    vec4 part = lobe[layer] * relumeMapY(uv, layer);
    sum.x += dot(part, vec4(1.0));
    upper += dot(part, relumePastChroma(layer, RELUME_MAP_CHROMA_BANDS));
  }
  for (int layer = 1; layer < RELUME_LAYERS(RELUME_MAP_CHROMA_BANDS); ++layer) {
    sum.y += dot(lobe[layer], relumeMapCo(uv, layer));
    sum.z += dot(lobe[layer], relumeMapCg(uv, layer));
  }
  float size = length(normal.xyz);
  float share = size > 0.0 ? relumeShareAbove(s, dot(normal.xyz, r) / size) : 1.0;
  return relumeFinishGlossy(sum / normal.w, mat3x4(y0, co0, cg0) / normal.w, upper / normal.w) / share;
#endif
}

vec3 relumeGlossyGrid(vec3 positionWorld, vec3 n, vec3 r, float exponent) {
  if (!relumeCanShade(r)) return vec3(0.0);
  float s[RELUME_LUMA_BANDS];
  relumeGlossyFactors(exponent, s);
  vec4 lobe[RELUME_LUMA_LAYERS];
  relumeEvaluateSh(r, s, lobe);
  RelumeGridSum sum = relumeGatherGrid(positionWorld, n, true, lobe);
  return sum.total > 0.0 ? relumeFinishGlossy(sum.e / sum.total, sum.first / sum.total, sum.upper / sum.total) : vec3(0.0);
}
