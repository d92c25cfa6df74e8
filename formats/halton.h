// SPDX-License-Identifier: MIT
// The Halton sequence of PIC 4.2 and CRC 2.2. Any thread.
#pragma once

#include <cstdint>

namespace relume {

// Radical inverse of index in a prime base: one axis of the sequence (Halton and Smith 1964). [0, 1)
constexpr double radicalInverse(std::uint32_t base, std::uint64_t index) {
  double inverse = 1.0 / base, scale = inverse, value = 0.0;
  for (; index > 0; index /= base, scale *= inverse) value += static_cast<double>(index % base) * scale;
  return value;
}

}  // namespace relume
