// SPDX-License-Identifier: MIT
// From a material's roughness to the glossy light that the caches hold (Relighter::glossyOnLightmap() and
// glossyInGrid()). Pure functions, any thread.
#pragma once

#include <algorithm>

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

// Share of a surface's glossy light to take from the caches: 1 from a roughness of 0.6 on, 0 up to 0.4, smooth between.
// Spherical harmonics of the usual bands blur sharper lobes; the rest is the host's (screen-space or captured
// reflections). Where the host has none, taking all from the caches is better than black.
inline float glossyShare(float roughness) {
  const float t = std::clamp((roughness - 0.4f) / 0.2f, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

}  // namespace relume
