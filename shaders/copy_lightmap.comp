// SPDX-License-Identifier: MIT
// Step 5: unique caches to light-map texels, dilation included (PIC 4.7). Texels without a cache get zeros.
#include "shared/layout.h"

#define RELUME_LUMA_LAYERS ((RELUME_LUMA_BANDS * RELUME_LUMA_BANDS + 3) / 4)
#define RELUME_CHROMA_LAYERS ((RELUME_CHROMA_BANDS * RELUME_CHROMA_BANDS + 3) / 4)

layout(local_size_x = RELUME_COPY_GROUP, local_size_y = RELUME_COPY_GROUP) in;

layout(std430, binding = RELUME_SLOT_MAP_CACHE) readonly buffer MapCache { uint mapCache[]; };
layout(std430, binding = RELUME_RESOLVE_SLOT_CACHES) readonly buffer Caches { uvec2 cacheWord[]; };
layout(binding = RELUME_IMAGE_Y, rgba16f) writeonly uniform image2DArray mapY;
layout(binding = RELUME_IMAGE_CO, rgba16f) writeonly uniform image2DArray mapCo;
layout(binding = RELUME_IMAGE_CG, rgba16f) writeonly uniform image2DArray mapCg;

// Irradiance caches have coefficient 0 alone.
#if RELUME_MAP_IRRADIANCE
#define RELUME_MAP_LUMA_LAYERS 1
#define RELUME_MAP_CHROMA_LAYERS 1
#else
#define RELUME_MAP_LUMA_LAYERS RELUME_LUMA_LAYERS
#define RELUME_MAP_CHROMA_LAYERS RELUME_CHROMA_LAYERS
#endif

uniform uvec2 relumeMapSize;

vec4 coefficients(bool lit, uint word) {
  if (!lit) return vec4(0.0);
  uvec2 halves = cacheWord[word];
  return vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
}

void main() {
  uvec2 texel = gl_GlobalInvocationID.xy;
  if (texel.x >= relumeMapSize.x || texel.y >= relumeMapSize.y) return;
  uint cache = mapCache[texel.y * relumeMapSize.x + texel.x];
  bool lit = cache != kRelumeNone;
  uint word = cache * uint(RELUME_LUMA_LAYERS + 2 * RELUME_CHROMA_LAYERS);
  for (int layer = 0; layer < RELUME_MAP_LUMA_LAYERS; ++layer) {
    imageStore(mapY, ivec3(texel, layer), coefficients(lit, word + uint(layer)));
  }
  word += uint(RELUME_LUMA_LAYERS);
  for (int layer = 0; layer < RELUME_MAP_CHROMA_LAYERS; ++layer) {
    imageStore(mapCo, ivec3(texel, layer), coefficients(lit, word + uint(layer)));
    imageStore(mapCg, ivec3(texel, layer), coefficients(lit, word + uint(RELUME_CHROMA_LAYERS + layer)));
  }
}
