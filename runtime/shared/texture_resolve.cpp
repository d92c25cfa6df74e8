// SPDX-License-Identifier: MIT
// See texture_resolve.h.
#include "runtime/shared/texture_resolve.h"

#include "formats/pack.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/half_scale.h"
#include "runtime/shared/pack_grid.h"
#include "runtime/shared/resolve_defines.h"
#include "runtime/shared/shader_text.h"

#include <glm/vec2.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Texels of a row of a list: relumeTexelOf() of the shader.
constexpr std::uint32_t kRow = 1024;
// Rows of a list, at most: words are counted in floats, which are exact up to here.
constexpr std::uint32_t kMaxRows = 16384;

// The textures in their order; those of the grid's texture last, where there is one.
enum Kind : std::size_t { kLightmap, kCaches, kWords, kVectors, kChroma, kOpen };

std::size_t texelBytes(TexelFormat format) {
  switch (format) {
    case TexelFormat::rgba16f:
      return 8;
    case TexelFormat::r8:
      return 1;
    default:
      return 4;
  }
}

ResolveTexture texture(const char* sampler, TextureShape shape, TexelFormat format, const glm::uvec3& size,
                       bool isFiltered, bool isLight) {
  return {sampler, shape, format, size, isFiltered, isLight, texelBytes(format) * size.x * size.y * size.z};
}

glm::uvec3 listSize(std::size_t texels) { return {kRow, std::max<std::size_t>((texels + kRow - 1) / kRow, 1), 1}; }

std::uint32_t layersOf(int bands) { return static_cast<std::uint32_t>((bands * bands + 3) / 4); }

// Vectors of four coefficients of a cache: Y's, Co's, Cg's, each padded with zeros.
struct Layers {
  explicit Layers(const CacheBands& bands) : luma(layersOf(bands.lumaBands)), chroma(layersOf(bands.chromaBands)) {}
  std::uint32_t luma, chroma;
  std::uint32_t total() const { return luma + 2 * chroma; }
};

// The first coefficients of a cache, of as many bands as `to` has layers for, as halves. [Size to = 4 * layers.total()]
void packCache(const CacheBands& held, const CacheBands& wanted, std::span<const float> c,
               std::span<std::uint16_t> to) {
  const Layers layers(wanted);
  std::fill(to.begin(), to.end(), std::uint16_t{0});
  const std::span<const float> y = c.subspan(0, wanted.lumaCount()),
                               co = c.subspan(held.lumaCount(), wanted.chromaCount()),
                               cg = c.subspan(held.lumaCount() + held.chromaCount(), wanted.chromaCount());
  const float scale = halfScale(largestOf(y, largestOf(co, largestOf(cg))));
  const auto channel = [&](std::span<const float> from, std::size_t first) {
    for (std::size_t i = 0; i < from.size(); ++i) to[first + i] = packHalf(scale * from[i]);
  };
  channel(y, 0);
  channel(co, 4 * layers.luma);
  channel(cg, 4 * (layers.luma + layers.chroma));
}

// Caches [first, end) packed one after the other.
std::pmr::vector<std::uint16_t> packCaches(const ResolveSource& source, const CacheLight& light,
                                           const CacheBands& wanted, std::uint32_t first, std::uint32_t end,
                                           const ParallelFor& parallelFor) {
  const std::size_t halves = 4 * std::size_t{Layers(wanted).total()};
  std::pmr::vector<std::uint16_t> packed(halves * (end - first), 0, source.memory);
  constexpr std::uint32_t kGrain = 512;
  forChunks(parallelFor, end - first, kGrain, [&](std::uint32_t begin, std::uint32_t stop) {
    for (std::uint32_t i = begin; i < stop; ++i) {
      CacheLight::Row row;
      packCache(light, wanted, {light.of(first + i, row), light.stride()},
                std::span(packed).subspan(halves * i, halves));
    }
  });
  return packed;
}

