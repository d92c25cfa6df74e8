// SPDX-License-Identifier: MIT
// Step 4 as a fragment pass: L_SH = sum over links of B_s F_SH (PIC Eq. (3)), a cache each, as RELUME_OUTPUTS vectors of four
// coefficients from vector RELUME_FIRST on: Y's, then Co's, then Cg's. RELUME_LINK_KIND as in light_caches.comp.
#include "webgl/lists.glsl"
#include "lib/pack.glsl"
#include "lib/color.glsl"
#define RELUME_SH_BANDS RELUME_LUMA_BANDS
#include "lib/sh.glsl"
#include "lib/link_sums.glsl"

uniform usampler2D relumeRows;       // first link of each cache
uniform usampler2D relumeLinks;      // heads; nodes of SH links; cones, a texel of four words each
uniform usampler2D relumeLinkShape;  // shapes of compact links; coefficients of SH links, halves
uniform usampler2D relumeNodes;      // packed radiosity
uniform uint relumeBegin, relumeEnd;
uniform uint relumeGridLinks;   // irradiance links: how many have a shape
uniform uint relumeShapeStride; // SH links: coefficients of a link

layout(location = 0) out vec4 relumeOut[RELUME_OUTPUTS];

// Links are in rows of 2048.
ivec2 linkTexel(uint link) { return ivec2(int(link & 2047u), int(link >> 11)); }

vec4 sum[RELUME_WORDS];

void add(uint sender, vec4 c[RELUME_SH_WORDS]) {
  vec3 b = relumeRgbToYCoCg(relumeUnpackColor(relumeWord(relumeNodes, sender)));
  for (int w = 0; w < RELUME_SH_WORDS; ++w) sum[w] += b.x * c[w];
  for (int w = 0; w < RELUME_CHROMA_WORDS; ++w) {
    sum[RELUME_SH_WORDS + w] += b.y * c[w];
    sum[RELUME_SH_WORDS + RELUME_CHROMA_WORDS + w] += b.z * c[w];
  }
}

// f / y_0^0 scales band 0 to f.
void addCone(uint sender, float f, float cosAlpha, vec3 d) {
  float scale[RELUME_LUMA_BANDS];
  relumeConeBandRatios(cosAlpha, f * 3.54490770, scale);
  vec4 c[RELUME_SH_WORDS];
  relumeEvaluateSh(d, scale, c);
  add(sender, c);
}

#if RELUME_LINK_KIND == RELUME_LINKS_SH
float shCoefficient(uint at) { return unpackHalf2x16(texelFetch(relumeLinkShape, linkTexel(at), 0).x).x; }

void addLink(uint link) {
  vec4 c[RELUME_SH_WORDS];
  uint at = link * relumeShapeStride;
  const uint count = uint(RELUME_LUMA_BANDS * RELUME_LUMA_BANDS);
  for (uint w = 0u; w < uint(RELUME_SH_WORDS); ++w) {
    c[w] = vec4(shCoefficient(at + 4u * w), 0.0, 0.0, 0.0);
    // Squares leave one coefficient or none over in the last word.
    if (4u * w + 1u < count) {
      c[w].yzw = vec3(shCoefficient(at + 4u * w + 1u), shCoefficient(at + 4u * w + 2u), shCoefficient(at + 4u * w + 3u));
    }
  }
  add(texelFetch(relumeLinks, linkTexel(link), 0).x, c);
}
#elif RELUME_LINK_KIND == RELUME_LINKS_CONE
void addLink(uint link) {
  uvec4 word = texelFetch(relumeLinks, linkTexel(link), 0);
  vec2 transfer = unpackHalf2x16(word.y);
  addCone(word.x, transfer.x, transfer.y, relumeUnpackOctahedral(word.z));
}
#else
void addLink(uint link) {
  uint head = texelFetch(relumeLinks, linkTexel(link), 0).x, sender = head & 0xFFFFFu;
  float f = relumeUnpackTransfer(head);
#if RELUME_LINK_KIND == RELUME_LINKS_IRRADIANCE
  if (link >= relumeGridLinks) {
    vec4 c[RELUME_SH_WORDS];
    for (int w = 0; w < RELUME_SH_WORDS; ++w) c[w] = vec4(0.0);
    c[0].x = f;
    add(sender, c);
    return;
  }
#endif
  uint bits = texelFetch(relumeLinkShape, linkTexel(link), 0).x;
#if RELUME_LINK_KIND == RELUME_LINKS_OCT6
  addCone(sender, f, relumeUnpackCone(bits, 12, 4), relumeUnpackDirection(bits, 6));
#else
  addCone(sender, f, relumeUnpackCone(bits, 24, 8), relumeUnpackDirection(bits, 12));
#endif
}
#endif

void main() {
  uint cache = relumeElement();
  if (cache < relumeBegin || cache >= relumeEnd) discard;
  for (int w = 0; w < RELUME_WORDS; ++w) sum[w] = vec4(0.0);
  uint end = relumeWord(relumeRows, cache + 1u);
  for (uint link = relumeWord(relumeRows, cache); link < end; ++link) addLink(link);
  sum[RELUME_SH_WORDS + RELUME_CHROMA_WORDS - 1] *= kRelumeLastChroma;
  sum[RELUME_WORDS - 1] *= kRelumeLastChroma;
  // Of all vectors of the cache, whichever this pass writes.
  float largest = 0.0;
  for (int w = 0; w < RELUME_WORDS; ++w) largest = max(largest, relumeLargest(sum[w]));
  float scale = relumeHalfScale(largest);
#define RELUME_OUTPUT(i) scale * sum[RELUME_FIRST + i]
#include "webgl/outputs.glsl"
}
