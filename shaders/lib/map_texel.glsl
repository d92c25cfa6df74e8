// SPDX-License-Identifier: MIT
// Step 5: what a cache of the light map has gathered goes to all texels that hold it, dilation included (PIC 4.7), and
// beside them its irradiance for its own normal, which next frame's surfels read (light_surfels.comp). Needs the bands
// of the light map: runtime/shared/bands.h, CacheBands::onMap().

// Of each cache its first texel, counted from the first cache of the map; then all texels, x and y in 16 bits each.
layout(std430, binding = RELUME_SLOT_MAP_TEXELS) readonly buffer MapTexels { uint mapTexel[]; };
layout(std430, binding = RELUME_SLOT_TEXELS) writeonly buffer Texels { uint texelColor[]; };
layout(binding = RELUME_RESOLVE_UNIT_NORMAL) uniform sampler2D mapNormal;
layout(binding = RELUME_IMAGE_Y, rgba16f) writeonly uniform image2DArray mapY;
layout(binding = RELUME_IMAGE_CO, rgba16f) writeonly uniform image2DArray mapCo;
layout(binding = RELUME_IMAGE_CG, rgba16f) writeonly uniform image2DArray mapCg;

ivec2 mapTexelAt(uint i) { return ivec2(mapTexel[i] & 0xFFFFu, mapTexel[i] >> 16); }

// Word `w` of a cache: its layers of Y, then of Co, then of Cg.
void storeMapWord(ivec2 texel, int w, vec4 v) {
  if (w < RELUME_LUMA_WORDS) imageStore(mapY, ivec3(texel, w), v);
  else if (w < RELUME_LUMA_WORDS + RELUME_CHROMA_WORDS) imageStore(mapCo, ivec3(texel, w - RELUME_LUMA_WORDS), v);
  else imageStore(mapCg, ivec3(texel, w - RELUME_LUMA_WORDS - RELUME_CHROMA_WORDS), v);
}

// colorCaches() of runtime/cpu/light_surfels_kernel.h, from coefficients 0 to 3 of each channel. n: unit, or zero.
vec3 ownIrradiance(vec4 y, vec4 co, vec4 cg, vec3 n) {
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

void storeMapColor(ivec2 texel, uint cache, vec4 y, vec4 co, vec4 cg) {
  vec3 n = texelFetch(mapNormal, texel, 0).xyz;
  float size = length(n);
  if (size > 0.0) n /= size;
  texelColor[uint(texel.y) * relumeMapWidth + uint(texel.x)] = relumePackColor(ownIrradiance(y, co, cg, n), relumeDither(cache));
}