void writeLightmap(const ResolveSource& source, const CacheLight& light, const ParallelFor& parallelFor,
                   std::span<std::byte> texels) {
  const PackedMap& map = source.caches.map();
  std::fill(texels.begin(), texels.end(), std::byte{0});
  const CacheBands bands = source.bands.ofMap();
  const std::uint32_t first = source.caches.firstMapCache(), layers = Layers(bands).total();
  const std::pmr::vector<std::uint16_t> packed =
      packCaches(source, light, bands, first, source.caches.count(), parallelFor);
  const std::size_t layerBytes = std::size_t{8} * map.width * map.height;
  forChunks(parallelFor, map.height, 1, [&](std::uint32_t row, std::uint32_t) {
    for (std::uint32_t x = 0; x < map.width; ++x) {
      const std::size_t texel = std::size_t{row} * map.width + x;
      const std::uint32_t cache = map.cache[texel];
      if (cache == kNoCache) continue;
      std::byte* to = texels.data() + 8 * texel;
      const std::uint16_t* from = packed.data() + std::size_t{4} * layers * (cache - first);
      for (std::uint32_t layer = 0; layer < layers; ++layer, to += layerBytes, from += 4) std::memcpy(to, from, 8);
      // To the 127ths that the OpenGL backend's texture has.
      std::uint16_t normal[4] = {0, 0, 0, packHalf(1.0f)};
      const glm::vec3 held = map.normalOf(cache);
      for (int k = 0; k < 3; ++k) normal[k] = packHalf(std::round(127.0f * std::clamp(held[k], -1.0f, 1.0f)) / 127.0f);
      std::memcpy(to, normal, 8);
    }
  });
}

// The volumes of the grid's texture from the processor's texels: six slabs along z with an empty texel between two.
void writeVolume(const GridTexture& grid, std::span<const float> from, bool chroma, std::span<std::byte> texels) {
  std::fill(texels.begin(), texels.end(), std::byte{0});
  const glm::uvec3 r = grid.resolution;
  const std::size_t plane = std::size_t{r.x} * r.y, halves = chroma ? 2 : 4;
  for (std::size_t point = 0; point < grid.points(); ++point) {
    for (std::size_t half = 0; half < 6; ++half) {
      const float* texel = from.data() + kTexelFloats * (6 * point + half);
      const std::size_t at = half * (r.z + 1) * plane + point;
      // The luma vector and Co, Cg; the weight between them is no light.
      const float scale = halfScale(largestOf({texel, 3}, largestOf({texel + 4, 2})));
      std::uint16_t packed[4];
      for (std::size_t k = 0; k < halves; ++k) {
        const float part = texel[(chroma ? 4 : 0) + k];
        packed[k] = packHalf(!chroma && k == 3 ? part : scale * part);
      }
      std::memcpy(texels.data() + 2 * halves * at, packed, 2 * halves);
    }
  }
}

// Without comments, blank lines and lines that go on in the next: older GLSL knows neither the last nor letters
// beyond ASCII.
std::string plainGlsl(std::string_view text) {
  std::string plain;
  plain.reserve(text.size());
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const bool goesOn = !line.empty() && line.back() == '\\';
    if (goesOn) line.remove_suffix(1);
    line = line.substr(0, line.find("//"));
    while (!line.empty() && line.back() == ' ') line.remove_suffix(1);
    plain += line;
    if (goesOn) {
      plain += ' ';
    } else if (!plain.empty() && plain.back() != '\n') {
      plain += '\n';
    }
  }
  return plain;
}

}  // namespace

