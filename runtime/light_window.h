// SPDX-License-Identifier: MIT
// The window that ends a punctual light at its range, as both backends prepare it.
#pragma once

#include <algorithm>

namespace relume {

// 1 / range² [1/m²], which distances are multiplied with; 0 for a light without a range. It stays finite for ranges
// whose square no float holds, so that a distance of 0 has no product but 0.
inline float inverseRangeSquared(float range) {
  const float least = std::min(range, 1e18f);  // whose square a float holds: hosts may trap what overflows
  return range > 0.0f ? 1.0f / std::max(least * least, 1e-30f) : 0.0f;
}

}  // namespace relume
