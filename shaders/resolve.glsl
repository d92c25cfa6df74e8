// SPDX-License-Identifier: MIT
// Step 6, for the host's shaders: irradiance [W/m²] by indirect light at a receiver (PIC 3.2). runtime/shared/resolve.h says
// what is computed; a test runs both.
//   vec3 relumeIrradianceLightmap(vec2 uv, vec3 n)            uv of Lightmap::cornerUv, front or back set
//   vec3 relumeIrradianceLightmap(vec2 uv, vec3 n, vec3 geometricNormal)
//   vec3 relumeIrradianceGrid(vec3 positionWorld, vec3 n)
//   vec3 relumeIrradianceGridTexture(vec3 positionWorld, vec3 n), relumeIrradianceGridSmooth(): lib/grid_texture.glsl
// and the glossy light of lib/glossy.glsl.
// n is the unit shading normal, geometricNormal that of the triangle, on the viewer's side. Multiply by albedo / pi for
// reflected radiance. Needs RELUME_LUMA_BANDS and RELUME_CHROMA_BANDS, which Relighter::resolveGlsl() defines.
#ifdef GL_ES
precision highp float;
precision highp int;
#endif
#include "shared/layout.h"
#define RELUME_SH_BANDS RELUME_LUMA_BANDS
#include "lib/sh.glsl"
#include "lib/color.glsl"

#define RELUME_LAYERS(bands) (((bands) * (bands) + 3) / 4)
#define RELUME_LUMA_LAYERS RELUME_LAYERS(RELUME_LUMA_BANDS)
#define RELUME_CHROMA_LAYERS RELUME_LAYERS(RELUME_CHROMA_BANDS)
#define RELUME_CACHE_WORDS (RELUME_LUMA_LAYERS + 2 * RELUME_CHROMA_LAYERS)
// Layers that the clamped cosine needs: its bands 3, 5 and 7 are zero.
#define RELUME_LAYER_USED(layer) ((layer) != 3 && (layer) != 7 && (layer) != 8 && (layer) < 13)
// One chroma band beside more luma bands: chroma follows luma's lobe.
#define RELUME_CHROMA_FOLLOWS (RELUME_CHROMA_BANDS == 1 && RELUME_LUMA_BANDS > 1)
// RELUME_GUESS_BANDS: guess what two bands lack (runtime/shared/resolve.h). Bounces do without.
#ifndef RELUME_GUESS_BANDS
#define RELUME_GUESS_BANDS 0
#endif
// RELUME_RESOLVE_TEXTURES: by textures and plain uniforms alone, in any GLSL from 3.30 and ES 3.00 on.
#ifndef RELUME_RESOLVE_TEXTURES
#define RELUME_RESOLVE_TEXTURES 0
#endif
// RELUME_MAP_SIGHT: read the light map on the receiver's side of walls. Surfels are baked there.
#ifndef RELUME_MAP_SIGHT
#define RELUME_MAP_SIGHT 0
#endif
// RELUME_GLOSSY: with what glossy receivers call.
#ifndef RELUME_GLOSSY
#define RELUME_GLOSSY 0
#endif

// Where the light is read from: relumeMapY(), relumeMapCo(), relumeMapCg(), relumeMapNormal(), relumeMapSize(),
// relumeCoefficients(), relumeGridWord(), relumeDepthByte(), relumeResolve.
#if RELUME_RESOLVE_TEXTURES
#include "lib/resolve_textures.glsl"
#else
#include "lib/resolve_buffers.glsl"
#endif

// Receivers that are read for, as in runtime/cpu/resolve.h; by bits, for GLSL may take it that nothing is NaN.
bool relumeFinite(float v) { return (floatBitsToUint(v) & 0x7F800000u) != 0x7F800000u; }
bool relumeFinite(vec3 v) { return relumeFinite(v.x) && relumeFinite(v.y) && relumeFinite(v.z); }
bool relumeCanShade(vec3 n) { return relumeFinite(n) && dot(n, n) <= RELUME_MAX_NORMAL2; }

