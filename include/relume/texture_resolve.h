// SPDX-License-Identifier: MIT
// Step 6 by textures and plain uniforms alone, for hosts that cannot bind storage buffers: engines, OpenGL 3.3, OpenGL
// ES 3.0, WebGL 2. Works with either backend, on any graphics API that takes its texels. See
// Relighter::textureResolve(), textureResolveGlsl() and writeResolveTexture(). The light is that of GlResolve::glsl(),
// to the rounding of halves.
#pragma once

#include "relume/vectors.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

// OpenGL's GL_RGBA16F, GL_RG16F, GL_RGBA8, GL_R8. None is sRGB, and none may be compressed.
enum class TexelFormat : std::uint8_t { rgba16f, rg16f, rgba8, r8 };
enum class TextureShape : std::uint8_t { flat, array, volume };

// A texture of one mip level, clamped to its edges.
struct ResolveTexture {
  const char* sampler = "";                 // uniform of the GLSL that reads it; lives as long as the program
  TextureShape shape = TextureShape::flat;  // sampler2D, sampler2DArray, sampler3D
  TexelFormat format = TexelFormat::rgba16f;
  glm::uvec3 size{1};       // [texel] z: layers of an array, depth of a volume
  bool isFiltered = false;  // linear; else nearest
  bool isLight = false;     // to be written anew after each relight(); else once
  std::size_t bytes = 0;    // of its texels, without padding: rows from v = 0 on, then layers
};

struct TextureResolve {
  // relumeLightmap: an array of RGBA16F, four coefficients a layer, Y, then Co, then Cg, then the normal of the texel's
  //   cache with w = 1 where there is one.
  // relumeGridCaches: RGBA16F, four coefficients a texel, of the grid's caches.
  // relumeGridWords: RGBA8, the grid's caches, bricks and depths, and the light map's sight (Lightmap::sight).
  // With RelightOptions::gridTexture, where it came to be, relumeGridVectors, relumeGridChroma and relumeGridOpen:
  //   volumes of RGBA16F, RG16F and R8.
  std::vector<ResolveTexture> textures;
  std::array<glm::vec4, 6> grid{};  // uniform vec4 relumeGrid[6]: where the grid is and how it is laid out
};

}  // namespace relume
