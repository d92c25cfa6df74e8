// SPDX-License-Identifier: MIT
// A surfel as both backends read it every frame, 16 bytes in four words:
//   0      position x, y          16 bits each, within the surfels' box
//   1      position z, red        16 bits; albedo 8 bits in bits 16-23, green in bits 24-31
//   2      normal, blue           octahedral, 12 bits each of u and v, signed; albedo 8 bits in bits 24-31
//   3      receiver               Surfels::receiver
// Positions are rounded away from the surface, so that shadow rays which start from them do not begin behind it: by at
// most 1/65535 of the box along an axis, half a millimetre in a level of 30 m. Albedo is dithered (pack_color.h): the
// mean of many surfels is exact. Emission, which few surfels have, is kept apart.
#pragma once

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>

namespace relume {

struct SurfelBox {
  glm::vec3 origin{0.0f};  // [m]
  glm::vec3 step{0.0f};    // [m] of a position's unit
};

using SurfelWords = std::array<std::uint32_t, 4>;

// Of a disc of that area. [m]
inline float discRadius(float area) { return std::sqrt(area / std::numbers::pi_v<float>); }

inline SurfelBox boxOf(std::span<const glm::vec3> positions) {
  if (positions.empty()) return {};
  glm::vec3 low = positions[0], high = positions[0];
  for (const glm::vec3& p : positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return {low, (high - low) / 65535.0f};
}

// Words 0 to 2 (of a surfel with unit normal), and the receiver as it is.
inline SurfelWords packSurfel(const SurfelBox& box, const glm::vec3& position, const glm::vec3& normal,
                              const glm::vec3& albedo, std::uint32_t receiver, float dither) {
  glm::uvec3 p(0u);
  for (int k = 0; k < 3; ++k) {
    // Up, down, or to the nearest, but for the quotient's own rounding.
    const float up = normal[k] > 0.01f ? 0.99f : (normal[k] < -0.01f ? 0.01f : 0.5f);
    if (box.step[k] > 0.0f)
      p[k] = static_cast<std::uint32_t>(glm::clamp((position[k] - box.origin[k]) / box.step[k] + up, 0.0f, 65535.0f));
  }
  const auto byte = [dither](float v) {
    return static_cast<std::uint32_t>(glm::clamp(v * 255.0f + dither, 0.0f, 255.0f));
  };
  const glm::vec3 d = normal / (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z));
  glm::vec2 uv(d.x, d.y);
  if (d.z < 0.0f)
    uv = {(1.0f - std::abs(d.y)) * (d.x < 0.0f ? -1.0f : 1.0f), (1.0f - std::abs(d.x)) * (d.y < 0.0f ? -1.0f : 1.0f)};
  const auto snorm = [](float v) {
    return static_cast<std::uint32_t>(std::lrint(glm::clamp(v, -1.0f, 1.0f) * 2047.0f)) & 0xFFFu;
  };
  return {p.x | p.y << 16, p.z | byte(albedo.r) << 16 | byte(albedo.g) << 24,
          snorm(uv.x) | snorm(uv.y) << 12 | byte(albedo.b) << 24, receiver};
}

}  // namespace relume
