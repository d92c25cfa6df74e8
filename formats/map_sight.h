// SPDX-License-Identifier: MIT
// Which of the four texels around a point of the light map it reads, where walls stand between them: words of
// Lightmap::sight. A line, or the corner of a room, parts the square between the texels' centres, and on either side a
// point is read from where it is, or from an edge or a corner of the square, so that a bilinear look-up has none of the
// texels beyond.
#pragma once

#include <glm/vec2.hpp>

#include <cstdint>

namespace relume {

// A word: bytes 0 to 2 say what lies beyond, byte 3 where points of either side go: four bits for the near side, four
// for what is beyond. Of the four bits two are for x and two for y: 0 stays, 1 goes to the lower texels, 2 to the upper
// ones; 3 is not used. With f the point's place in the square and the bytes in two's complement,
//   byte 2 not -128: beyond is where byte 0 (f.x - 0.5) + byte 1 (f.y - 0.5) > byte 2;
//   byte 2 -128: beyond is a quarter of the plane about the corner 0.5 + (floor(byte 0 / 2), floor(byte 1 / 2)) / 127,
//     above it along x where byte 0 is even and below where it is odd, along y likewise by byte 1.
inline constexpr std::uint32_t kSightStays = 0, kSightLower = 1, kSightUpper = 2;
inline constexpr int kSightQuarter = -128;  // byte 2

inline std::uint32_t packMapSight(int byte0, int byte1, int byte2, std::uint32_t near, std::uint32_t beyond) {
  const auto byte = [](int value) { return static_cast<std::uint32_t>(value) & 0xFFu; };
  return byte(byte0) | byte(byte1) << 8 | byte(byte2) << 16 | near << 24 | beyond << 28;
}

// Whether points of both sides have a place to go.
inline bool isMapSight(std::uint32_t word) { return (word & (word >> 1) & 0x55000000u) == 0; }

// Where a point is read; f: its place in the square [0..1], from the lower texels' centres to the upper ones'.
inline glm::vec2 placeInSight(std::uint32_t word, const glm::vec2& f) {
  const auto field = [word](int shift) {
    return static_cast<int>(static_cast<std::int8_t>(static_cast<std::uint8_t>(word >> shift)));
  };
  const int x = field(0), y = field(8), offset = field(16);
  const auto isAbove = [](int byte, float at) {
    return (at > 0.5f + static_cast<float>(byte >> 1) / 127.0f) == ((byte & 1) == 0);
  };
  const bool isBeyond =
      offset == kSightQuarter
          ? isAbove(x, f.x) && isAbove(y, f.y)
          : static_cast<float>(x) * (f.x - 0.5f) + static_cast<float>(y) * (f.y - 0.5f) > static_cast<float>(offset);
  const std::uint32_t moves = word >> (isBeyond ? 28 : 24);
  const auto along = [](std::uint32_t move, float stays) {
    return move == kSightStays ? stays : static_cast<float>(move - 1);
  };
  return {along(moves & 3u, f.x), along(moves >> 2 & 3u, f.y)};
}

}  // namespace relume
