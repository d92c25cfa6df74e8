// SPDX-License-Identifier: MIT
// Items of random streams for what stands at a place. They stay as they are where others of its kind come or go; with
// numbers by index an edit would change all that come after it.
#pragma once

#include "bake/base/random.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <bit>
#include <cstdint>

namespace relume {

// Of the bits of a place and of which way it faces; not random by itself where places are few.
constexpr std::uint64_t placeNumber(const glm::vec3& positionWorld, const glm::vec3& normal) {
  const auto pair = [](float a, float b) {
    return std::uint64_t{std::bit_cast<std::uint32_t>(a)} << 32 | std::bit_cast<std::uint32_t>(b);
  };
  return hashCombine(hashCombine(pair(positionWorld.x, positionWorld.y), pair(positionWorld.z, normal.x)),
                     pair(normal.y, normal.z));
}

// Of the bits of where an instance stands. [object units -> m]
constexpr std::uint64_t placeNumber(const glm::mat4& toWorld) {
  return hashCombine(placeNumber(glm::vec3(toWorld[0]), glm::vec3(toWorld[1])),
                     placeNumber(glm::vec3(toWorld[2]), glm::vec3(toWorld[3])));
}

}  // namespace relume
