// SPDX-License-Identifier: MIT
// Packed radiosity of a node, 8 bytes: shaders/lib/pack.glsl in C++.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

namespace relume::gl {

struct PackedNode {
  std::uint32_t y = 0;       // float
  std::uint32_t chroma = 0;  // Co / 2Y in the low, Cg / Y in the high 16 bits, signed normalised
};

// (Y, Co, Cg) of a colour without negative parts: then |Co| <= 2 Y and |Cg| <= Y.
inline PackedNode packNode(const glm::vec3& yCoCg) {
  if (!(yCoCg.x > 0.0f)) return {};
  const auto snorm = [](float v) {
    return static_cast<std::uint32_t>(std::lrint(glm::clamp(v, -1.0f, 1.0f) * 32767.0f)) & 0xFFFFu;
  };
  return {std::bit_cast<std::uint32_t>(yCoCg.x), snorm(yCoCg.y / (2.0f * yCoCg.x)) | snorm(yCoCg.z / yCoCg.x) << 16};
}

inline glm::vec3 unpackNode(const PackedNode& node) {
  const float y = std::bit_cast<float>(node.y);
  const auto part = [](std::uint32_t bits) {
    return glm::max(static_cast<float>(static_cast<std::int16_t>(bits & 0xFFFFu)) / 32767.0f, -1.0f);
  };
  return {y, 2.0f * y * part(node.chroma), y * part(node.chroma >> 16)};
}

}  // namespace relume::gl
