// SPDX-License-Identifier: MIT
// See pack_textures.h.
#include "runtime/passes/pack_textures.h"

#include "formats/irradiance_vector.h"
#include "shaders/shared/layout.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume::gpu {

namespace {

// A unit vector in 127ths: of the eight roundings the one whose length is nearest to 1, which is what shaders tell from
// it where caches look apart; its direction is within a degree.
glm::ivec3 roundedUnit(const glm::vec3& n) {
  const glm::vec3 scaled = 127.0f * glm::clamp(n, -1.0f, 1.0f);
  const glm::ivec3 low(glm::floor(scaled));
  glm::ivec3 best = low;
  float least = std::numeric_limits<float>::infinity();
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 rounded = glm::min(low + glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2), 127);
    const float off = std::abs(glm::length(glm::vec3(rounded)) - 127.0f * glm::length(n)) +
                      0.01f * glm::length(glm::vec3(rounded) - scaled);
    if (off < least) least = off, best = rounded;
  }
  return best;
}

}  // namespace

std::pmr::vector<std::int8_t> packNormals(const Caches& caches, std::pmr::memory_resource* memory) {
  std::pmr::vector<std::int8_t> texels(4 * std::max<std::size_t>(caches.lightmap.cache.size(), 1), 0, memory);
  for (std::size_t i = 0; i < caches.lightmap.cache.size(); ++i) {
    const std::uint32_t cache = caches.lightmap.cache[i];
    if (cache == kNoCache) continue;
    const glm::ivec3 rounded = roundedUnit(caches.normal[cache]);
    for (int k = 0; k < 3; ++k) texels[4 * i + static_cast<std::size_t>(k)] = static_cast<std::int8_t>(rounded[k]);
    texels[4 * i + 3] = 127;
  }
  return texels;
}

std::pmr::vector<std::uint32_t> listTexels(const Caches& caches, std::uint32_t first,
                                           std::pmr::memory_resource* memory) {
  const Lightmap& map = caches.lightmap;
  const std::size_t count = caches.count() - first;
  std::pmr::vector<std::uint32_t> list(count + 2, 0, memory);
  for (const std::uint32_t cache : map.cache) list[cache == kNoCache ? count + 1 : cache - first + 1] += 1;
  list.pop_back();
  list[0] = static_cast<std::uint32_t>(count + 1);
  for (std::size_t i = 1; i <= count; ++i) list[i] += list[i - 1];
  std::pmr::vector<std::uint32_t> next(list.begin(), list.end() - 1, memory);
  list.resize(list.back());
  for (std::uint32_t i = 0; i < map.cache.size(); ++i) {
    if (map.cache[i] != kNoCache) list[next[map.cache[i] - first]++] = i % map.width | i / map.width << 16;
  }
  return list;
}

std::pmr::vector<std::uint32_t> darkTexels(const Lightmap& map, std::pmr::memory_resource* memory) {
  std::pmr::vector<std::uint32_t> texels(map.cache.begin(), map.cache.end(), memory);
  for (std::uint32_t& texel : texels) texel = texel == kNoCache ? gl::kRelumeNone : 0;
  return texels;
}

std::pmr::vector<std::uint32_t> packShares(const GridTexture& texture, std::pmr::memory_resource* memory) {
  std::pmr::vector<std::uint32_t> shares(memory);
  shares.reserve(texture.begin.size() + texture.shares.size());
  for (const std::uint32_t first : texture.begin)
    shares.push_back(first + static_cast<std::uint32_t>(texture.begin.size()));
  shares.insert(shares.end(), texture.shares.begin(), texture.shares.end());
  return shares;
}

std::pmr::vector<float> packFactors(int bands, std::pmr::memory_resource* memory) {
  const std::size_t stride = 4 * static_cast<std::size_t>(wordsOf(bands));
  std::pmr::vector<float> packed(9 * stride, 0.0f, memory);
  for (std::size_t row = 0; row < 9; ++row) {
    for (std::size_t i = 4; i < static_cast<std::size_t>(bands * bands); ++i)
      packed[row * stride + i] = vectorFactors()[row * kMaxCoefficients + i];
  }
  return packed;
}

}  // namespace relume::gpu
