// SPDX-License-Identifier: MIT
// Packed numbers of the file and the GPU: halves, octahedral directions, shared-exponent colours, normalised integers.
// shaders/lib/pack.glsl is the same arithmetic; a test runs both.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

namespace relume {

inline constexpr float kMaxHalf = 65504.0f;  // the largest number that a half holds
// IEEE 754 binary16, round to nearest even; overflow gives infinity, denormals are kept.
std::uint16_t packHalf(float value);
float unpackHalf(std::uint16_t half);

// Unit direction on the octahedron, two 16-bit signed normalised integers (x in the low half). The zero vector is
// stored as kNoDirection and comes back as zero. Error below 0.0002 rad.
inline constexpr std::uint32_t kNoDirection = 0x80008000u;
std::uint32_t packOctahedral(const glm::vec3& direction);
glm::vec3 unpackOctahedral(std::uint32_t bits);

// Point of [0,1]² as two 16-bit unsigned normalised integers (x in the low half).
std::uint32_t packUnorm16x2(const glm::vec2& value);
glm::vec2 unpackUnorm16x2(std::uint32_t bits);

}  // namespace relume
