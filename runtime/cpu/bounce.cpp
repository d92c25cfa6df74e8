// SPDX-License-Identifier: MIT
// See bounce.h.
#include "runtime/cpu/bounce.h"

#include "formats/color.h"
#include "formats/pack.h"
#include "formats/sh.h"
#include "runtime/cpu/chunks.h"
#include "runtime/cpu/stencil.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <numbers>

namespace relume::cpu {
namespace {

constexpr std::uint32_t kGrain = 2048;
constexpr std::size_t kRows = 9;
constexpr float kPi = std::numbers::pi_v<float>;

typedef float Float4 __attribute__((vector_size(16)));

// Cosine between a surfel's normal and the light map's where it reads it; kNoMap where it reads the grid.
constexpr float kNoMap = 2.0f;
float cosineToMap(const Bake& bake, std::uint32_t s) {
  const Surfels& surfels = bake.surfels;
  if (surfels.receiver[s] == kGridReceiver) return kNoMap;
  const Stencil stencil = lightmapStencil(bake.caches, unpackUnorm16x2(surfels.receiver[s]));
  return glm::dot(stencilNormal(bake.caches, stencil), surfels.normal[s]);
}

// The lobe of resolve.cpp as the nine coefficients of three bands, written out: A_l y_l^m(n) and (4 pi / 3) y_1^m(n).
std::array<float, kRows> makeLobe(int bands, const glm::vec3& n, const SurfaceLobe& share) {
  const float clamped = share.clamped;
  const float band1 = (clamped * 2.0f / 3.0f + share.linear * 4.0f / 3.0f) * kPi * 0.488602512f;
  const float band2 = bands > 2 ? clamped * 0.25f * kPi : 0.0f;
  return {clamped * kPi * 0.282094792f,
          band1 * n.y,
          band1 * n.z,
          band1 * n.x,
          band2 * 1.092548431f * n.x * n.y,
          band2 * 1.092548431f * n.y * n.z,
          band2 * 0.315391565f * (3.0f * n.z * n.z - 1.0f),
          band2 * 1.092548431f * n.x * n.z,
          band2 * 0.546274215f * (n.x * n.x - n.y * n.y)};
}

}  // namespace

Bounce::Bounce(const Bake& bake, int lumaBands, int chromaBands, const ParallelFor& parallelFor)
    : bake_(bake), inTable_(lumaBands >= 2 && lumaBands <= 4), chromaFollows_(chromaBands == 1) {
  if (lumaBands < 2) return;
  cosine_.resize(bake.surfels.count());
  table_.resize(4 * kRows * bake.caches.count(), 0.0f);
  forChunks(parallelFor, bake.surfels.count(), kGrain, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t s = begin; s < end; ++s) cosine_[s] = cosineToMap(bake_, s);
  });
}

void Bounce::setLight(const CacheLight& light, const ParallelFor& parallelFor) {
  light_ = light;
  if (table_.empty()) return;
  const std::size_t luma = light.lumaCount(), chroma = light.chromaCount(), stride = light.stride();
  forChunks(parallelFor, bake_.caches.count(), kGrain, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t cache = begin; cache < end; ++cache) {
      const float* y = light.coefficients.data() + stride * cache;
      const float *co = y + luma, *cg = co + chroma;
      float* row = table_.data() + 4 * kRows * cache;
      for (std::size_t i = 0; i < std::min(kRows, luma); ++i) row[4 * i] = y[i];
      for (std::size_t i = 0; i < std::min(kRows, chroma); ++i) {
        row[4 * i + 1] = co[i];
        row[4 * i + 2] = cg[i];
      }
    }
  });
}

glm::vec3 Bounce::gather(const Stencil& stencil, const glm::vec3& normal, const SurfaceLobe& share) const {
  const float total = stencil.total();
  if (!(total > 0.0f)) return glm::vec3(0.0f);
  const std::array<float, kRows> lobe = makeLobe(light_.lumaBands, normal, share);
  Float4 e{}, constant{};
  for (int k = 0; k < stencil.count; ++k) {
    const float* row = table_.data() + 4 * kRows * stencil.cache[static_cast<std::size_t>(k)];
    const auto at = [row](std::size_t i) {
      Float4 v;
      __builtin_memcpy(&v, row + 4 * i, sizeof v);
      return v;
    };
    Float4 sum = lobe[1] * at(1) + lobe[2] * at(2) + lobe[3] * at(3);
    if (share.clamped > 0.0f) {
      sum += lobe[0] * at(0) + lobe[4] * at(4) + lobe[5] * at(5) + lobe[6] * at(6) + lobe[7] * at(7) + lobe[8] * at(8);
    }
    const float w = stencil.weight[static_cast<std::size_t>(k)] / total;
    e += w * sum;
    if (chromaFollows_) constant += w * at(0);
  }
  glm::vec3 yCoCg(e[0], e[1], e[2]);
  if (chromaFollows_) {
    yCoCg = constant[0] > 0.0f ? yCoCg.x * glm::vec3(1.0f, constant[1] / constant[0], constant[2] / constant[0])
                               : glm::vec3(yCoCg.x, 0.0f, 0.0f);
  }
  return glm::max(yCoCgToRgb(yCoCg), glm::vec3(0.0f));
}

// The commonest receiver, one whose normal is the map's: band 1 alone.
glm::vec3 Bounce::gatherLinear(std::uint32_t point, const glm::vec3& n, float linear) const {
  const Lightmap& map = bake_.caches.lightmap;
  constexpr float kUnit = 1.0f / 65535.0f;
  const TexelQuad quad = texelsAround(map, glm::vec2(static_cast<float>(point & 0xFFFFu), static_cast<float>(point >> 16)) * kUnit);
  Float4 e{};
  float total = 0.0f;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint32_t cache = map.cache[quad.texel[k]];
    if (cache == kNoCache) continue;
    Float4 band[3];
    __builtin_memcpy(band, table_.data() + 4 * kRows * cache + 4, sizeof band);
    e += quad.weight[k] * (n.y * band[0] + n.z * band[1] + n.x * band[2]);
    total += quad.weight[k];
  }
  if (!(total > 0.0f)) return glm::vec3(0.0f);
  e *= linear * (4.0f / 3.0f) * kPi * 0.488602512f / total;
  return glm::max(yCoCgToRgb(glm::vec3(e[0], e[1], e[2])), glm::vec3(0.0f));
}

glm::vec3 Bounce::irradiance(std::uint32_t s) const {
  const Surfels& surfels = bake_.surfels;
  const glm::vec3 n = surfels.normal[s];
  const bool map = !cosine_.empty() && cosine_[s] != kNoMap;
  SurfaceLobe share;
  if (map) share = light_.irradianceOnMap ? SurfaceLobe{0.0f, 2.0f} : surfaceLobe(cosine_[s]);
  if (map && share.clamped == 0.0f && !chromaFollows_) return gatherLinear(surfels.receiver[s], n, share.linear);
  const bool table = inTable_ || (map && share.clamped == 0.0f);
  if (surfels.receiver[s] == kGridReceiver) {
    const glm::vec3 p = surfels.positionWorld[s];
    return table ? gather(gridStencil(bake_.caches.grid, p, n), n, share) : irradianceInGrid(bake_.caches, light_, p, n);
  }
  const glm::vec2 uv = unpackUnorm16x2(surfels.receiver[s]);
  return table ? gather(lightmapStencil(bake_.caches, uv), n, share) : irradianceOnLightmap(bake_.caches, light_, uv, n);
}

}  // namespace relume::cpu
