// SPDX-License-Identifier: MIT
// Light beyond what halves hold is dimmed as a whole: numbers that are clipped one by one are another colour from
// another direction. shaders/lib/pack.glsl is the same arithmetic.
#pragma once

#include "formats/pack.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace relume {

// A factor on numbers that belong together, the largest of which has that magnitude.
inline float halfScale(float largest) { return largest > kMaxHalf ? kMaxHalf / largest : 1.0f; }

inline float largestOf(std::span<const float> numbers, float largest = 0.0f) {
  for (const float v : numbers) largest = std::max(largest, std::abs(v));
  return largest;
}

}  // namespace relume
