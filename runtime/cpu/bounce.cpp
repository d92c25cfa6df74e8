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

#include <numbers>

namespace relume::cpu {
namespace {

constexpr std::uint32_t kGrain = 2048;
// irradianceLinear()'s factor: 4 pi / 3 y_1.
constexpr float kLinear = static_cast<float>(4.0 * std::numbers::pi / 3.0 * 0.48860251190291992);

bool isPlain(const Bake& bake, std::uint32_t s) {
  const Surfels& surfels = bake.surfels;
  if (surfels.receiver[s] == kGridReceiver || bake.caches.lightmap.cache.empty()) return false;
  const glm::vec2 uv = unpackUnorm16x2(surfels.receiver[s]);
  for (const std::size_t texel : texelsAround(bake.caches.lightmap, uv).texel) {
    if (bake.caches.lightmap.cache[texel] == kNoCache) return false;
  }
  glm::vec3 normal;
  lightmapStencil(bake.caches, uv, normal);
  const float length = glm::length(normal);
  return length > 0.0f && surfaceBlend(glm::dot(normal, surfels.normal[s]) / length) >= 1.0f;
}

}  // namespace

Bounce::Bounce(const Bake& bake, int lumaBands, int chromaBands, const ParallelFor& parallelFor)
    : bake_(bake), chromaFollows_(chromaBands == 1), plain_(bake.surfels.count(), 0), row_(bake.caches.count()) {
  // One band of luma knows no direction: there is no band 1 to make a table of.
  if (lumaBands < 2) return;
  forChunks(parallelFor, bake.surfels.count(), kGrain, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t s = begin; s < end; ++s) plain_[s] = isPlain(bake_, s) ? 1 : 0;
  });
}

void Bounce::setLight(const CacheLight& light, const ParallelFor& parallelFor) {
  light_ = light;
  if (light.lumaBands < 2) return;
  const std::size_t luma = light.lumaCount(), chroma = light.chromaCount(), stride = light.stride();
  forChunks(parallelFor, bake_.caches.count(), kGrain, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t cache = begin; cache < end; ++cache) {
      const float* y = light.coefficients.data() + stride * cache;
      const float *co = y + luma, *cg = co + chroma;
      const auto row = [&](std::size_t i) {
        return kLinear * (chromaFollows_ ? glm::vec4(y[i], 0, 0, 0) : glm::vec4(y[i], co[i], cg[i], 0));
      };
      row_[cache] = {row(3), row(1), row(2), glm::vec4(y[0], co[0], cg[0], 0)};
    }
  });
}

glm::vec3 Bounce::irradiance(std::uint32_t s) const {
  const Surfels& surfels = bake_.surfels;
  const glm::vec3 n = surfels.normal[s];
  if (surfels.receiver[s] == kGridReceiver) return irradianceInGrid(bake_.caches, light_, surfels.positionWorld[s], n);
  const glm::vec2 uv = unpackUnorm16x2(surfels.receiver[s]);
  if (!plain_[s]) return irradianceOnLightmap(bake_.caches, light_, uv, n);

  const TexelQuad quad = texelsAround(bake_.caches.lightmap, uv);
  glm::vec4 e(0.0f), constant(0.0f);
  for (std::size_t k = 0; k < 4; ++k) {
    const Rows& rows = row_[bake_.caches.lightmap.cache[quad.texel[k]]];
    e += quad.weight[k] * (n.x * rows.x + n.y * rows.y + n.z * rows.z);
    if (chromaFollows_) constant += quad.weight[k] * rows.constant;
  }
  if (chromaFollows_ && constant.x > 0.0f) e = glm::vec4(e.x, e.x * constant.y / constant.x, e.x * constant.z / constant.x, 0);
  return glm::max(yCoCgToRgb(glm::vec3(e)), glm::vec3(0.0f));
}

}  // namespace relume::cpu
