// SPDX-License-Identifier: MIT
// What resolve.glsl reads, in textures and plain uniforms: include/relume/texture_resolve.h says what hosts put there.
uniform highp sampler2DArray relumeLightmap;
uniform highp sampler2D relumeGridCaches;
uniform highp sampler2D relumeGridWords;
uniform vec4 relumeGrid[6];
#if RELUME_GRID_TEXTURE
uniform highp sampler3D relumeGridVectors;
uniform highp sampler3D relumeGridChroma;
uniform highp sampler3D relumeGridOpen;

uint relumeOpenBits(ivec3 cell) { return uint(255.0 * texelFetch(relumeGridOpen, cell, 0).x + 0.5); }
#endif

#define RELUME_MAP_LUMA_LAYERS RELUME_LAYERS(RELUME_MAP_LUMA_BANDS)
#define RELUME_MAP_CHROMA_LAYERS RELUME_LAYERS(RELUME_MAP_CHROMA_BANDS)

// Four coefficients of the light map, filtered.
vec4 relumeMapLayer(vec2 uv, int layer) { return textureLod(relumeLightmap, vec3(uv, float(layer)), 0.0); }
vec4 relumeMapY(vec2 uv, int layer) { return relumeMapLayer(uv, layer); }
vec4 relumeMapCo(vec2 uv, int layer) { return relumeMapLayer(uv, RELUME_MAP_LUMA_LAYERS + layer); }
vec4 relumeMapCg(vec2 uv, int layer) { return relumeMapLayer(uv, RELUME_MAP_LUMA_LAYERS + RELUME_MAP_CHROMA_LAYERS + layer); }
ivec2 relumeMapSize() { return textureSize(relumeLightmap, 0).xy; }
vec4 relumeMapNormal(vec2 uv) { return relumeMapLayer(uv, RELUME_MAP_LUMA_LAYERS + 2 * RELUME_MAP_CHROMA_LAYERS); }

// Lists are rows of 1024 texels.
ivec2 relumeTexelOf(uint index) { return ivec2(int(index & 1023u), int(index >> 10)); }

// Four coefficients of a cache of the grid.
vec4 relumeCoefficients(uint word) { return texelFetch(relumeGridCaches, relumeTexelOf(word), 0); }

// A word is the four bytes of a texel, the lowest in red.
uint relumeGridWord(uint word) {
  uvec4 b = uvec4(255.0 * texelFetch(relumeGridWords, relumeTexelOf(word), 0) + 0.5);
  return b.x | b.y << 8 | b.z << 16 | b.w << 24;
}
float relumeDepthByte(uint word, uint byte_) {
  return floor(255.0 * texelFetch(relumeGridWords, relumeTexelOf(word), 0)[byte_] + 0.5);
}

RelumeResolve relumeMakeResolve() {
  RelumeResolve r;
  r.gridOriginWorld = relumeGrid[0].xyz;
  r.gridBricks = relumeGrid[0].w < 0.0 ? kRelumeNone : uint(relumeGrid[0].w);
  r.gridSpacing = relumeGrid[1].xyz;
  r.gridFine = uint(relumeGrid[1].w);
  r.gridResolution = uvec3(relumeGrid[2].xyz);
  r.gridCaches = uint(relumeGrid[2].w);
  r.gridDepthWords = uint(relumeGrid[3].x);
  r.gridDepthUnit = relumeGrid[3].y;
  r.gridFinestSpacing = relumeGrid[3].z;
  r.mapSight = relumeGrid[3].w < 0.0 ? kRelumeNone : uint(relumeGrid[3].w);
  r.gridTextureSpacing = relumeGrid[4].xyz;
  r.gridTextureStep = uint(relumeGrid[4].w);
  r.gridTextureResolution = uvec3(relumeGrid[5].xyz);
  r.unused2 = 0u;
  return r;
}
#define relumeResolve relumeMakeResolve()
