// SPDX-License-Identifier: MIT
// Step 5 as fragment passes, into what hosts resolve with (include/relume/texture_resolve.h). RELUME_GRID 0: RELUME_OUTPUTS layers
// of the light map, from layer RELUME_FIRST on; a texel has the light of its cache. RELUME_GRID 1: the list of the grid's caches,
// RELUME_WORDS texels each.
#include "webgl/lists.glsl"

uniform sampler2DArray relumeCacheLight;  // layer w: vector w of each cache
uniform usampler2D relumeMapCaches;       // of the light map's texels
uniform uint relumeCacheCount;            // of the grid

layout(location = 0) out vec4 relumeOut[RELUME_OUTPUTS];

void main() {
#if RELUME_GRID
  uint element = relumeElement(), cache = element / uint(RELUME_WORDS);
  if (cache >= relumeCacheCount) discard;
  relumeOut[0] = texelFetch(relumeCacheLight, ivec3(relumeTexelOf(cache), int(element % uint(RELUME_WORDS))), 0);
#else
  uint cache = texelFetch(relumeMapCaches, ivec2(gl_FragCoord.xy), 0).x;
  bool none = cache == kRelumeNone;
  ivec2 at = relumeTexelOf(none ? 0u : cache);
#define RELUME_OUTPUT(i) none ? vec4(0.0) : texelFetch(relumeCacheLight, ivec3(at, RELUME_FIRST + i), 0)
#include "webgl/outputs.glsl"
#endif
}
