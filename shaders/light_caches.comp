// SPDX-License-Identifier: MIT
// Step 4: L_SH = sum over links of B_s F_SH (PIC Eq. (3)). RELUME_LANES threads share a cache: each sums every
// RELUME_LANES-th link, then the sums are added up in shared memory. RELUME_CACHES caches a work group of RELUME_THREADS.
// RELUME_SH_LINKS: links hold coefficients (PIC 4.5); else a cone that is projected here (PIC 4.6, Eq. (5), (6)).
#include "shared/layout.h"
#include "lib/pack.glsl"
#define RELUME_SH_BANDS RELUME_LUMA_BANDS
#include "lib/sh.glsl"

#define RELUME_CHROMA_COUNT (RELUME_CHROMA_BANDS * RELUME_CHROMA_BANDS)
#define RELUME_LUMA_WORDS RELUME_SH_WORDS
#define RELUME_CHROMA_WORDS ((RELUME_CHROMA_COUNT + 3) / 4)
#define RELUME_WORDS (RELUME_LUMA_WORDS + 2 * RELUME_CHROMA_WORDS)

layout(local_size_x = RELUME_THREADS) in;

layout(std430, binding = RELUME_SLOT_ROWS) readonly buffer Rows { uint rowBegin[]; };
layout(std430, binding = RELUME_SLOT_LINKS) readonly buffer Links { uint linkWord[]; };
#ifdef RELUME_SH_LINKS
layout(std430, binding = RELUME_SLOT_LINK_SH) readonly buffer LinkSh { uint shWord[]; };
#endif
layout(std430, binding = RELUME_SLOT_NODES) readonly buffer Nodes { uvec2 node[]; };
layout(std430, binding = RELUME_RESOLVE_SLOT_CACHES) writeonly buffer Caches { uvec2 cacheWord[]; };

// A batch: the caches and links that one binding of the link buffers covers.
uniform uint relumeFirstCache;
uniform uint relumeEndCache;
uniform uint relumeFirstLink;   // link at the start of the batch
uniform uint relumeWordOffset;  // its first word in `linkWord`
uniform uint relumeHalfOffset;  // its first half in `shWord`
uniform uint relumeShStride;    // coefficients of an SH link

// Coefficients past the bands of chroma are not stored.
const vec4 kLastChroma = vec4(1.0, RELUME_CHROMA_COUNT % 4 == 1 ? vec3(0.0) : vec3(1.0));

#if RELUME_LANES > 1
shared vec4 partial[RELUME_CACHES][RELUME_WORDS][RELUME_LANES];
#endif

#ifdef RELUME_SH_LINKS
float shCoefficient(uint at) {
  vec2 pair = unpackHalf2x16(shWord[at >> 1]);
  return (at & 1u) == 0u ? pair.x : pair.y;
}
#endif

// The link's coefficients c_s,i.
void project(uint link, out uint sender, out vec4 c[RELUME_LUMA_WORDS]) {
#ifdef RELUME_SH_LINKS
  sender = linkWord[relumeWordOffset + link];
  uint at = relumeHalfOffset + link * relumeShStride;
  const uint count = uint(RELUME_LUMA_BANDS * RELUME_LUMA_BANDS);
  for (uint w = 0u; w < uint(RELUME_LUMA_WORDS); ++w) {
    c[w] = vec4(shCoefficient(at + 4u * w), 0.0, 0.0, 0.0);
    // Squares leave one coefficient or none over in the last word.
    if (4u * w + 1u < count) {
      c[w].yzw = vec3(shCoefficient(at + 4u * w + 1u), shCoefficient(at + 4u * w + 2u), shCoefficient(at + 4u * w + 3u));
    }
  }
#else
  uint at = relumeWordOffset + 3u * link;
  sender = linkWord[at];
  vec2 transfer = unpackHalf2x16(linkWord[at + 1u]);
  float scale[RELUME_LUMA_BANDS];
  // f / y_0^0 scales band 0 to f.
  relumeConeBandRatios(transfer.y, transfer.x * 3.54490770, scale);
  relumeEvaluateSh(relumeUnpackOctahedral(linkWord[at + 2u]), scale, c);
#endif
}

uvec2 pack(vec4 v) {
  v = clamp(v, -65504.0, 65504.0);
  return uvec2(packHalf2x16(v.xy), packHalf2x16(v.zw));
}

void main() {
  uint lane = gl_LocalInvocationID.x % uint(RELUME_LANES), row = gl_LocalInvocationID.x / uint(RELUME_LANES);
  uint cache = relumeFirstCache + gl_WorkGroupID.x * uint(RELUME_CACHES) + row;
  bool inside = cache < relumeEndCache;
  vec4 y[RELUME_LUMA_WORDS], co[RELUME_CHROMA_WORDS], cg[RELUME_CHROMA_WORDS];
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] = vec4(0.0);
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) co[w] = cg[w] = vec4(0.0);
  uint end = inside ? rowBegin[cache + 1u] - relumeFirstLink : 0u;
  uint begin = inside ? rowBegin[cache] - relumeFirstLink + lane : 0u;
  for (uint link = begin; link < end; link += uint(RELUME_LANES)) {
    uint sender;
    vec4 c[RELUME_LUMA_WORDS];
    project(link, sender, c);
    vec3 b = relumeUnpackNode(node[sender]);
    for (int w = 0; w < RELUME_LUMA_WORDS; ++w) y[w] += b.x * c[w];
    for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
      co[w] += b.y * c[w];
      cg[w] += b.z * c[w];
    }
  }
  co[RELUME_CHROMA_WORDS - 1] *= kLastChroma;
  cg[RELUME_CHROMA_WORDS - 1] *= kLastChroma;

  uint first = cache * uint(RELUME_WORDS);
#if RELUME_LANES > 1
  // Add up the lanes, a word each.
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) partial[row][w][lane] = y[w];
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    partial[row][RELUME_LUMA_WORDS + w][lane] = co[w];
    partial[row][RELUME_LUMA_WORDS + RELUME_CHROMA_WORDS + w][lane] = cg[w];
  }
  barrier();
  if (!inside) return;
  for (uint w = lane; w < uint(RELUME_WORDS); w += uint(RELUME_LANES)) {
    vec4 sum = vec4(0.0);
    // Start at a lane of one's own: no two threads on one bank of shared memory.
    for (uint k = 0u; k < uint(RELUME_LANES); ++k) sum += partial[row][w][(k + w) % uint(RELUME_LANES)];
    cacheWord[first + w] = pack(sum);
  }
#else
  if (!inside) return;
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) cacheWord[first + uint(w)] = pack(y[w]);
  first += uint(RELUME_LUMA_WORDS);
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    cacheWord[first + uint(w)] = pack(co[w]);
    cacheWord[first + uint(RELUME_CHROMA_WORDS + w)] = pack(cg[w]);
  }
#endif
}
