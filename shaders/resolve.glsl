// SPDX-License-Identifier: MIT
// Step 6, for the host's shaders: irradiance [W/m²] by indirect light at a receiver (PIC 3.2). runtime/cpu/resolve.h says
// what is computed; a test runs both.
//   vec3 relumeIrradianceLightmap(vec2 uv, vec3 n)            uv of Lightmap::cornerUv, front or back set
//   vec3 relumeIrradianceLightmap(vec2 uv, vec3 n, vec3 geometricNormal)
//   vec3 relumeIrradianceGrid(vec3 positionWorld, vec3 n)
// n is the unit shading normal, geometricNormal that of the triangle, on the viewer's side. Multiply by albedo / pi for reflected radiance. Needs RELUME_LUMA_BANDS and
// RELUME_CHROMA_BANDS, which Relighter::resolveGlsl() defines.
#include "shared/layout.h"
#define RELUME_SH_BANDS RELUME_LUMA_BANDS
#include "lib/sh.glsl"
#include "lib/color.glsl"

#define RELUME_LUMA_LAYERS ((RELUME_LUMA_BANDS * RELUME_LUMA_BANDS + 3) / 4)
#define RELUME_CHROMA_LAYERS ((RELUME_CHROMA_BANDS * RELUME_CHROMA_BANDS + 3) / 4)
#define RELUME_CACHE_WORDS (RELUME_LUMA_LAYERS + 2 * RELUME_CHROMA_LAYERS)
// One chroma band beside more luma bands: chroma follows luma's lobe.
#define RELUME_CHROMA_FOLLOWS (RELUME_CHROMA_BANDS == 1 && RELUME_LUMA_BANDS > 1)

layout(binding = RELUME_RESOLVE_UNIT_Y) uniform sampler2DArray relumeLightmapY;
layout(binding = RELUME_RESOLVE_UNIT_CO) uniform sampler2DArray relumeLightmapCo;
layout(binding = RELUME_RESOLVE_UNIT_CG) uniform sampler2DArray relumeLightmapCg;
layout(binding = RELUME_RESOLVE_UNIT_NORMAL) uniform sampler2D relumeLightmapNormal;
layout(std430, binding = RELUME_RESOLVE_SLOT_CACHES) readonly buffer RelumeCaches { uvec2 relumeCache[]; };
layout(std430, binding = RELUME_RESOLVE_SLOT_GRID) readonly buffer RelumeGrid { uint relumeGridCache[]; };
layout(std140, binding = RELUME_RESOLVE_SLOT_UNIFORMS) uniform RelumeResolveBlock { RelumeResolve relumeResolve; };

// Factors of the linear (x) and the clamped form (y) at a surface cache: formats/sh.h, surfaceLobe().
vec2 relumeSurfaceLobe(float cosine, float geometricCosine) {
  float blend = smoothstep(0.85, 0.99, cosine);
  return vec2(blend / max(geometricCosine, 0.85), (1.0 - blend) * 2.0 / (1.0 + max(geometricCosine, 0.0)));
}

// The receiver's lobe, four coefficients a vector; share: relumeSurfaceLobe().
void relumeMakeLobe(vec3 n, vec2 share, float single, out vec4 lobe[RELUME_LUMA_LAYERS]) {
  float scale[RELUME_LUMA_BANDS];
  for (int l = 0; l < RELUME_LUMA_BANDS; ++l) scale[l] = share.y * kRelumeCosine[l];
  relumeEvaluateSh(n, scale, lobe);
#if RELUME_LUMA_BANDS == 1
  lobe[0].x *= single;
#else
  // 4 pi / 3 times y_1.
  lobe[0].yzw += share.x * 2.04665342 * n.yzx;
#endif
}

vec3 relumeFinish(vec3 e, vec3 constant) {
#if RELUME_CHROMA_FOLLOWS
  e.yz = constant.x > 0.0 ? e.x * constant.yz / constant.x : vec2(0.0);
#endif
  return max(relumeYCoCgToRgb(e), vec3(0.0));
}