Result<TextureResolve> describeTextures(const ResolveSource& source) {
  const GridTexture none(source.memory);
  const PackedGridLayout grid = layoutGrid(source.caches, source.gridTexture ? *source.gridTexture : none);
  const std::size_t cacheTexels = std::size_t{source.caches.firstMapCache()} * Layers(source.bands).total();
  const std::size_t most = std::max(grid.words, cacheTexels);
  if (most > std::size_t{kRow} * kMaxRows) {
    return Error{ErrorCode::unsupported, "the grid has " + std::to_string(most) +
                                             " texels, a resolve by textures takes at most " +
                                             std::to_string(std::size_t{kRow} * kMaxRows)};
  }
  TextureResolve out;
  const PackedMap& map = source.caches.map();
  // Without a light map an empty texel stands for it.
  const glm::uvec2 size = map.cache.empty() ? glm::uvec2(1) : glm::uvec2(map.width, map.height);
  out.textures = {
      texture("relumeLightmap", TextureShape::array, TexelFormat::rgba16f,
              {size.x, size.y, Layers(source.bands.ofMap()).total() + 1}, true, true),
      texture("relumeGridCaches", TextureShape::flat, TexelFormat::rgba16f, listSize(cacheTexels), false, true),
      texture("relumeGridWords", TextureShape::flat, TexelFormat::rgba8, listSize(grid.words), false, false),
  };
  if (source.gridTexture) {
    const glm::uvec3 r = source.gridTexture->resolution;
    const glm::uvec3 volume(r.x, r.y, textureDepth(r.z));
    out.textures.push_back(
        texture("relumeGridVectors", TextureShape::volume, TexelFormat::rgba16f, volume, true, true));
    out.textures.push_back(texture("relumeGridChroma", TextureShape::volume, TexelFormat::rg16f, volume, true, true));
    out.textures.push_back(
        texture("relumeGridOpen", TextureShape::volume, TexelFormat::r8, source.gridTexture->cells(), false, false));
  }
  const gl::RelumeResolve& r = grid.resolve;
  const auto f = [](std::uint32_t word) { return static_cast<float>(word); };
  out.grid = {glm::vec4(r.gridOriginWorld, r.gridBricks == gl::kRelumeNone ? -1.0f : f(r.gridBricks)),
              glm::vec4(r.gridSpacing, f(r.gridFine)),
              glm::vec4(glm::vec3(r.gridResolution), f(r.gridCaches)),
              glm::vec4(f(r.gridDepthWords), r.gridDepthUnit, r.gridFinestSpacing,
                        r.mapSight == gl::kRelumeNone ? -1.0f : f(r.mapSight)),
              glm::vec4(r.gridTextureSpacing, f(r.gridTextureStep)),
              glm::vec4(glm::vec3(r.gridTextureResolution), 0.0f)};
  return out;
}

void writeTexels(const ResolveSource& source, std::size_t texture, const CacheLight& light,
                 std::span<const float> gridTexels, const ParallelFor& parallelFor, std::span<std::byte> texels) {
  const auto copy = [&](const void* from, std::size_t bytes) {
    std::fill(texels.begin(), texels.end(), std::byte{0});
    if (bytes > 0) std::memcpy(texels.data(), from, bytes);
  };
  switch (static_cast<Kind>(texture)) {
    case kLightmap:
      return writeLightmap(source, light, parallelFor, texels);
    case kCaches: {
      const auto packed = packCaches(source, light, source.bands, 0, source.caches.firstMapCache(), parallelFor);
      return copy(packed.data(), packed.size() * sizeof(packed[0]));
    }
    case kWords: {
      const PackedGridLayout layout = layoutGrid(source.caches, GridTexture(source.memory));
      const std::pmr::vector<std::uint32_t> words = packGrid(source.caches, layout, source.memory);
      static_assert(std::endian::native == std::endian::little, "the lowest byte of a word is red");
      return copy(words.data(), words.size() * sizeof(words[0]));
    }
    case kVectors:
    case kChroma:
      return writeVolume(*source.gridTexture, gridTexels, texture == kChroma, texels);
    case kOpen:
      return copy(source.gridTexture->open.data(), source.gridTexture->open.size());
  }
}

Result<std::string> textureResolveGlsl(const CacheBands& bands, bool gridTexture) {
  auto defines = resolveDefines(bands, gridTexture);
  defines.emplace_back("RELUME_RESOLVE_TEXTURES", "1");
  Result<std::string> text = expandShader("resolve.glsl", defines);
  if (!text) return text.error();
  return plainGlsl(*text);
}

}  // namespace relume
