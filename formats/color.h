// SPDX-License-Identifier: MIT
// Colour transforms that baker, runtime and shaders agree on (shaders/lib/color.glsl is the same arithmetic).
#pragma once

#include <glm/vec3.hpp>

#include <cmath>

namespace relume {

// PIC Eq. (7) = CRC Eq. (5): Y = (R+2G+B)/4, Co = (R-B)/2, Cg = (-R+2G-B)/4, returned as (Y, Co, Cg). Linear; the
// inverse is exact. Any linear unit.
inline glm::vec3 rgbToYCoCg(const glm::vec3& c) {
  return {0.25f * c.r + 0.5f * c.g + 0.25f * c.b, 0.5f * (c.r - c.b), -0.25f * c.r + 0.5f * c.g - 0.25f * c.b};
}

inline glm::vec3 yCoCgToRgb(const glm::vec3& c) {
  const float t = c.x - c.z;
  return {t + c.y, c.x + c.z, t - c.y};
}

// Relative luminance of linear sRGB (Rec. 709 primaries): of colours, or of as many at once as a vector has lanes.
template <class Channel>
Channel luminance(Channel r, Channel g, Channel b) {
  return 0.2126f * r + 0.7152f * g + 0.0722f * b;
}
inline float luminance(const glm::vec3& c) { return luminance(c.r, c.g, c.b); }

// IEC 61966-2-1 transfer functions. [0..1]
inline float srgbToLinear(float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); }
inline float linearToSrgb(float v) { return v <= 0.0031308f ? v * 12.92f : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f; }

}  // namespace relume
