// SPDX-License-Identifier: MIT
// Steps 4 and 5: L_SH = sum over links of B_s F_SH (PIC Eq. (3)), for caches of the grid into their buffer, with RELUME_MAP 1
// for those of the light map into its texels. RELUME_LANES threads share a cache: each sums every
// RELUME_LANES-th link, then the sums are added up in shared memory. RELUME_CACHES caches a work group of RELUME_THREADS.
// RELUME_LINK_KIND: what links hold (include/relume/links.h, compact_links.h): coefficients (PIC 4.5), or a cone that is projected
// here (PIC 4.6, Eq. (5), (6)). Repacked links (runtime/shared/link_set.h) are read four at a time; for them, "link" below is
// four of them, which RELUME_NODE_STEPS indices in the row tell the nodes' high halves.
#include "shared/layout.h"
#include "lib/pack.glsl"
#include "lib/color.glsl"
#define RELUME_SH_BANDS RELUME_LUMA_BANDS
#include "lib/sh.glsl"
#include "lib/link_sums.glsl"

#define RELUME_LUMA_WORDS RELUME_SH_WORDS

#ifdef RELUME_VULKAN
layout(constant_id = 0) const uint RELUME_THREADS = 1u;
layout(constant_id = 1) const uint RELUME_CACHES = 1u;
layout(constant_id = 2) const int RELUME_NODE_STEPS = 0;
layout(constant_id = 3) const uint RELUME_LANES = 1u;
layout(constant_id = 4) const uint RELUME_SHARED_CACHES = 1u;
layout(constant_id = 5) const uint RELUME_MOVING = 0u;
#define RELUME_MAY_MOVE 1
layout(local_size_x_id = 0) in;
#else
#define RELUME_MAY_MOVE RELUME_MOVING
layout(local_size_x = RELUME_THREADS) in;
#endif

RELUME_PARAMETERS(RELUME_CACHE_PARAMETERS)

#if RELUME_LINK_KIND == RELUME_LINKS_REPACKED
#define RELUME_ROW_WORDS (1 + (RELUME_NODE_STEPS + 1) / 2)
layout(std430, binding = RELUME_SLOT_LINKS) readonly buffer Links { uvec4 linkWords[]; };
#else
#define RELUME_ROW_WORDS 1
layout(std430, binding = RELUME_SLOT_LINKS) readonly buffer Links { uint linkWord[]; };
#endif
// Of each row its first link, then the indices where nodes step, two a word.
layout(std430, binding = RELUME_SLOT_ROWS) readonly buffer Rows { uint rowWord[]; };
#if RELUME_LINK_KIND != RELUME_LINKS_CONE
layout(std430, binding = RELUME_SLOT_LINK_SHAPE) readonly buffer LinkShape { uint shapeWord[]; };
#endif
layout(std430, binding = RELUME_SLOT_NODES) readonly buffer Nodes { uint node[]; };
#if RELUME_MAP
#include "lib/map_texel.glsl"
#else
layout(std430, binding = RELUME_RESOLVE_SLOT_CACHES) writeonly buffer Caches { uvec2 cacheWord[]; };
#endif

// Of RELUME_SHARED_CACHES caches: those of the group where threads share one, else one that nobody uses.
shared vec4 partial[RELUME_SHARED_CACHES][RELUME_WORDS][RELUME_LANES];

// The sums of this thread.
vec4 y[RELUME_LUMA_WORDS], co[RELUME_CHROMA_WORDS], cg[RELUME_CHROMA_WORDS];

// RELUME_MOVING: parts move before links.
#if RELUME_MAY_MOVE
#include "lib/moving_change.glsl"
#endif

void add(uint sender, inout vec4 c[RELUME_LUMA_WORDS]) {
  vec3 b = relumeRgbToYCoCg(relumeUnpackColor(node[sender]));
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] += b.x * c[w];
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    co[w] += b.y * c[w];
    cg[w] += b.z * c[w];
  }
}

