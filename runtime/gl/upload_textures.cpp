// SPDX-License-Identifier: MIT
// See upload_textures.h.
#include "runtime/gl/upload_textures.h"

#include "formats/irradiance_vector.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace relume::gl {
namespace {

Texture makeTexture(const Functions& gl, GLenum target, GLenum format, GLuint width, GLuint height, int layers) {
  GLuint name = 0;
  gl.GenTextures(1, &name);
  Texture texture(gl, name);
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
  gl.BindTexture(target, name);
  if (target == GL_TEXTURE_2D) {
    gl.TexStorage2D(target, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  } else {
    gl.TexStorage3D(target, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height), layers);
  }
  gl.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
  return texture;
}

// Normal of each texel's cache as signed bytes, w = 1; zeros where there is none.
std::pmr::vector<std::int8_t> packNormals(const Caches& caches, std::pmr::memory_resource* memory) {
  std::pmr::vector<std::int8_t> texels(4 * std::max<std::size_t>(caches.lightmap.cache.size(), 1), 0, memory);
  for (std::size_t i = 0; i < caches.lightmap.cache.size(); ++i) {
    const std::uint32_t cache = caches.lightmap.cache[i];
    if (cache == kNoCache) continue;
    for (int k = 0; k < 3; ++k) {
      const float v = std::clamp(caches.normal[cache][k], -1.0f, 1.0f);
      texels[4 * i + static_cast<std::size_t>(k)] = static_cast<std::int8_t>(std::lrint(127.0f * v));
    }
    texels[4 * i + 3] = 127;
  }
  return texels;
}

// Factors of bands 2 and up as fill_grid_texture.comp reads them, four coefficients a vector.
std::pmr::vector<float> packFactors(int bands, std::pmr::memory_resource* memory) {
  const std::size_t stride = 4 * static_cast<std::size_t>(wordsOf(bands));
  std::pmr::vector<float> packed(9 * stride, 0.0f, memory);
  for (std::size_t row = 0; row < 9; ++row) {
    for (std::size_t i = 4; i < static_cast<std::size_t>(bands * bands); ++i)
      packed[row * stride + i] = vectorFactors()[row * kMaxCoefficients + i];
  }
  return packed;
}

}  // namespace

Status makeLightmap(const Functions& gl, const Caches& caches, const CacheBands& bands, GpuBake& gpu,
                    std::pmr::memory_resource* memory) {
  GLint max = 0;
  gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &max);
  const Lightmap& map = caches.lightmap;
  if (map.width > static_cast<GLuint>(max) || map.height > static_cast<GLuint>(max)) {
    return Error{ErrorCode::unsupported, "the light map of " + std::to_string(map.width) + " x " +
                                             std::to_string(map.height) +
                                             " texels exceeds this OpenGL's largest texture, " + std::to_string(max)};
  }
  if (!map.cache.empty()) {
    gpu.mapWidth = map.width;
    gpu.mapHeight = map.height;
  }
  const GLuint width = std::max(gpu.mapWidth, 1u), height = std::max(gpu.mapHeight, 1u);
  const int lumaLayers = wordsOf(bands.onMap(bands.lumaBands)), chromaLayers = wordsOf(bands.onMap(bands.chromaBands));
  gpu.mapY = makeTexture(gl, GL_TEXTURE_2D_ARRAY, GL_RGBA16F, width, height, lumaLayers);
  gpu.mapCo = makeTexture(gl, GL_TEXTURE_2D_ARRAY, GL_RGBA16F, width, height, chromaLayers);
  gpu.mapCg = makeTexture(gl, GL_TEXTURE_2D_ARRAY, GL_RGBA16F, width, height, chromaLayers);
  gpu.mapNormal = makeTexture(gl, GL_TEXTURE_2D, GL_RGBA8_SNORM, width, height, 1);
  const std::pmr::vector<std::int8_t> normals = packNormals(caches, memory);
  gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height), GL_RGBA, GL_BYTE,
                   normals.data());
  gpu.textureBytes = std::size_t{width} * height * (8 * static_cast<std::size_t>(lumaLayers + 2 * chromaLayers) + 4);
  return done();
}

void makeGridTextures(const Functions& gl, const GridTexture& texture, const CacheBands& bands, GpuBake& gpu,
                      std::pmr::memory_resource* memory) {
  if (texture.empty()) return;
  std::pmr::vector<std::uint32_t> shares(memory);
  shares.reserve(texture.begin.size() + texture.shares.size());
  for (const std::uint32_t first : texture.begin)
    shares.push_back(first + static_cast<std::uint32_t>(texture.begin.size()));
  shares.insert(shares.end(), texture.shares.begin(), texture.shares.end());
  gpu.gridShares = makeArray<std::uint32_t>(gl, shares);
  gpu.gridFactors = makeArray<float>(gl, packFactors(bands.lumaBands, memory));
  gpu.gridVectors = makeBuffer(gl, nullptr, std::size_t{texture.cacheCount} * 18 * 4 * sizeof(float), GL_DYNAMIC_COPY);
  const glm::uvec3 r = texture.resolution, cells = texture.cells();
  const auto depth = static_cast<int>(textureDepth(r.z));
  // The texels between the slabs stay zero: what filters may reach past a slab's end by rounding.
  const std::pmr::vector<std::uint16_t> zeros(std::size_t{4} * r.x * r.y * static_cast<std::size_t>(depth), 0, memory);
  const auto make = [&](GLenum stored, GLenum format) {
    Texture made = makeTexture(gl, GL_TEXTURE_3D, stored, r.x, r.y, depth);
    gl.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, static_cast<GLsizei>(r.x), static_cast<GLsizei>(r.y), depth, format,
                     GL_HALF_FLOAT, zeros.data());
    return made;
  };
  gpu.gridTexels = make(GL_RGBA16F, GL_RGBA);
  gpu.gridChroma = make(GL_RG16F, GL_RG);
  gpu.gridOpen = makeTexture(gl, GL_TEXTURE_3D, GL_R8UI, cells.x, cells.y, static_cast<int>(cells.z));
  // Integers do not filter.
  gl.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, static_cast<GLsizei>(cells.x), static_cast<GLsizei>(cells.y),
                   static_cast<GLsizei>(cells.z), GL_RED_INTEGER, GL_UNSIGNED_BYTE, texture.open.data());
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  gpu.gridTextureBytes =
      static_cast<std::size_t>(gpu.gridShares.bytes + gpu.gridFactors.bytes + gpu.gridVectors.bytes) +
      std::size_t{12} * r.x * r.y * static_cast<std::size_t>(depth) + texture.open.size();
}

}  // namespace relume::gl
