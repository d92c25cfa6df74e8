// SPDX-License-Identifier: MIT
// From a material's roughness to the glossy light that the caches hold (Relighter::glossyOnLightmap() and
// glossyInGrid()). Pure functions, any thread.
#pragma once

#include "relume/vectors.h"

#include <algorithm>
#include <cmath>

namespace relume {

// Exponents that glossy look-ups take; values outside are clamped, NaN is 0.
inline constexpr float kMaxExponent = 1e4f;

// Exponent n of the lobe cos^n about the reflected direction that is as wide as that of a microfacet surface: Blinn and
// Phong's exponent about the half vector is 2 / alpha² - 2 for GGX's or Beckmann's alpha = roughness² (Walter et al.
// 2007, Section 5.2), and a lobe about the reflected direction, which turns twice as far, has a quarter of it.
// At least 1: the roughest surfaces mirror what a diffuse one reflects. [roughness 0..1, as in glTF] 0.6 gives 3.4,
// 0.4 gives 19, 0 gives kMaxExponent.
inline float glossyExponent(float roughness) {
  const float alpha2 = roughness * roughness * roughness * roughness;
  return alpha2 * kMaxExponent > 0.5f ? std::clamp(0.5f / alpha2 - 0.5f, 1.0f, kMaxExponent) : kMaxExponent;
}

// The roughness of a lobe's exponent: the inverse of glossyExponent() from an exponent of 1 on.
// [exponent 1..kMaxExponent]
inline float glossyRoughness(float exponent) { return std::sqrt(std::sqrt(0.5f / (std::max(exponent, 1.0f) + 0.5f))); }

// Share of a surface's glossy light to take from the caches: 1 from a roughness of 0.6 on, 0 up to 0.4, smooth between.
// Spherical harmonics of the usual bands blur sharper lobes; the rest is the host's (screen-space or captured
// reflections). Where the host has none, taking all from the caches is better than black.
inline float glossyShare(float roughness) {
  const float t = std::clamp((roughness - 0.4f) / 0.2f, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

// What a metallic-roughness surface of glTF 2.0 does with light, by the direction it is seen from: it scatters the
// share `diffuse` of irradiance / pi and mirrors the share `specular` of the mean radiance in the lobe. Each channel is
// within 0..1, and so is their sum; white surfaces of any metalness and roughness have a sum of 1 (white furnace).
struct ReflectanceSplit {
  glm::vec3 diffuse{0.0f}, specular{0.0f};
};

// Share of a lobe's light that a surface mirrors, of light at normal incidence F_0, all bounces between its microfacets
// included (Fdez-Agüera 2019, "A Multiple-Scattering Microfacet Model for Real-Time Image-based Lighting"): F = F_0 A +
// B is reflected once, of what is left, 1 - A - B, the mean Fresnel term F_avg = F_0 + (1 - F_0) / 21 again, and so on:
// F + F F_avg (1 - A - B) / (1 - F_avg (1 - A - B)). A, B of GGX by the fit of Karis 2014 ("Physically Based Shading on
// Mobile"). [f0, roughness, cosine 0..1]
inline float specularShare(float f0, float roughness, float cosine) {
  const float rx = 1.0f - roughness, ry = 0.0425f - 0.0275f * roughness, rz = 1.04f - 0.572f * roughness,
              rw = 0.022f * roughness - 0.04f;
  const float a = std::min(rx * rx, std::exp2(-9.28f * cosine)) * rx + ry;
  const float scale = rz - 1.04f * a, bias = std::max(rw + 1.04f * a, 0.0f);
  const float once = std::clamp(f0 * scale + bias, 0.0f, 1.0f);
  const float missed = std::clamp(1.0f - scale - bias, 0.0f, 1.0f), average = f0 + (1.0f - f0) / 21.0f;
  return std::min(once + once * average * missed / (1.0f - average * missed), 1.0f);
}

// glTF 2.0, Appendix B.2: a mix by metalness of a dielectric, F_0 = 0.04 over a diffuse body of the base colour, and a
// metal, F_0 = the base colour. cosine: of the angle between normal and viewer, clamped to 0..1. [all arguments 0..1]
inline ReflectanceSplit splitReflectance(const glm::vec3& baseColor, float metalness, float roughness, float cosine) {
  constexpr float kDielectric = 0.04f;
  const float c = std::clamp(cosine, 0.0f, 1.0f), dielectric = specularShare(kDielectric, roughness, c);
  ReflectanceSplit split;
  for (int i = 0; i < 3; ++i) {
    split.diffuse[i] = (1.0f - metalness) * (1.0f - dielectric) * baseColor[i];
    split.specular[i] = (1.0f - metalness) * dielectric + metalness * specularShare(baseColor[i], roughness, c);
  }
  return split;
}

}  // namespace relume