// Cones of up to four bands sum monic polynomials; what they lack of y_l^m and of the ratio of their band, the same for all links,
// is multiplied at the end (runtime/cpu/summed_rows.h).
#define RELUME_MONIC (RELUME_LINK_KIND != RELUME_LINKS_SH && RELUME_LUMA_BANDS <= 4)
#if RELUME_MONIC
const vec4 kMonicScale[4] = vec4[4](vec4(1.0, vec3(0.866025404)), vec4(0.968245837, 1.93649167, 1.67705098, 1.93649167),
                                    vec4(0.968245837, 0.261456256, 0.640434422, 1.01261573),
                                    vec4(0.826797285, 1.01261573, 0.640434422, 0.261456256));

void addCone(uint sender, float f, float cosAlpha, vec3 d) {
  vec3 b = f * relumeRgbToYCoCg(relumeUnpackColor(node[sender]));
  float u = 1.0 + cosAlpha;
#if RELUME_LUMA_BANDS == 1
  y[0].x += b.x;
  co[0].x += b.y;
  cg[0].x += b.z;
#else
  vec4 p[RELUME_LUMA_WORDS];
  p[0] = vec4(1.0, u * d.yzx);
  y[0] += b.x * p[0];
#if RELUME_LUMA_BANDS > 2
  // Bands that chroma lacks have Y in their factor.
  float y2 = RELUME_CHROMA_BANDS > 2 ? b.x : 1.0, y3 = RELUME_CHROMA_BANDS > 3 ? b.x : 1.0;
  float z2 = d.z * d.z, re = d.x * d.x - d.y * d.y, im = 2.0 * d.x * d.y;
  float g = u * cosAlpha * (RELUME_CHROMA_BANDS > 2 ? 1.0 : b.x), gz = g * d.z;
  p[1] = vec4(g * im, gz * d.y, g * (z2 - 1.0 / 3.0), gz * d.x);
  p[2] = vec4(g * re, vec3(0.0));
#if RELUME_LUMA_BANDS > 3
  float h = u * (5.0 * cosAlpha * cosAlpha - 1.0) * (RELUME_CHROMA_BANDS > 3 ? 1.0 : b.x), hz = h * d.z, hq = h * (z2 - 0.2);
  p[2].yzw = vec3(h * (re * d.y + im * d.x), hz * im, hq * d.y);
  p[3] = vec4(hz * (z2 - 0.6), hq * d.x, hz * re, h * (re * d.x - im * d.y));
  y[3] += y3 * p[3];
#endif
  y[1] += y2 * p[1];
  y[2] += vec4(y2, vec3(y3)) * p[2];
#endif
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    co[w] += b.y * p[w];
    cg[w] += b.z * p[w];
  }
#endif
}

#elif RELUME_LINK_KIND != RELUME_LINKS_SH
// f / y_0^0 scales band 0 to f.
void addCone(uint sender, float f, float cosAlpha, vec3 d) {
  float scale[RELUME_LUMA_BANDS];
  relumeConeBandRatios(cosAlpha, f * 3.54490770, scale);
  vec4 c[RELUME_LUMA_WORDS];
  relumeEvaluateSh(d, scale, c);
  add(sender, c);
}
#endif

// addLink(): node and coefficients c_s,i of a link.
#if RELUME_LINK_KIND == RELUME_LINKS_SH
float shCoefficient(uint at) {
  vec2 pair = unpackHalf2x16(shapeWord[at >> 1]);
  return (at & 1u) == 0u ? pair.x : pair.y;
}

void addLink(uint link) {
  vec4 c[RELUME_LUMA_WORDS];
  uint at = relumeHalfOffset + link * relumeShapeStride;
  const uint count = uint(RELUME_LUMA_BANDS * RELUME_LUMA_BANDS);
  for (uint w = 0u; w < uint(RELUME_LUMA_WORDS); ++w) {
    c[w] = vec4(shCoefficient(at + 4u * w), 0.0, 0.0, 0.0);
    // Squares leave one coefficient or none over in the last word.
    if (4u * w + 1u < count) {
      c[w].yzw = vec3(shCoefficient(at + 4u * w + 1u), shCoefficient(at + 4u * w + 2u), shCoefficient(at + 4u * w + 3u));
    }
  }
  add(linkWord[relumeWordOffset + link], c);
}

#elif RELUME_LINK_KIND == RELUME_LINKS_CONE
void addLink(uint link) {
  uint at = relumeWordOffset + 3u * link;
  vec2 transfer = unpackHalf2x16(linkWord[at + 1u]);
  addCone(linkWord[at], transfer.x, transfer.y, relumeUnpackOctahedral(linkWord[at + 2u]));
}

