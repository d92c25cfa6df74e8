// SPDX-License-Identifier: MIT
// Step 4: L_SH = sum over links of B_s F_SH (PIC Eq. (3)). RELUME_LANES threads share a cache: each sums every
// RELUME_LANES-th link, then the sums are added up in shared memory. RELUME_CACHES caches a work group.
// RELUME_SH_LINKS: links hold coefficients (PIC 4.5); else a cone that is projected here (PIC 4.6, Eq. (5), (6)).
#include "shared/layout.h"
#include "lib/pack.glsl"
#define RELUME_SH_BANDS RELUME_LUMA_BANDS
#include "lib/sh.glsl"

#define RELUME_LUMA (RELUME_LUMA_BANDS * RELUME_LUMA_BANDS)
#define RELUME_CHROMA (RELUME_CHROMA_BANDS * RELUME_CHROMA_BANDS)
#define RELUME_SUMS (RELUME_LUMA + 2 * RELUME_CHROMA)
#define RELUME_LUMA_WORDS ((RELUME_LUMA + 3) / 4)
#define RELUME_CHROMA_WORDS ((RELUME_CHROMA + 3) / 4)
#define RELUME_WORDS (RELUME_LUMA_WORDS + 2 * RELUME_CHROMA_WORDS)

layout(local_size_x = RELUME_LANES, local_size_y = RELUME_CACHES) in;

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

float sums[RELUME_SUMS];

#if RELUME_LANES > 1
shared float partial[RELUME_CACHES][RELUME_SUMS][RELUME_LANES + 1];
#endif

// The link's coefficients c_s,i.
void project(uint link, out uint sender, out float c[RELUME_LUMA]) {
#ifdef RELUME_SH_LINKS
  sender = linkWord[relumeWordOffset + link];
  uint at = relumeHalfOffset + link * relumeShStride;
  for (int i = 0; i < RELUME_LUMA; ++i) {
    uint half_ = at + uint(i);
    vec2 pair = unpackHalf2x16(shWord[half_ >> 1]);
    c[i] = (half_ & 1u) == 0u ? pair.x : pair.y;
  }
#else
  uint at = relumeWordOffset + 3u * link;
  sender = linkWord[at];
  vec2 packed_ = unpackHalf2x16(linkWord[at + 1u]);
  float ratio[RELUME_LUMA_BANDS];
  relumeConeBandRatios(packed_.y, ratio);
  relumeEvaluateSh(relumeUnpackOctahedral(linkWord[at + 2u]), c);
  // f / y_0^0 scales band 0 to f.
  float scale = packed_.x * 3.54490770;
  for (int i = 0; i < RELUME_LUMA; ++i) c[i] *= scale * ratio[kRelumeBandOf[i]];
#endif
}

// The sum number i of the cache of this thread, over all lanes.
float total(int i) {
#if RELUME_LANES > 1
  return partial[gl_LocalInvocationID.y][i][0];
#else
  return sums[i];
#endif
}

uvec2 pack(int first, int count, int word) {
  vec4 v = vec4(0.0);
  for (int k = 0; k < 4; ++k) {
    if (4 * word + k < count) v[k] = total(first + 4 * word + k);
  }
  v = clamp(v, -65504.0, 65504.0);
  return uvec2(packHalf2x16(v.xy), packHalf2x16(v.zw));
}

void sumLinks(uint begin, uint end) {
  for (int i = 0; i < RELUME_SUMS; ++i) sums[i] = 0.0;
  for (uint link = begin + gl_LocalInvocationID.x; link < end; link += uint(RELUME_LANES)) {
    uint sender;
    float c[RELUME_LUMA];
    project(link - relumeFirstLink, sender, c);
    vec3 b = relumeUnpackNode(node[sender]);
    for (int i = 0; i < RELUME_LUMA; ++i) sums[i] += b.x * c[i];
    for (int i = 0; i < RELUME_CHROMA; ++i) sums[RELUME_LUMA + i] += b.y * c[i];
    for (int i = 0; i < RELUME_CHROMA; ++i) sums[RELUME_LUMA + RELUME_CHROMA + i] += b.z * c[i];
  }
}

void main() {
  uint cache = relumeFirstCache + gl_WorkGroupID.x * uint(RELUME_CACHES) + gl_LocalInvocationID.y;
  bool inside = cache < relumeEndCache;
  if (inside) sumLinks(rowBegin[cache], rowBegin[cache + 1u]);
#if RELUME_LANES > 1
  uint row = gl_LocalInvocationID.y;
  for (int i = 0; i < RELUME_SUMS; ++i) partial[row][i][gl_LocalInvocationID.x] = inside ? sums[i] : 0.0;
  barrier();
  for (int i = int(gl_LocalInvocationID.x); i < RELUME_SUMS; i += RELUME_LANES) {
    float sum = 0.0;
    for (int lane = 0; lane < RELUME_LANES; ++lane) sum += partial[row][i][lane];
    partial[row][i][0] = sum;
  }
  barrier();
#endif
  if (!inside) return;
  uint out_ = cache * uint(RELUME_WORDS);
#if RELUME_LANES > 1
  for (int w = int(gl_LocalInvocationID.x); w < RELUME_WORDS; w += RELUME_LANES) {
    int channel = w < RELUME_LUMA_WORDS ? 0 : (w < RELUME_LUMA_WORDS + RELUME_CHROMA_WORDS ? 1 : 2);
    int first = channel == 0 ? 0 : RELUME_LUMA + (channel - 1) * RELUME_CHROMA;
    int word = channel == 0 ? w : w - RELUME_LUMA_WORDS - (channel - 1) * RELUME_CHROMA_WORDS;
    cacheWord[out_ + uint(w)] = pack(first, channel == 0 ? RELUME_LUMA : RELUME_CHROMA, word);
  }
#else
  for (int w = 0; w < RELUME_LUMA_WORDS; ++w) cacheWord[out_ + uint(w)] = pack(0, RELUME_LUMA, w);
  out_ += uint(RELUME_LUMA_WORDS);
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    cacheWord[out_ + uint(w)] = pack(RELUME_LUMA, RELUME_CHROMA, w);
    cacheWord[out_ + uint(RELUME_CHROMA_WORDS + w)] = pack(RELUME_LUMA + RELUME_CHROMA, RELUME_CHROMA, w);
  }
#endif
}
