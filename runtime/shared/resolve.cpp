// SPDX-License-Identifier: MIT
// See resolve.h.
#include "runtime/shared/resolve.h"

#include "formats/color.h"
#include "formats/limits.h"
#include "formats/sh.h"
#include "runtime/shared/interpolate.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace relume {
namespace {

// The receiver's lobe g as coefficients, zero outside [first, last).
struct Lobe {
  std::array<float, kMaxCoefficients> g;
  std::size_t first = 0, last = 0;
  float guessed = 0.0f;  // share of the clamped form, where it lacks bands that are guessed
};

// Lobe of a receiver with unit normal n by the shares of the two forms; single: factor on a lone band.
Lobe makeLobe(const CacheLight& light, const glm::vec3& n, SurfaceLobe share, float single) {
  const int bands = light.lumaBands;
  Lobe lobe;
  if (bands < 2) share = {0.0f, single};
  if (share.clamped > 0.0f) {
    // Bands 3, 5 and 7 of the clamped cosine are zero: leave the last band out when it is one of them.
    const int used = bands == 4 || bands == 6 || bands == 8 ? bands - 1 : bands;
    evaluateSh(used, n, lobe.g);
    for (int l = 0; l < used; ++l) {
      const float factor = share.clamped * clampedCosineFactors()[static_cast<std::size_t>(l)];
      for (int i = l * l; i < (l + 1) * (l + 1); ++i) lobe.g[static_cast<std::size_t>(i)] *= factor;
    }
    lobe.last = static_cast<std::size_t>(used * used);
  }
  if (share.linear > 0.0f) {
    constexpr float kLinear = static_cast<float>(4.0 * std::numbers::pi / 3.0 * 0.48860251190291992);
    const bool alone = !(share.clamped > 0.0f);
    if (alone) lobe.g[1] = lobe.g[2] = lobe.g[3] = 0.0f;
    lobe.g[1] += share.linear * kLinear * n.y;
    lobe.g[2] += share.linear * kLinear * n.z;
    lobe.g[3] += share.linear * kLinear * n.x;
    if (alone) lobe.first = 1;
    lobe.last = std::max<std::size_t>(lobe.last, 4);
  }
  if (light.guessBands) lobe.guessed = share.clamped;
  return lobe;
}

float applyLobe(const Lobe& lobe, const float* c, std::size_t count, std::size_t first = 0) {
  float e = 0.0f;
  for (std::size_t i = std::max(lobe.first, first); i < std::min(lobe.last, count); ++i) e += lobe.g[i] * c[i];
  return e;
}

glm::vec3 gather(const CacheLight& light, const Stencil& stencil, const Lobe& lobe, const glm::vec3& n, float scale) {
  const std::size_t lumaCount = light.lumaCount(), chromaCount = light.chromaCount();
  const bool chromaFollows = light.chromaBands == 1 && light.lumaBands > 1;
  const bool guessLuma = lobe.guessed > 0.0f && light.lumaBands == 2,
             guessChroma = lobe.guessed > 0.0f && light.chromaBands == 2;
  glm::vec3 e(0.0f);   // irradiance as Y, Co, Cg
  float upper = 0.0f;  // of Y, by bands 2 and up
  FirstBands first;
  for (int k = 0; k < stencil.count; ++k) {
    CacheLight::Row row;
    const float* y = light.of(stencil.cache[static_cast<std::size_t>(k)], row);
    const float* co = y + lumaCount;
    const float* cg = co + chromaCount;
    const float w = stencil.weight[static_cast<std::size_t>(k)] * scale;
    // Bands 0 and 1, then the others.
    const float low = applyLobe(lobe, y, std::min<std::size_t>(lumaCount, 4)), high = applyLobe(lobe, y, lumaCount, 4);
    e.x += w * (low + high);
    upper += w * high;
    if (chromaFollows || guessLuma || guessChroma) first.add(light, y, w);
    if (chromaFollows) continue;
    e.y += w * applyLobe(lobe, co, chromaCount);
    e.z += w * applyLobe(lobe, cg, chromaCount);
  }
  if (guessLuma) {
    upper = lobe.guessed * zonalIrradiance(first.constant.x, first.linear[0], n);
    e.x += upper;
  }
  if (guessChroma) {
    const glm::vec2 chroma = upper * chromaOverLuma(first);
    e += glm::vec3(0.0f, chroma.x, chroma.y);
  }
  if (chromaFollows && first.constant.x > 0.0f) {
    e.y = e.x * (first.constant.y / first.constant.x);
    e.z = e.x * (first.constant.z / first.constant.x);
  }
  return glm::max(yCoCgToRgb(e), glm::vec3(0.0f));
}

}  // namespace

glm::vec3 irradianceOnLightmap(const PackedCaches& caches, const CacheLight& light, const glm::vec2& uv,
                               const glm::vec3& normal, const glm::vec3& geometricNormal) {
  if (!std::isfinite(uv.x) || !std::isfinite(uv.y) || !canShade(normal) || !canShade(geometricNormal))
    return glm::vec3(0.0f);
  const Stencil stencil = lightmapStencil(caches.map(), uv);
  const float total = stencil.total();
  if (!(total > 0.0f)) return glm::vec3(0.0f);
  const glm::vec3 cacheNormal = meanNormal(caches.map(), stencil);
  // Irradiance caches answer for their own normal whatever the receiver's: (2 pi y_0) times coefficient 0.
  const SurfaceLobe share = light.irradianceOnMap
                                ? SurfaceLobe{0.0f, 2.0f}
                                : surfaceLobe(glm::dot(normal, cacheNormal), glm::dot(geometricNormal, cacheNormal));
  // One band knows no direction: a cache on a surface holds half a sphere of light, all of it above the surface.
  const float single = cacheNormal == glm::vec3(0.0f) ? 1.0f : 2.0f;
  return gather(light, stencil, makeLobe(light, normal, share, single), normal, 1.0f / total);
}

glm::vec3 irradianceInGrid(const PackedCaches& caches, const CacheLight& light, const glm::vec3& positionWorld,
                           const glm::vec3& normal) {
  if (!isWithin(positionWorld, std::numeric_limits<float>::max()) || !canShade(normal)) return glm::vec3(0.0f);
  const glm::vec3 near = glm::clamp(positionWorld, -kMaxCoordinate, kMaxCoordinate);
  const Stencil stencil = gridStencil(caches, near, normal);
  const float total = stencil.total();
  if (!(total > 0.0f)) return glm::vec3(0.0f);
  return gather(light, stencil, makeLobe(light, normal, {}, 1.0f), normal, 1.0f / total);
}

}  // namespace relume
