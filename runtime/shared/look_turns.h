// SPDX-License-Identifier: MIT
// Which of the caches near moving parts are looked at in a frame (RelightOptions::movingLag): the less parts cover, the
// less often, so that what a part's step changes and is not yet seen is alike for all. shaders/occlude_links.comp has
// the same.
#pragma once

#include <cstdint>

namespace relume {

inline constexpr std::uint32_t kMaxMovingLag = 64;  // frames
// Caches of which parts cover more than this are looked at in every frame. [(radius / distance)², sum over parts]
inline constexpr float kCoveredEachFrame = 0.5f;

// frame: counted from one in which all were looked at. lag: a power of two [1..kMaxMovingLag]. Periods are powers of
// two as well: what becomes nearer or farther between two turns misses none.
inline bool isTurnOf(std::uint32_t cache, std::uint32_t frame, float covered, std::uint32_t lag) {
  std::uint32_t period = 1;
  while (period < lag && 2.0f * static_cast<float>(period) * covered <= kCoveredEachFrame) period *= 2;
  // Neighbours have their turns apart: the top 6 bits of a golden-ratio sequence.
  const std::uint32_t turn = (cache * 0x9E3779B9u) >> 26;
  return ((turn + frame) & (period - 1)) == 0;
}

}  // namespace relume