// Factors of the linear (x) and the clamped form (y) at a surface cache: formats/sh.h, surfaceLobe().
vec2 relumeSurfaceLobe(float cosine, float geometricCosine) {
  float blend = smoothstep(0.95, 0.995, cosine);
  return vec2(blend / max(geometricCosine, 0.95), (1.0 - blend) * 2.0 / (1.0 + max(geometricCosine, 0.0)));
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

// zonalIrradiance() of formats/sh.h; c: coefficients 0 to 3.
float relumeZonalIrradiance(vec4 c, vec3 n) {
  vec3 axis = c.wyz;
  float length2 = dot(axis, axis);
  if (!(c.x > 0.0) || !(length2 > 0.0)) return 0.0;
  float ratio = min(sqrt(length2) / c.x, 1.7320508);
  float zonal = c.x * (0.9474243 * ratio - 0.35) * ratio;
  float cosine = dot(axis, n);
  return 0.24770796 * zonal * (3.0 * min(cosine * cosine / length2, 1.0) - 1.0);
}

// Irradiance as RGB from its sum e in Y, Co, Cg. c: coefficients 0 to 3 of each; upper: Y's light by bands 2 and up;
// clamped: share of the clamped form.
vec3 relumeFinish(vec3 e, mat3x4 c, float upper, vec3 n, float clamped) {
#if RELUME_GUESS_BANDS && RELUME_LUMA_BANDS == 2
  upper = clamped > 0.0 ? clamped * relumeZonalIrradiance(c[0], n) : 0.0;
  e.x += upper;
#endif
#if RELUME_GUESS_BANDS && RELUME_CHROMA_BANDS == 2
  float square = dot(c[0], c[0]);
  if (clamped > 0.0 && square > 0.0) e.yz += upper / square * vec2(dot(c[0], c[1]), dot(c[0], c[2]));
#endif
#if RELUME_CHROMA_FOLLOWS
  e.yz = c[0].x > 0.0 ? e.x * vec2(c[1].x, c[2].x) / c[0].x : vec2(0.0);
#endif
  return max(relumeYCoCgToRgb(e), vec3(0.0));
}

// Where a receiver at a finite point of the map reads it: pointInSight() of runtime/shared/stencil.h; the words are those
// of formats/map_sight.h.
vec2 relumePointInSight(vec2 uv) {
#if RELUME_MAP_SIGHT
  uint first = relumeResolve.mapSight;
  if (first == kRelumeNone) return uv;
  ivec2 size = relumeMapSize();
  vec2 p = clamp(uv * vec2(size) - 0.5, vec2(0.0), vec2(size - 1));
  ivec2 low = ivec2(p);
  uint word = relumeGridWord(first + uint(low.y * size.x + low.x));
  if ((word >> 24) == 0u) return uv;
  vec2 f = p - vec2(low);
  ivec3 line = ivec3(int(word << 24), int(word << 16), int(word << 8)) >> 24;
  bool isBeyond = dot(vec2(line.xy), f - 0.5) > float(line.z);
  if (line.z == -128) {
    bvec2 isAbove = equal(greaterThan(f, 0.5 + vec2(line.xy >> 1) / 127.0), equal(line.xy & 1, ivec2(0)));
    isBeyond = all(isAbove);
  }
  uint moves = word >> (isBeyond ? 28u : 24u);
  uvec2 move = uvec2(moves, moves >> 2) & 3u;
  if (move.x != 0u) f.x = float(move.x - 1u);
  if (move.y != 0u) f.y = float(move.y - 1u);
  return (vec2(low) + f + 0.5) / vec2(size);
#else
  return uv;
#endif
}

vec3 relumeIrradianceLightmap(vec2 uv, vec3 n, vec3 geometricNormal) {
  if (!relumeFinite(uv.x) || !relumeFinite(uv.y) || !relumeCanShade(n) || !relumeCanShade(geometricNormal)) return vec3(0.0);
  uv = relumePointInSight(uv);
  // The filtered w is the share of texels that have a cache: dividing by it leaves the others out.
  vec4 normal = relumeMapNormal(uv);
  if (!(normal.w > 0.0)) return vec3(0.0);
  vec3 cacheNormal = normal.xyz / normal.w;
#if RELUME_LUMA_BANDS < 2
  vec2 share = vec2(0.0, 1.0);
#elif RELUME_MAP_IRRADIANCE
  // Irradiance caches answer for their own normal whatever the receiver's: (2 pi y_0) times coefficient 0.
  vec2 share = vec2(0.0, 2.0);
#else
  vec2 share = relumeSurfaceLobe(dot(n, cacheNormal), dot(geometricNormal, cacheNormal));
#endif
  vec4 lobe[RELUME_LUMA_LAYERS];
  relumeMakeLobe(n, share, cacheNormal == vec3(0.0) ? 1.0 : 2.0, lobe);

  vec4 y0 = relumeMapY(uv, 0);
  vec4 co0 = relumeMapCo(uv, 0);
  vec4 cg0 = relumeMapCg(uv, 0);
  vec3 e = vec3(dot(lobe[0], y0), dot(lobe[0], co0), dot(lobe[0], cg0));
  float upper = 0.0;
#if !RELUME_MAP_IRRADIANCE
  if (share.y > 0.0) {
    for (int layer = 1; layer < RELUME_LUMA_LAYERS; ++layer) {
      if (!RELUME_LAYER_USED(layer)) continue;
      upper += dot(lobe[layer], relumeMapY(uv, layer));
    }
    e.x += upper;
    for (int layer = 1; layer < RELUME_CHROMA_LAYERS; ++layer) {
      if (!RELUME_LAYER_USED(layer)) continue;
      e.y += dot(lobe[layer], relumeMapCo(uv, layer));
      e.z += dot(lobe[layer], relumeMapCg(uv, layer));
    }
  }
#endif
  mat3x4 c = mat3x4(y0, co0, cg0) / normal.w;
#if RELUME_MAP_IRRADIANCE
  return relumeFinish(e / normal.w, c, 0.0, n, 0.0);
#else
  return relumeFinish(e / normal.w, c, upper / normal.w, n, share.y);
#endif
}

vec3 relumeIrradianceLightmap(vec2 uv, vec3 n) { return relumeIrradianceLightmap(uv, n, n); }

// Node of a depth map: v is its direction, a its position in the quadrant.
float relumeDepthNode(uint map, vec3 v, ivec2 a) {
  const int half_ = kRelumeDepthSide / 2;
  uint node = uint((half_ + (v.y < 0.0 ? -a.y : a.y)) * kRelumeDepthSide + half_ + (v.x < 0.0 ? -a.x : a.x));
  float b = relumeDepthByte(map + (node >> 2), node & 3u);
  return b / (255.0 - min(b, 254.0));
}

// depthWeight() of formats/grid_depth.h. v [m]: from cache to receiver; map: first word of the cache's map.
float relumeDepthWeight(uint map, vec3 v, float spacing) {
  const float half_ = float(kRelumeDepthSide / 2);
  vec3 p = abs(v);
  float l1 = p.x + p.y + p.z;
  if (!(l1 > 0.0)) return 1.0;
  p /= l1;
  vec2 a = half_ * (v.z >= 0.0 ? p.xy : 1.0 - p.yx);
  ivec2 i = min(ivec2(a), ivec2(kRelumeDepthSide / 2 - 1));
  vec2 f = a - vec2(i);
  bool low = f.x + f.y <= 1.0;
  vec3 w = low ? vec3(1.0 - f.x - f.y, f.x, f.y) : vec3(f.x + f.y - 1.0, 1.0 - f.y, 1.0 - f.x);
  float t = w.x * relumeDepthNode(map, v, low ? i : i + 1) + w.y * relumeDepthNode(map, v, i + ivec2(1, 0)) +
            w.z * relumeDepthNode(map, v, i + ivec2(0, 1));
  float s = l1 * t / relumeResolve.gridDepthUnit;
  if (s <= 1.0) return 1.0;
  float behind = length(v) * (1.0 - 1.0 / s) / (0.02 * spacing);
  return exp(-min(0.5 * behind * behind, 40.0));
}

// Weights of a cube's corners at f within it: corners 0-3 and 4-7, bit 0 of a corner is x.
void relumeTrilinear(vec3 f, out vec4 low, out vec4 high) {
  vec3 g = 1.0 - f;
  vec4 xy = vec4(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y);
  low = xy * g.z;
  high = xy * f.z;
}

// 1 for those coefficients of a layer that so many bands of chroma have not.
vec4 relumePastChroma(int layer, int bands) {
  return step(vec4(float(bands * bands)), float(4 * layer) + vec4(0.0, 1.0, 2.0, 3.0));
}

struct RelumeGridSum {
  vec3 e;
  float upper;   // of e.x, by bands 2 and up; glossy: by bands that chroma lacks
  mat3x4 first;  // coefficients 0 to 3 of Y, Co, Cg
  float total;
};

// Add a cache with weight w. glossy, a constant: the lobe is no clamped cosine, and has all bands. The lobe is inout because Mesa
// 22.3 loses part of an array of one vector that is passed by value.
void relumeAddWeighted(uint cache, float w, bool glossy, inout vec4 lobe[RELUME_LUMA_LAYERS], inout RelumeGridSum sum) {
  sum.total += w;
  uint word = cache * uint(RELUME_CACHE_WORDS);
  for (int layer = 0; layer < RELUME_LUMA_LAYERS; ++layer) {
    if (!glossy && !RELUME_LAYER_USED(layer)) continue;
    vec4 c = w * relumeCoefficients(word + uint(layer));
    float part = dot(lobe[layer], c);
    sum.e.x += part;
    if (layer == 0) sum.first[0] += c;
    if (glossy) sum.upper += dot(lobe[layer] * relumePastChroma(layer, RELUME_CHROMA_BANDS), c);
    else if (layer > 0) sum.upper += part;
  }
  word += uint(RELUME_LUMA_LAYERS);
  for (int layer = 0; layer < RELUME_CHROMA_LAYERS; ++layer) {
    if (!glossy && !RELUME_LAYER_USED(layer)) continue;
    vec4 co = w * relumeCoefficients(word + uint(layer));
    vec4 cg = w * relumeCoefficients(word + uint(RELUME_CHROMA_LAYERS + layer));
    sum.e.yz += vec2(dot(lobe[layer], co), dot(lobe[layer], cg));
    if (layer == 0) sum.first[1] += co, sum.first[2] += cg;
  }
}

// Add a cache of the grid with the weight of its corner: gridStencil() of runtime/shared/stencil.h.
void relumeAddCache(uint cache, float w, vec3 positionWorld, vec3 n, bool glossy, inout vec4 lobe[RELUME_LUMA_LAYERS], inout RelumeGridSum sum) {
  if (cache == kRelumeNone || !(w > 0.0)) return;
  uint record = relumeResolve.gridCaches + cache * (3u + relumeResolve.gridDepthWords);
  vec3 toward = uintBitsToFloat(uvec3(relumeGridWord(record), relumeGridWord(record + 1u), relumeGridWord(record + 2u))) - positionWorld;
  float d = length(toward);
  // Wrap weight: a point behind the receiver's plane sees what the receiver does not.
  float wrap = max(0.05, 0.5 + 0.5 * (d > 0.0 ? dot(toward, n) / d : 1.0));
  w *= wrap * wrap;
  if (relumeResolve.gridDepthWords > 0u) w *= relumeDepthWeight(record + 3u, -toward, relumeResolve.gridFinestSpacing);
  relumeAddWeighted(cache, w, glossy, lobe, sum);
}

// What the lobe has of the caches around a receiver; their weights in total are 0 where there is none.
RelumeGridSum relumeGatherGrid(vec3 positionWorld, vec3 n, bool glossy, inout vec4 lobe[RELUME_LUMA_LAYERS]) {
  RelumeGridSum sum = RelumeGridSum(vec3(0.0), 0.0, mat3x4(0.0), 0.0);
  uvec3 r = relumeResolve.gridResolution;
  if (r.x == 0u || r.y == 0u || r.z == 0u || !relumeFinite(positionWorld) || !relumeCanShade(n)) return sum;
  positionWorld = clamp(positionWorld, vec3(-RELUME_MAX_COORDINATE), vec3(RELUME_MAX_COORDINATE));
  vec3 spacing = max(relumeResolve.gridSpacing, vec3(1e-20));
  uvec3 cells = max(r, uvec3(2u)) - 1u;
  vec3 p = min(max((positionWorld - relumeResolve.gridOriginWorld) / spacing, vec3(0.0)), vec3(r - 1u));
  uvec3 cell = min(uvec3(p), cells - 1u);
  vec3 f = p - vec3(cell);

  // The brick of the cell, whose hanging points hand their weight to the corners of the lattice they lie between.
  uint brick = kRelumeNone;
  if (relumeResolve.gridBricks != kRelumeNone) {
    brick = relumeGridWord(relumeResolve.gridBricks + (cell.z * cells.y + cell.y) * cells.x + cell.x);
  }
  vec4 low, high;
  if (brick == kRelumeNone) {
    relumeTrilinear(f, low, high);
  } else {
    low = high = vec4(0.0);
    uvec3 middle = min(uvec3(2.0 * f), uvec3(1u));
    vec3 inBrick = 2.0 * f - vec3(middle);
    for (uint corner = 0u; corner < 8u; ++corner) {
      uvec3 offset = uvec3(corner & 1u, (corner >> 1) & 1u, corner >> 2), at = middle + offset;
      vec3 part = mix(1.0 - inBrick, inBrick, vec3(offset));
      float w = part.x * part.y * part.z;
      uint cache = relumeGridWord(relumeResolve.gridFine + brick * kRelumeBrickWords + (at.z * 3u + at.y) * 3u + at.x);
      if (cache == kRelumeHanging) {
        vec4 shareLow, shareHigh;
        relumeTrilinear(0.5 * vec3(at), shareLow, shareHigh);
        low += w * shareLow;
        high += w * shareHigh;
      } else {
        relumeAddCache(cache, w, positionWorld, n, glossy, lobe, sum);
      }
    }
  }
  for (uint corner = 0u; corner < 8u; ++corner) {
    uvec3 at = min(cell + uvec3(corner & 1u, (corner >> 1) & 1u, corner >> 2), r - 1u);
    float w = corner < 4u ? low[corner] : high[corner - 4u];
    relumeAddCache(relumeGridWord((at.z * r.y + at.y) * r.x + at.x), w, positionWorld, n, glossy, lobe, sum);
  }
  return sum;
}

vec3 relumeIrradianceGrid(vec3 positionWorld, vec3 n) {
  vec4 lobe[RELUME_LUMA_LAYERS];
  relumeMakeLobe(n, vec2(0.0, 1.0), 1.0, lobe);
  RelumeGridSum sum = relumeGatherGrid(positionWorld, n, false, lobe);
  return sum.total > 0.0 ? relumeFinish(sum.e / sum.total, sum.first / sum.total, sum.upper / sum.total, n, 1.0) : vec3(0.0);
}
#if RELUME_GLOSSY
#include "lib/glossy.glsl"
#endif
// RELUME_GRID_TEXTURE: 1 with the grid's texture, 0 with functions that stand in for it.
#ifdef RELUME_GRID_TEXTURE
#include "lib/grid_texture.glsl"
#endif