vec3 relumeIrradianceLightmap(vec2 uv, vec3 n, vec3 geometricNormal) {
  // The filtered w is the share of texels that have a cache: dividing by it leaves the others out.
  vec4 normal = textureLod(relumeLightmapNormal, uv, 0.0);
  if (!(normal.w > 0.0)) return vec3(0.0);
  float size = length(normal.xyz);
  vec3 cacheNormal = size > 0.0 ? normal.xyz / size : vec3(0.0);
#if RELUME_LUMA_BANDS < 2
  vec2 share = vec2(0.0, 1.0);
#elif RELUME_MAP_IRRADIANCE
  // Irradiance caches answer for their own normal whatever the receiver's: (2 pi y_0) times coefficient 0.
  vec2 share = vec2(0.0, 2.0);
#else
  vec2 share = relumeSurfaceLobe(dot(n, cacheNormal), dot(geometricNormal, cacheNormal));
#endif
  vec4 lobe[RELUME_LUMA_LAYERS];
  relumeMakeLobe(n, share, 1.0 + dot(cacheNormal, cacheNormal), lobe);

  vec4 y0 = textureLod(relumeLightmapY, vec3(uv, 0.0), 0.0);
  vec4 co0 = textureLod(relumeLightmapCo, vec3(uv, 0.0), 0.0);
  vec4 cg0 = textureLod(relumeLightmapCg, vec3(uv, 0.0), 0.0);
  vec3 e = vec3(dot(lobe[0], y0), dot(lobe[0], co0), dot(lobe[0], cg0));
#if !RELUME_MAP_IRRADIANCE
  if (share.y > 0.0) {
    for (int layer = 1; layer < RELUME_LUMA_LAYERS; ++layer) {
      e.x += dot(lobe[layer], textureLod(relumeLightmapY, vec3(uv, float(layer)), 0.0));
    }
    for (int layer = 1; layer < RELUME_CHROMA_LAYERS; ++layer) {
      e.y += dot(lobe[layer], textureLod(relumeLightmapCo, vec3(uv, float(layer)), 0.0));
      e.z += dot(lobe[layer], textureLod(relumeLightmapCg, vec3(uv, float(layer)), 0.0));
    }
  }
#endif
  return relumeFinish(e / normal.w, vec3(y0.x, co0.x, cg0.x));
}

vec3 relumeIrradianceLightmap(vec2 uv, vec3 n) { return relumeIrradianceLightmap(uv, n, n); }

vec4 relumeCoefficients(uint word) {
  uvec2 halves = relumeCache[word];
  return vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
}

vec3 relumeIrradianceGrid(vec3 positionWorld, vec3 n) {
  uvec3 r = relumeResolve.gridResolution;
  if (r.x == 0u || r.y == 0u || r.z == 0u) return vec3(0.0);
  vec3 spacing = max(relumeResolve.gridSpacing, vec3(1e-20));
  vec3 p = min(max((positionWorld - relumeResolve.gridOriginWorld) / spacing, vec3(0.0)), vec3(r - 1u));
  uvec3 base = uvec3(p);
  vec3 f = p - vec3(base);
  vec4 lobe[RELUME_LUMA_LAYERS];
  relumeMakeLobe(n, vec2(0.0, 1.0), 1.0, lobe);

  vec3 e = vec3(0.0), constant = vec3(0.0);
  float total = 0.0;
  for (uint corner = 0u; corner < 8u; ++corner) {
    uvec3 offset = uvec3(corner & 1u, (corner >> 1) & 1u, corner >> 2);
    uvec3 at = min(base + offset, r - 1u);
    vec3 share = mix(1.0 - f, f, vec3(offset));
    uint cache = relumeGridCache[(at.z * r.y + at.y) * r.x + at.x];
    float w = share.x * share.y * share.z;
    if (cache == kRelumeNone || !(w > 0.0)) continue;
    // Wrap weight: a point behind the receiver's plane sees what the receiver does not.
    vec3 toward = relumeResolve.gridOriginWorld + vec3(at) * relumeResolve.gridSpacing - positionWorld;
    float d = length(toward);
    float wrap = max(0.05, 0.5 + 0.5 * (d > 0.0 ? dot(toward, n) / d : 1.0));
    w *= wrap * wrap;
    total += w;
    uint word = cache * uint(RELUME_CACHE_WORDS);
    for (int layer = 0; layer < RELUME_LUMA_LAYERS; ++layer) {
      vec4 c = relumeCoefficients(word + uint(layer));
      e.x += w * dot(lobe[layer], c);
      if (layer == 0) constant.x += w * c.x;
    }
    word += uint(RELUME_LUMA_LAYERS);
    for (int layer = 0; layer < RELUME_CHROMA_LAYERS; ++layer) {
      vec4 co = relumeCoefficients(word + uint(layer));
      vec4 cg = relumeCoefficients(word + uint(RELUME_CHROMA_LAYERS + layer));
      e.yz += w * vec2(dot(lobe[layer], co), dot(lobe[layer], cg));
      if (layer == 0) constant.yz += w * vec2(co.x, cg.x);
    }
  }
  return total > 0.0 ? relumeFinish(e / total, constant) : vec3(0.0);
}
