// SPDX-License-Identifier: MIT
// Step 5a: the grid's texture from this frame's caches, in two dispatches. RELUME_FILL_TEXELS 0: irradiance vectors of
// each cache that has a part in it; 1: of each texel the sum over its caches. runtime/cpu/grid_vectors.cpp is the same
// arithmetic; a test runs both.
#include "shared/layout.h"
#include "lib/pack.glsl"

layout(local_size_x = RELUME_FILL_GROUP) in;

#define RELUME_LAYERS(bands) (((bands) * (bands) + 3) / 4)
#define RELUME_LUMA_LAYERS RELUME_LAYERS(RELUME_LUMA_BANDS)
#define RELUME_CHROMA_LAYERS RELUME_LAYERS(RELUME_CHROMA_BANDS)
#define RELUME_CACHE_WORDS (RELUME_LUMA_LAYERS + 2 * RELUME_CHROMA_LAYERS)

RELUME_PARAMETERS(RELUME_FILL_PARAMETERS)

#if RELUME_FILL_TEXELS == 0
layout(std430, binding = RELUME_RESOLVE_SLOT_CACHES) readonly buffer RelumeCaches { uvec2 relumeCache[]; };
// Factors of bands 2 and up (formats/irradiance_vector.h): of axis a and component b, layer by layer.
layout(std430, binding = RELUME_SLOT_FACTORS) readonly buffer RelumeFactors { vec4 relumeFactor[]; };
layout(std430, binding = RELUME_SLOT_VECTORS) writeonly buffer RelumeVectors { vec4 relumeVector[]; };

vec4 relumeCoefficients(uint word) {
  uvec2 halves = relumeCache[word];
  return vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
}

// What bands 2 and up of a channel with so many layers add to the vector of half +a.
vec3 relumeUpper(uint word, int layers, int a) {
  vec3 upper = vec3(0.0);
  for (int layer = 1; layer < layers; ++layer) {
    vec4 c = relumeCoefficients(word + uint(layer));
    for (int b = 0; b < 3; ++b) upper[b] += dot(relumeFactor[(3 * a + b) * RELUME_LUMA_LAYERS + layer], c);
  }
  return upper;
}

// zonalVector() of runtime/cpu/grid_vectors.cpp; c: coefficients 0 to 3.
vec3 relumeZonalVector(vec4 c, int a) {
  vec3 axis = c.wyz;
  float length2 = dot(axis, axis);
  if (!(c.x > 0.0) || !(length2 > 0.0)) return vec3(0.0);
  float size = sqrt(length2), ratio = min(size / c.x, 1.7320508);
  vec3 d = axis / size, v = 6.0 * d[a] * d;
  v[a] -= 3.0 * d[a] * d[a] + 1.0;
  return 0.24770796 * c.x * (0.9474243 * ratio - 0.35) * ratio * v;
}

