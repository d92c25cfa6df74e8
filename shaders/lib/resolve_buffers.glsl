// SPDX-License-Identifier: MIT
// What resolve.glsl reads, in buffers and textures: slots of shared/layout.h.
layout(RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_UNIT_Y)) uniform sampler2DArray relumeLightmapY;
layout(RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_UNIT_CO)) uniform sampler2DArray relumeLightmapCo;
layout(RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_UNIT_CG)) uniform sampler2DArray relumeLightmapCg;
layout(RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_UNIT_NORMAL)) uniform sampler2D relumeLightmapNormal;
layout(std430, RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_SLOT_CACHES)) readonly buffer RelumeCaches { uvec2 relumeCache[]; };
layout(std430, RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_SLOT_GRID)) readonly buffer RelumeGrid { uint relumeGrid[]; };
layout(std140, RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_SLOT_UNIFORMS)) uniform RelumeResolveBlock { RelumeResolve relumeResolve; };
#if defined(RELUME_GRID_TEXTURE) && RELUME_GRID_TEXTURE
layout(RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_UNIT_GRID_VECTORS)) uniform sampler3D relumeGridVectors;
layout(RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_UNIT_GRID_CHROMA)) uniform sampler3D relumeGridChroma;
layout(RELUME_AT(RELUME_RESOLVE_SET, RELUME_RESOLVE_UNIT_GRID_OPEN)) uniform usampler3D relumeGridOpen;

uint relumeOpenBits(ivec3 cell) { return texelFetch(relumeGridOpen, cell, 0).x; }
#endif

// Four coefficients of the light map, filtered.
vec4 relumeMapY(vec2 uv, int layer) { return textureLod(relumeLightmapY, vec3(uv, float(layer)), 0.0); }
vec4 relumeMapCo(vec2 uv, int layer) { return textureLod(relumeLightmapCo, vec3(uv, float(layer)), 0.0); }
vec4 relumeMapCg(vec2 uv, int layer) { return textureLod(relumeLightmapCg, vec3(uv, float(layer)), 0.0); }
ivec2 relumeMapSize() { return textureSize(relumeLightmapNormal, 0); }
vec4 relumeMapNormal(vec2 uv) { return textureLod(relumeLightmapNormal, uv, 0.0); }

// Four coefficients of a cache of the grid.
vec4 relumeCoefficients(uint word) {
  uvec2 halves = relumeCache[word];
  return vec4(unpackHalf2x16(halves.x), unpackHalf2x16(halves.y));
}

uint relumeGridWord(uint word) { return relumeGrid[word]; }
float relumeDepthByte(uint word, uint byte_) { return float(relumeGrid[word] >> (8u * byte_) & 0xFFu); }