#elif RELUME_LINK_KIND == RELUME_LINKS_REPACKED
// Of this thread's row, the links from which on nodes step.
uint nodeStep[RELUME_NODE_STEPS + 1];

// Four links, the first of which is number `at` of its row.
void addFour(uint four, uint at) {
  uvec4 word = linkWords[(relumeWordOffset >> 2) + four];
  uint transfers = shapeWord[(relumeHalfOffset >> 1) + four];
  // The eight bits of f are bits 6 to 13 of a half.
  uvec2 halves = uvec2((transfers & 0xFFu) << 6 | (transfers & 0xFF00u) << 14, (transfers & 0xFF0000u) >> 10 | (transfers >> 24) << 22);
  vec4 f = vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
  uvec4 sender = word & 0xFFFFu, index = at + uvec4(0u, 1u, 2u, 3u);
  for (int k = 0; k < RELUME_NODE_STEPS; ++k) sender += uvec4(greaterThanEqual(index, uvec4(nodeStep[k]))) << 16;
  for (int i = 0; i < 4; ++i) {
    uint bits = word[i] >> 16;
    addCone(sender[i], f[i], relumeUnpackCone(bits, 12, 4), relumeUnpackDirection(bits, 6));
  }
}

#elif RELUME_LINK_KIND > RELUME_LINKS_CONE
void addLink(uint link) {
  uint head = linkWord[relumeWordOffset + link], sender = head & 0xFFFFFu;
  float f = relumeUnpackTransfer(head);
#if RELUME_LINK_KIND == RELUME_LINKS_IRRADIANCE
  if (relumeFirstLink + link >= relumeGridLinks) {
    vec4 c[RELUME_LUMA_WORDS];
    for (int w = 0; w < RELUME_LUMA_WORDS; ++w) c[w] = vec4(0.0);
    c[0].x = f;
    add(sender, c);
    return;
  }
#endif
#if RELUME_LINK_KIND == RELUME_LINKS_OCT6
  uint at = relumeHalfOffset + link;
  uint bits = (shapeWord[at >> 1] >> (16u * (at & 1u))) & 0xFFFFu;
  addCone(sender, f, relumeUnpackCone(bits, 12, 4), relumeUnpackDirection(bits, 6));
#else
  uint bits = shapeWord[(relumeHalfOffset >> 1) + link];
  addCone(sender, f, relumeUnpackCone(bits, 24, 8), relumeUnpackDirection(bits, 12));
#endif
}
#endif

uvec2 pack(vec4 v) { return uvec2(packHalf2x16(v.xy), packHalf2x16(v.zw)); }

// As pack() rounds it.
vec4 rounded(vec4 v) {
  uvec2 halves = pack(v);
  return vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
}

// Store the sums of a group whose threads share caches. What halves do not hold dims a cache as a whole: coefficients
// that are clipped one by one are another colour from another direction.
void storeShared(uint cache, uint row, uint lane, bool inside) {
  // Add up the lanes, a word each.
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) partial[row][w][lane] = y[w];
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    partial[row][RELUME_LUMA_WORDS + w][lane] = co[w];
    partial[row][RELUME_LUMA_WORDS + RELUME_CHROMA_WORDS + w][lane] = cg[w];
  }
  barrier();
  for (uint w = lane; w < uint(RELUME_WORDS); w += uint(RELUME_LANES)) {
    vec4 sum = vec4(0.0);
    // Start at a lane of one's own: no two threads on one bank of shared memory.
    for (uint k = 0u; k < uint(RELUME_LANES); ++k) sum += partial[row][w][(k + w) % uint(RELUME_LANES)];
    partial[row][w][0] = sum;
  }
  barrier();
  if (!inside) return;
  float largest = 0.0;
  for (int w = 0; w < RELUME_WORDS; ++w) largest = max(largest, relumeLargest(partial[row][w][0]));
  float scale = relumeHalfScale(largest);