void main() {
  uint cache = relumeFirst + gl_GlobalInvocationID.x;
  if (cache >= relumeEnd) return;
  uint wordY = cache * uint(RELUME_CACHE_WORDS), wordCo = wordY + uint(RELUME_LUMA_LAYERS), wordCg = wordCo + uint(RELUME_CHROMA_LAYERS);
  vec4 c[3] = vec4[3](relumeCoefficients(wordY), relumeCoefficients(wordCo), relumeCoefficients(wordCg));
#if RELUME_LUMA_BANDS > 1 && RELUME_CHROMA_BANDS == 1
  vec2 follow = c[0].x > 0.0 ? vec2(c[1].x, c[2].x) / c[0].x : vec2(0.0);
#elif RELUME_LUMA_BANDS > 1 && RELUME_CHROMA_BANDS == 2
  float square = dot(c[0], c[0]);
  vec2 follow = square > 0.0 ? vec2(dot(c[0], c[1]), dot(c[0], c[2])) / square : vec2(0.0);
#else
  vec2 follow = vec2(0.0);
#endif
  // Int of y_0 w_a is y_0 pi; of band 1, half of sqrt(4 pi / 3) times the vector.
  const float constant = 0.886226925, linear = 1.0233267;
  for (int a = 0; a < 3; ++a) {
    vec3 even[3] = vec3[3](vec3(0.0), vec3(0.0), vec3(0.0)), odd[3] = even, upper[3] = even;
    for (int k = 0; k < 3; ++k) even[k][a] = constant * c[k].x;
#if RELUME_LUMA_BANDS > 1
    odd[0] = linear * c[0].wyz;
#endif
#if RELUME_CHROMA_BANDS > 1
    odd[1] = linear * c[1].wyz;
    odd[2] = linear * c[2].wyz;
#endif
#if RELUME_LUMA_BANDS == 2
    upper[0] = relumeZonalVector(c[0], a);
#elif RELUME_LUMA_BANDS > 2
    upper[0] = relumeUpper(wordY, RELUME_LUMA_LAYERS, a);
#endif
#if RELUME_CHROMA_BANDS > 2
    upper[1] = relumeUpper(wordCo, RELUME_CHROMA_LAYERS, a);
    upper[2] = relumeUpper(wordCg, RELUME_CHROMA_LAYERS, a);
#else
    for (int k = 1; k < 3; ++k) upper[k] = follow[k - 1] * upper[0];
#endif
#if RELUME_CHROMA_BANDS == 1 && RELUME_LUMA_BANDS > 1
    for (int k = 1; k < 3; ++k) even[k] = follow[k - 1] * even[0], odd[k] = follow[k - 1] * odd[0];
#endif
    for (int k = 0; k < 3; ++k) {
      uint at = 18u * cache + 6u * uint(a) + uint(k);
      relumeVector[at] = vec4(odd[k] + (even[k] + upper[k]), 0.0);
      relumeVector[at + 3u] = vec4(odd[k] - (even[k] + upper[k]), 0.0);
    }
  }
}
#else
// First share of each texel 6 * point + half, then all shares.
layout(std430, binding = RELUME_SLOT_SHARES) readonly buffer RelumeShares { uint relumeShare[]; };
layout(std430, binding = RELUME_SLOT_VECTORS) readonly buffer RelumeVectors { vec4 relumeVector[]; };
layout(rgba16f, binding = RELUME_IMAGE_GRID_VECTORS) uniform writeonly image3D relumeTexels;
layout(rg16f, binding = RELUME_IMAGE_GRID_CHROMA) uniform writeonly image3D relumeTexelChroma;

void main() {
  uint texel = relumeFirst + gl_GlobalInvocationID.x;
  if (texel >= relumeEnd) return;
  uint half_ = texel % 6u, point = texel / 6u;
  vec3 luma = vec3(0.0), co = vec3(0.0), cg = vec3(0.0);
  float known = 0.0;
  uint end = relumeShare[texel + 1u];
  // A texel without shares stays zero.
  if (relumeShare[texel] == end) return;
  for (uint k = relumeShare[texel]; k < end; ++k) {
    uint share = relumeShare[k];
    uint from = 18u * (share & ((1u << kRelumeCacheBits) - 1u)) + 3u * half_;
    float w = float(share >> kRelumeCacheBits) / 1023.0;
    luma += w * relumeVector[from].xyz;
    co += w * relumeVector[from + 1u].xyz;
    cg += w * relumeVector[from + 2u].xyz;
    known += w;
  }
  // Irradiance of chroma for the half's axis.
  vec2 chroma = (half_ & 1u) == 0u ? vec2(co[half_ >> 1], cg[half_ >> 1]) : -vec2(co[half_ >> 1], cg[half_ >> 1]);
  uvec3 at = uvec3(point % relumeResolution.x, point / relumeResolution.x % relumeResolution.y, point / (relumeResolution.x * relumeResolution.y));
  at.z += half_ * (relumeResolution.z + 1u);
  // One factor on all of the texel's light, so that it keeps colour and direction.
  float scale = relumeHalfScale(max(relumeLargest(vec4(luma, 0.0)), relumeLargest(vec4(chroma, 0.0, 0.0))));
  imageStore(relumeTexels, ivec3(at), vec4(scale * luma, known));
  imageStore(relumeTexelChroma, ivec3(at), vec4(scale * chroma, 0.0, 0.0));
}
#endif
