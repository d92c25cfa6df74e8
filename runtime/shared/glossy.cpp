// SPDX-License-Identifier: MIT
// See glossy.h.
#include "runtime/shared/glossy.h"

#include "formats/color.h"
#include "formats/limits.h"
#include "formats/sh.h"
#include "relume/glossy.h"
#include "runtime/shared/interpolate.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace relume {
namespace {

// Smallest share of the lobe above the horizon that light is divided by: normal maps reflect some below it.
constexpr float kMinShare = 0.25f;

struct GlossyLobe {
  std::array<float, kMaxBands> factor{};    // s_l
  std::array<float, kMaxCoefficients> g{};  // s_l y_l^m(r)
};

GlossyLobe makeGlossyLobe(int bands, const glm::vec3& reflected, float exponent) {
  GlossyLobe lobe;
  cosineLobeFactors(bands, exponent > 0.0f ? std::min(exponent, kMaxExponent) : 0.0f, lobe.factor);
  evaluateSh(bands, reflected, lobe.g);
  for (std::size_t l = 0; l < static_cast<std::size_t>(bands); ++l)
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i) lobe.g[i] *= lobe.factor[l];
  return lobe;
}

// What the lobe has, in so many bands, of the half of the sphere whose pole is at `cosine` from its axis:
// sum_l s_l h_l P_l(cosine), h_l = (2 l + 1) / 2 integral of P_l over 0..1.
float shareAbove(int bands, const std::array<float, kMaxBands>& s, float cosine) {
  const float c = std::clamp(cosine, -1.0f, 1.0f), c2 = c * c;
  float share = 0.5f;
  if (bands > 1) share += 0.75f * s[1] * c;
  if (bands > 3) share -= 0.4375f * s[3] * 0.5f * c * (5.0f * c2 - 3.0f);
  if (bands > 5) share += 0.34375f * s[5] * 0.125f * c * ((63.0f * c2 - 70.0f) * c2 + 15.0f);
  if (bands > 7) share -= 0.29296875f * s[7] * 0.0625f * c * (((429.0f * c2 - 693.0f) * c2 + 315.0f) * c2 - 35.0f);
  return std::max(share, kMinShare);
}

float sumOf(const GlossyLobe& lobe, const float* c, std::size_t begin, std::size_t end) {
  float sum = 0.0f;
  for (std::size_t i = begin; i < end; ++i) sum += lobe.g[i] * c[i];
  return sum;
}

// Light in the lobe by the caches of a stencil, of which each has `held` bands.
glm::vec3 gather(const CacheLight& light, const CacheBands& held, const Stencil& stencil, const GlossyLobe& lobe,
                 float scale) {
  const bool chromaFollows = light.chromaBands == 1 && light.lumaBands > 1;
  const std::size_t luma = held.lumaCount(), chroma = held.chromaCount();
  glm::vec3 sum(0.0f);  // radiance as Y, Co, Cg
  float upper = 0.0f;   // of Y, by bands that chroma lacks
  FirstBands first;
  for (int k = 0; k < stencil.count; ++k) {
    CacheLight::Row row;
    const float* y = light.of(stencil.cache[static_cast<std::size_t>(k)], row);
    const float* co = y + light.lumaCount();
    const float* cg = co + light.chromaCount();
    const float w = stencil.weight[static_cast<std::size_t>(k)] * scale;
    const float rest = w * sumOf(lobe, y, chroma, luma);
    sum += w * glm::vec3(sumOf(lobe, y, 0, chroma), sumOf(lobe, co, 0, chroma), sumOf(lobe, cg, 0, chroma));
    sum.x += rest;
    upper += rest;
    if (chroma < luma) first.add(light, y, w);
  }
  if (chroma < luma) {
    if (!chromaFollows) {
      const glm::vec2 more = upper * chromaOverLuma(first);
      sum += glm::vec3(0.0f, more.x, more.y);
    } else if (first.constant.x > 0.0f) {
      sum.y = sum.x * (first.constant.y / first.constant.x);
      sum.z = sum.x * (first.constant.z / first.constant.x);
    }
  }
  return glm::max(yCoCgToRgb(sum), glm::vec3(0.0f));
}

}  // namespace

glm::vec3 glossyOnLightmap(const PackedCaches& caches, const CacheLight& light, const glm::vec2& uv,
                           const glm::vec3& reflected, float exponent) {
  if (!std::isfinite(uv.x) || !std::isfinite(uv.y) || !canShade(reflected)) return glm::vec3(0.0f);
  const Stencil stencil = lightmapStencil(caches.map(), uv);
  const float total = stencil.total();
  if (!(total > 0.0f)) return glm::vec3(0.0f);
  if (light.irradianceOnMap) return irradianceOnLightmap(caches, light, uv, reflected) * std::numbers::inv_pi_v<float>;
  const CacheBands held = light.ofMap();
  const GlossyLobe lobe = makeGlossyLobe(held.lumaBands, reflected, exponent);
  const glm::vec3 normal = meanNormal(caches.map(), stencil);
  const float length = glm::length(normal);
  const float share =
      length > 0.0f ? shareAbove(held.lumaBands, lobe.factor, glm::dot(normal, reflected) / length) : 1.0f;
  return gather(light, held, stencil, lobe, 1.0f / total) / share;
}

glm::vec3 glossyInGrid(const PackedCaches& caches, const CacheLight& light, const glm::vec3& positionWorld,
                       const glm::vec3& normal, const glm::vec3& reflected, float exponent) {
  if (!isWithin(positionWorld, std::numeric_limits<float>::max()) || !canShade(normal) || !canShade(reflected))
    return glm::vec3(0.0f);
  const glm::vec3 near = glm::clamp(positionWorld, -kMaxCoordinate, kMaxCoordinate);
  const Stencil stencil = gridStencil(caches, near, normal);
  const float total = stencil.total();
  if (!(total > 0.0f)) return glm::vec3(0.0f);
  return gather(light, light, stencil, makeGlossyLobe(light.lumaBands, reflected, exponent), 1.0f / total);
}

}  // namespace relume
