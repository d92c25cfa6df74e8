// SPDX-License-Identifier: MIT
// Rows of runtime/shared/light_rows.h in vectors: how a cache's coefficients are rounded into one, and read from it.
#pragma once

#include "runtime/cpu/vectors.h"
#include "runtime/shared/light_rows.h"

namespace relume::cpu {
namespace {

template <int kCount>
using ShortsOf = typename VectorOf<std::int16_t, kCount>::type;

// kCount words from `at` on, as numbers.
template <int kCount>
__attribute__((always_inline)) inline FloatsOf<kCount> loadWords(const std::uint16_t* at) {
#if RELUME_LANES == 16
  if constexpr (kCount == 16)
    return toFloats((IntsOf<16>)_mm512_maskz_cvtepi16_epi32(kAll, (__m256i)load<ShortsOf<16>>(at)));
#endif
#if defined(__AVX2__)
  // g++ 12 widens the halves one by one.
  if constexpr (kCount == 8) return toFloats((IntsOf<8>)_mm256_cvtepi16_epi32((__m128i)load<ShortsOf<8>>(at)));
#endif
  return __builtin_convertvector(__builtin_convertvector(load<ShortsOf<kCount>>(at), IntsOf<kCount>), FloatsOf<kCount>);
}

inline float wordAt(const std::uint16_t* at) { return static_cast<float>(static_cast<std::int16_t>(*at)); }

inline const std::uint16_t* rowOf(const LightRows& rows, std::uint32_t cache) {
  return rows.word + std::size_t{rows.words} * (cache - rows.first);
}

// What the words of a row count.
inline float unitOf(const std::uint16_t* row) {
  const std::uint32_t bits = std::uint32_t{*row} << 23;
  float unit;
  __builtin_memcpy(&unit, &bits, sizeof unit);
  return unit;
}

// The same of rows that begin at these pairs of words.
inline Floats unitsOf(const LightRows& rows, Ints pair) {
  return asFloats((gather(reinterpret_cast<const std::uint32_t*>(rows.word), pair) & 0xFFFF) << 23);
}

// Nearest whole numbers of kLanes floats as words.
__attribute__((always_inline)) inline ShortsOf<kLanes> roundToWords(Floats v) {
#if RELUME_LANES == 16
  return (ShortsOf<kLanes>)_mm512_maskz_cvtsepi32_epi16(kAll, _mm512_maskz_cvtps_epi32(kAll, (__m512)v));
#else
  // Added to a small number, this leaves no bits behind the point.
  constexpr float kRound = 12582912.0f;
  constexpr std::int32_t kRoundBits = 0x4B400000;
  const Floats rounded = min(max(v, splat(-32767.0f)), splat(32767.0f)) + kRound;
  return __builtin_convertvector(asInts(rounded) - kRoundBits, ShortsOf<kLanes>);
#endif
}

// Rounds a cache's coefficients into its row. mayFollow: whether anything may be written in kLanes words behind it.
// [Size c >= count, rounded up to whole vectors, zeros at the end]
__attribute__((always_inline)) inline void storeRow(const float* c, int count, bool mayFollow, std::uint16_t* row) {
  Floats sizes{};
  for (int i = 0; i < count; i += kLanes) sizes = max(sizes, magnitude(load<Floats>(c + i)));
  const float largest = maxLane(sizes);
  std::int32_t bits;
  __builtin_memcpy(&bits, &largest, sizeof bits);
  // Exponents of floats are biased by 127; that of 1 / unit is then 254 less the unit's.
  const std::int32_t exponent = max((bits >> 23) - kLightBits, 1), inverse = (254 - exponent) << 23;
  float scale;
  __builtin_memcpy(&scale, &inverse, sizeof scale);
  *row++ = static_cast<std::uint16_t>(exponent);
  for (int i = 0; i < count; i += kLanes) {
    const ShortsOf<kLanes> words = roundToWords(load<Floats>(c + i) * scale);
    if (mayFollow || count - i >= kLanes) {
      store(row + i, words);
    } else {
      __builtin_memcpy(row + i, &words, sizeof(std::uint16_t) * static_cast<std::size_t>(count - i));
    }
  }
}

}  // namespace
}  // namespace relume::cpu
