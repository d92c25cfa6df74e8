// SPDX-License-Identifier: MIT
// Light of three channels in six bytes: 13 bits each and one power of two, so that a channel is off by at most 2^-13 of
// the largest one. Rounded to the nearest: what has been rounded stays as it is, and the larger of two stays so.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace relume {

class PackedLight {
 public:
  PackedLight() = default;
  // Channels below zero, and those that are no number, become zero.
  explicit PackedLight(const glm::vec3& light) {
    const auto positive = [](float v) { return v > 0.0f ? std::min(v, kMost) : 0.0f; };
    const glm::vec3 v(positive(light.x), positive(light.y), positive(light.z));
    const float largest = std::max({v.x, v.y, v.z});
    // The exponent of the largest, less thirteen bits; one more where it rounds up to 2^13.
    auto power = static_cast<std::uint32_t>(
        std::max(static_cast<int>(std::bit_cast<std::uint32_t>(largest) >> 23) - kBits - kLeast + 1, 0));
    if (largest * inverseOf(power) + 0.5f >= static_cast<float>(1u << kBits)) ++power;
    const float inverse = inverseOf(power);
    for (std::size_t k = 0; k < 3; ++k) {
      const float steps = v[static_cast<int>(k)] * inverse + 0.5f;  // rounded as it is cut
      bits_[k] = static_cast<std::uint16_t>(static_cast<std::uint32_t>(steps) | (power >> 3 * k & 7u) << kBits);
    }
  }

  glm::vec3 value() const {
    constexpr std::uint32_t kMask = (1u << kBits) - 1;
    const std::uint32_t x = bits_[0], y = bits_[1], z = bits_[2];
    return stepOf(x >> kBits | y >> kBits << 3 | z >> kBits << 6) * glm::vec3(x & kMask, y & kMask, z & kMask);
  }
  bool operator==(const PackedLight&) const = default;

 private:
  static constexpr int kBits = 13, kLeast = 1;  // of a channel; the exponent of step 0, as a float has it
  static constexpr float kMost = 0x1p+126f;

  static float stepOf(std::uint32_t power) { return std::bit_cast<float>((power + kLeast) << 23); }
  static float inverseOf(std::uint32_t power) { return std::bit_cast<float>((254 - kLeast - power) << 23); }

  std::array<std::uint16_t, 3> bits_{};  // of a channel, and above them three of the power
};
static_assert(sizeof(PackedLight) == 6);

}  // namespace relume
