// SPDX-License-Identifier: MIT
// Which of the four texels around a point of the light map it reads, where walls stand between them: words of
// Lightmap::sight. A line parts the square between the texels' centres, and on either side of it a point is read from
// where it is, or from an edge or a corner of the square, so that a bilinear look-up has none of the texels beyond.
#pragma once

#include <glm/vec2.hpp>

#include <cstdint>

namespace relume {

// A word: bytes 0 and 1 the line's normal, byte 2 its offset, two's complement each, and byte 3 where points of either
// side go: four bits for those on the line's near side, four for those beyond. Of the four bits two are for x and two
// for y: 0 stays, 1 goes to the lower texels, 2 to the upper ones; 3 is not used.
inline constexpr std::uint32_t kSightStays = 0, kSightLower = 1, kSightUpper = 2;

inline std::uint32_t packMapSight(int normalX, int normalY, int offset, std::uint32_t near, std::uint32_t beyond) {
  const auto byte = [](int value) { return static_cast<std::uint32_t>(value) & 0xFFu; };
  return byte(normalX) | byte(normalY) << 8 | byte(offset) << 16 | near << 24 | beyond << 28;
}

// Whether points of both sides have a place to go.
inline bool isMapSight(std::uint32_t word) { return (word & (word >> 1) & 0x55000000u) == 0; }

// Where a point is read; f: its place in the square [0..1], from the lower texels' centres to the upper ones'.
inline glm::vec2 placeInSight(std::uint32_t word, const glm::vec2& f) {
  const auto field = [word](int shift) {
    return static_cast<float>(static_cast<std::int8_t>(static_cast<std::uint8_t>(word >> shift)));
  };
  const bool isBeyond = field(0) * (f.x - 0.5f) + field(8) * (f.y - 0.5f) > field(16);
  const std::uint32_t moves = word >> (isBeyond ? 28 : 24);
  const auto along = [](std::uint32_t move, float stays) {
    return move == kSightStays ? stays : static_cast<float>(move - 1);
  };
  return {along(moves & 3u, f.x), along(moves >> 2 & 3u, f.y)};
}

}  // namespace relume
