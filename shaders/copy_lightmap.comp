// SPDX-License-Identifier: MIT
// Step 5: unique caches to light-map texels, dilation included (PIC 4.7). Texels without a cache get zeros. Beside them the
// irradiance of each texel's cache for its own normal, which next frame's surfels read (light_surfels.comp).
#include "shared/layout.h"
#include "lib/color.glsl"
#include "lib/pack.glsl"

#define RELUME_LUMA_LAYERS ((RELUME_LUMA_BANDS * RELUME_LUMA_BANDS + 3) / 4)
#define RELUME_CHROMA_LAYERS ((RELUME_CHROMA_BANDS * RELUME_CHROMA_BANDS + 3) / 4)

layout(local_size_x = RELUME_COPY_GROUP, local_size_y = RELUME_COPY_GROUP) in;

layout(std430, binding = RELUME_SLOT_MAP_CACHE) readonly buffer MapCache { uint mapCache[]; };
layout(std430, binding = RELUME_RESOLVE_SLOT_CACHES) readonly buffer Caches { uvec2 cacheWord[]; };
layout(std430, binding = RELUME_SLOT_COPY_TEXELS) writeonly buffer Texels { uint texelColor[]; };
layout(binding = RELUME_RESOLVE_UNIT_NORMAL) uniform sampler2D mapNormal;
layout(binding = RELUME_IMAGE_Y, rgba16f) writeonly uniform image2DArray mapY;
layout(binding = RELUME_IMAGE_CO, rgba16f) writeonly uniform image2DArray mapCo;
layout(binding = RELUME_IMAGE_CG, rgba16f) writeonly uniform image2DArray mapCg;

// Irradiance caches have coefficient 0 alone; no receiver reads the last band of an even number past two, of which the
// clamped cosine has nothing.
#if RELUME_MAP_IRRADIANCE
#define RELUME_MAP_LAYERS(bands) 1
#else
#define RELUME_READ_BANDS(bands) ((bands) > 2 && (bands) % 2 == 0 ? (bands) - 1 : (bands))
#define RELUME_MAP_LAYERS(bands) ((RELUME_READ_BANDS(bands) * RELUME_READ_BANDS(bands) + 3) / 4)
#endif

uniform uvec2 relumeMapSize;

vec4 coefficients(bool lit, uint word) {
  if (!lit) return vec4(0.0);
  uvec2 halves = cacheWord[word];
  return vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
}

// colorCaches() of runtime/cpu/light_surfels_kernel.h, from coefficients 0 to 3 of each channel. n: unit, or zero.
vec3 irradiance(vec4 y, vec4 co, vec4 cg, vec3 n) {
#if RELUME_MAP_IRRADIANCE
  vec3 e = 1.77245385 * vec3(y.x, co.x, cg.x);
#elif RELUME_LUMA_BANDS < 2
  // A cache without a normal has gathered the whole sphere, and gives half of that.
  vec3 e = (n != vec3(0.0) ? 1.77245385 : 0.886226925) * vec3(y.x, co.x, cg.x);
#else
  vec3 lobe = 2.04665342 * n.yzx;
  vec3 e = vec3(dot(lobe, y.yzw), 0.0, 0.0);
#if RELUME_CHROMA_BANDS > 1
  e.yz = vec2(dot(lobe, co.yzw), dot(lobe, cg.yzw));
#else
  if (y.x > 0.0) e.yz = e.x * vec2(co.x, cg.x) / y.x;
#endif
#endif
  return max(relumeYCoCgToRgb(e), vec3(0.0));
}

void main() {
  uvec2 texel = gl_GlobalInvocationID.xy;
  if (texel.x >= relumeMapSize.x || texel.y >= relumeMapSize.y) return;
  uint at = texel.y * relumeMapSize.x + texel.x, cache = mapCache[at];
  bool lit = cache != kRelumeNone;
  uint word = cache * uint(RELUME_LUMA_LAYERS + 2 * RELUME_CHROMA_LAYERS);
  vec4 y = coefficients(lit, word);
  imageStore(mapY, ivec3(texel, 0), y);
  for (int layer = 1; layer < RELUME_MAP_LAYERS(RELUME_LUMA_BANDS); ++layer) {
    imageStore(mapY, ivec3(texel, layer), coefficients(lit, word + uint(layer)));
  }
  word += uint(RELUME_LUMA_LAYERS);
  vec4 co = coefficients(lit, word), cg = coefficients(lit, word + uint(RELUME_CHROMA_LAYERS));
  imageStore(mapCo, ivec3(texel, 0), co);
  imageStore(mapCg, ivec3(texel, 0), cg);
  for (int layer = 1; layer < RELUME_MAP_LAYERS(RELUME_CHROMA_BANDS); ++layer) {
    imageStore(mapCo, ivec3(texel, layer), coefficients(lit, word + uint(layer)));
    imageStore(mapCg, ivec3(texel, layer), coefficients(lit, word + uint(RELUME_CHROMA_LAYERS + layer)));
  }
  vec3 n = texelFetch(mapNormal, ivec2(texel), 0).xyz;
  float size = length(n);
  if (size > 0.0) n /= size;
  texelColor[at] = lit ? relumePackColor(irradiance(y, co, cg, n), relumeDither(cache)) : kRelumeNone;
}
