// SPDX-License-Identifier: MIT
// Colours without negative parts in 32 bits: what the runtime keeps of a node's radiosity, and of a texel's irradiance.
// shaders/lib/pack.glsl is the same arithmetic; a test runs both.
//
// Bits 0-8 red, 9-17 green, 18-25 blue, 26-31 exponent e: red and green are multiples of 2^(e-40), blue of 2^(e-39),
// with e such that the largest channel has its leading bit set. That covers 2^-40 to 2^32, so that no unit overflows;
// below 2^-32 there are fewer bits.
// Rounding is dithered: down after adding `dither` of [0,1). With dithers that are spread evenly, means of many packed
// colours have no error where each has up to 0.4 %.
#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>

namespace relume {

// A code that no colour has which is less than 2^32.
inline constexpr std::uint32_t kNoColor = 0xFFFFFFFFu;

// The i-th of a sequence that is spread evenly over [0,1), whichever part of it is taken.
inline float ditherOf(std::uint32_t i) { return static_cast<float>((i * 2654435769u) >> 8) * 0x1p-24f; }

inline std::uint32_t packColor(const glm::vec3& rgb, float dither) {
  const float largest = std::max({rgb.r, rgb.g, rgb.b});
  const int exponent = std::clamp((std::bit_cast<std::int32_t>(largest) >> 23) - 95, 0, 63);
  const float scale = std::bit_cast<float>((167 - exponent) << 23);
  const auto part = [dither](float v, float max) {
    return static_cast<std::uint32_t>(std::clamp(v + dither, 0.0f, max));
  };
  return part(rgb.r * scale, 511.0f) | part(rgb.g * scale, 511.0f) << 9 | part(rgb.b * (0.5f * scale), 255.0f) << 18 |
         static_cast<std::uint32_t>(exponent) << 26;
}

inline glm::vec3 unpackColor(std::uint32_t bits) {
  const float scale = std::bit_cast<float>(((bits >> 26) + 87u) << 23);
  return {static_cast<float>(bits & 511u) * scale, static_cast<float>((bits >> 9) & 511u) * scale,
          static_cast<float>((bits >> 18) & 255u) * (2.0f * scale)};
}

}  // namespace relume
