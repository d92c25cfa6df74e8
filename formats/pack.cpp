// SPDX-License-Identifier: MIT
// Packed numbers; see pack.h.
#include "formats/pack.h"

#include "formats/octahedron.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace relume {
namespace {

std::uint32_t snorm16(float v) {
  return static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lrint(std::clamp(v, -1.0f, 1.0f) * 32767.0f)));
}

float fromSnorm16(std::uint32_t bits) {
  return std::max(static_cast<float>(static_cast<std::int16_t>(bits & 0xFFFFu)) / 32767.0f, -1.0f);
}

std::uint32_t unorm(float v, float scale) {
  return static_cast<std::uint32_t>(std::lrint(std::clamp(v, 0.0f, 1.0f) * scale));
}

}  // namespace

std::uint16_t packHalf(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sign = (bits >> 16) & 0x8000u;
  const std::uint32_t magnitude = bits & 0x7FFFFFFFu;
  if (magnitude > 0x7F800000u) return static_cast<std::uint16_t>(sign | 0x7E00u);
  if (magnitude >= 0x47800000u) return static_cast<std::uint16_t>(sign | 0x7C00u);
  if (magnitude < 0x38800000u) {
    // Denormal halves are multiples of 2^-24: let the float unit round.
    const float scaled = std::bit_cast<float>(magnitude) * 16777216.0f;
    return static_cast<std::uint16_t>(sign | static_cast<std::uint32_t>(std::lrint(scaled)));
  }
  const std::uint32_t rounded = magnitude + 0x0FFFu + ((magnitude >> 13) & 1u);
  return static_cast<std::uint16_t>(sign | ((rounded - 0x38000000u) >> 13));
}

float unpackHalf(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
  const std::uint32_t magnitude = half & 0x7FFFu;
  if (magnitude >= 0x7C00u) return std::bit_cast<float>(sign | 0x7F800000u | ((magnitude & 0x3FFu) << 13));
  if (magnitude < 0x0400u) {
    const float value = static_cast<float>(magnitude) * 5.9604644775390625e-8f;
    return sign ? -value : value;
  }
  return std::bit_cast<float>(sign | ((magnitude << 13) + 0x38000000u));
}

std::uint32_t packOctahedral(const glm::vec3& d) {
  if (!(std::abs(d.x) + std::abs(d.y) + std::abs(d.z) > 0.0f)) return kNoDirection;  // NaN, too
  const glm::vec2 p = toOctahedron(d);
  return snorm16(p.x) | (snorm16(p.y) << 16);
}

glm::vec3 unpackOctahedral(std::uint32_t bits) {
  if (bits == kNoDirection) return glm::vec3(0.0f);
  return fromOctahedron(glm::vec2(fromSnorm16(bits), fromSnorm16(bits >> 16)));
}

std::uint32_t packUnorm16x2(const glm::vec2& v) { return unorm(v.x, 65535.0f) | (unorm(v.y, 65535.0f) << 16); }

glm::vec2 unpackUnorm16x2(std::uint32_t bits) {
  return {static_cast<float>(bits & 0xFFFFu) / 65535.0f, static_cast<float>(bits >> 16) / 65535.0f};
}

}  // namespace relume