#if RELUME_MAP
  uint firstTexel = mapTexel[cache - relumeFirstMapCache], texels = mapTexel[cache - relumeFirstMapCache + 1u] - firstTexel;
  for (uint i = lane; i < texels * uint(RELUME_WORDS); i += uint(RELUME_LANES)) {
    uint w = i % uint(RELUME_WORDS);
    storeMapWord(mapTexelAt(firstTexel + i / uint(RELUME_WORDS)), int(w), rounded(scale * partial[row][w][0]));
  }
  for (uint i = lane; i < texels; i += uint(RELUME_LANES)) {
    storeMapColor(mapTexelAt(firstTexel + i), cache, rounded(scale * partial[row][0][0]),
                  rounded(scale * partial[row][RELUME_LUMA_WORDS][0]),
                  rounded(scale * partial[row][RELUME_LUMA_WORDS + RELUME_CHROMA_WORDS][0]));
  }
#else
  for (uint w = lane; w < uint(RELUME_WORDS); w += uint(RELUME_LANES)) {
    cacheWord[cache * uint(RELUME_WORDS) + w] = pack(scale * partial[row][w][0]);
  }
#endif
}

// Store the sums of a thread that has a cache to itself.
void store(uint cache) {
  float largest = 0.0;
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) largest = max(largest, relumeLargest(y[w]));
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) largest = max(largest, max(relumeLargest(co[w]), relumeLargest(cg[w])));
  float scale = relumeHalfScale(largest);
#if RELUME_MAP
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] = rounded(scale * y[w]);
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    co[w] = rounded(scale * co[w]);
    cg[w] = rounded(scale * cg[w]);
  }
  uint endTexel = mapTexel[cache - relumeFirstMapCache + 1u];
  for (uint i = mapTexel[cache - relumeFirstMapCache]; i < endTexel; ++i) {
    ivec2 texel = mapTexelAt(i);
    for (int w = 0; w < RELUME_LUMA_WORDS; ++w) storeMapWord(texel, w, y[w]);
    for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
      storeMapWord(texel, RELUME_LUMA_WORDS + w, co[w]);
      storeMapWord(texel, RELUME_LUMA_WORDS + RELUME_CHROMA_WORDS + w, cg[w]);
    }
    storeMapColor(texel, cache, y[0], co[0], cg[0]);
  }
#else
  uint first = cache * uint(RELUME_WORDS);
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) cacheWord[first + uint(w)] = pack(scale * y[w]);
  first += uint(RELUME_LUMA_WORDS);
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    cacheWord[first + uint(w)] = pack(scale * co[w]);
    cacheWord[first + uint(RELUME_CHROMA_WORDS + w)] = pack(scale * cg[w]);
  }
#endif
}

void main() {
  uint lane = gl_LocalInvocationID.x % uint(RELUME_LANES), row = gl_LocalInvocationID.x / uint(RELUME_LANES);
  uint cache = relumeFirstCache + gl_WorkGroupID.x * uint(RELUME_CACHES) + row;
  bool inside = cache < relumeEndCache;
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] = vec4(0.0);
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) co[w] = cg[w] = vec4(0.0);
  uint record = cache * uint(RELUME_ROW_WORDS);
  uint end = inside ? rowWord[record + uint(RELUME_ROW_WORDS)] - relumeFirstLink : 0u;
  uint begin = inside ? rowWord[record] - relumeFirstLink : 0u;
#if RELUME_LINK_KIND == RELUME_LINKS_REPACKED
  for (uint k = 0u; inside && k < uint(RELUME_NODE_STEPS); ++k) nodeStep[k] = (rowWord[record + 1u + (k >> 1)] >> (16u * (k & 1u))) & 0xFFFFu;
  for (uint four = begin + lane; four < end; four += uint(RELUME_LANES)) addFour(four, 4u * (four - begin));
#else
  for (uint link = begin + lane; link < end; link += uint(RELUME_LANES)) addLink(link);
#endif
#if RELUME_MONIC
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] *= kMonicScale[w];
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    co[w] *= kMonicScale[w];
    cg[w] *= kMonicScale[w];
  }
#endif
#if RELUME_MAY_MOVE
  if (uint(RELUME_MOVING) != 0u && inside && lane == 0u) addChange(cache);
#endif
  co[RELUME_CHROMA_WORDS - 1] *= kRelumeLastChroma;
  cg[RELUME_CHROMA_WORDS - 1] *= kRelumeLastChroma;

  if (uint(RELUME_LANES) > 1u) storeShared(cache, row, lane, inside);
  else if (inside) store(cache);
}
