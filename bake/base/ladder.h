// SPDX-License-Identifier: MIT
// Sizes that follow from a whole level, as its area or what is seen of it, are taken from a ladder of fixed steps: an
// edit that changes them by a little mostly leaves them as they are, and with them everything that it does not touch.
#pragma once

#include <cmath>

namespace relume {

// The nearest of the sizes that divide each octave evenly, so many of them. size > 0
inline double onLadder(double size, double perOctave) {
  return std::exp2(std::round(std::log2(size) * perOctave) / perOctave);
}

// The largest of them that is not above the size. size > 0
inline double onLadderBelow(double size, double perOctave) {
  return std::exp2(std::floor(std::log2(size) * perOctave) / perOctave);
}

}  // namespace relume
