// SPDX-License-Identifier: MIT
// Coefficients of caches as StoredLight keeps them, as plain memory. No other header is included here: the kernels of
// the CPU backend read this, and no inline function may be compiled for a newer processor and linked into everyone's
// path.
#pragma once

#include <cstdint>

namespace relume {

// Rows of 16-bit words, one for each cache: the biased exponent of a float that is the row's unit, then the
// coefficients of Y, Co and Cg as signed whole numbers of it. An even number of words, so that a row begins at a
// multiple of four bytes.
template <class Word>
struct LightRowsOf {
  Word* word = nullptr;                          // of cache `first`; kernels may read kLightRowRoom words past the last
  std::uint32_t first = 0;                       // cache
  std::uint32_t words = 0;                       // of a row
  std::uint32_t lumaCount = 0, chromaCount = 0;  // coefficients of Y, and of Co and Cg each
};
using LightRows = LightRowsOf<const std::uint16_t>;

constexpr std::uint32_t kLightRowRoom = 32;
// The largest coefficient of a row has this many bits behind its leading one.
constexpr int kLightBits = 14;

}  // namespace relume
