// SPDX-License-Identifier: MIT
// Vectors of RELUME_LANES (4, 8 or 16) floats for the kernels: each kernel is built once for each instruction set, by
// the file kernels_<set>.cpp, which defines RELUME_LANES and is compiled for that set. Everything is in an anonymous
// namespace and nothing comes from other headers' inline functions, so that no code for a newer processor is linked
// into an older's path.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace relume::cpu {
namespace {

constexpr int kLanes = RELUME_LANES;
typedef float Floats __attribute__((vector_size(4 * RELUME_LANES)));
typedef std::int32_t Ints __attribute__((vector_size(4 * RELUME_LANES)));
typedef float Float4 __attribute__((vector_size(16)));
#if RELUME_LANES > 4
typedef float Float8 __attribute__((vector_size(32)));
#endif
#if RELUME_LANES == 16
// Zero-masked intrinsics with every lane on: the plain ones start from an undefined vector, which g++ 12 warns of.
constexpr __mmask16 kAll = 0xFFFF;
#endif

template <class V>
inline V load(const void* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

inline void store(float* to, Floats v) { __builtin_memcpy(to, &v, sizeof v); }

inline Floats splat(float v) { return v - Floats{}; }

inline Floats asFloats(Ints v) { return load<Floats>(&v); }
inline Ints asInts(Floats v) { return load<Ints>(&v); }

inline Floats toFloats(Ints v) { return __builtin_convertvector(v, Floats); }

inline float sumLanes(Floats v) {
#if RELUME_LANES == 16
  const Float8 h = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
                   __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
  const Float4 q = __builtin_shufflevector(h, h, 0, 1, 2, 3) + __builtin_shufflevector(h, h, 4, 5, 6, 7);
#elif RELUME_LANES == 8
  const Float4 q = __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
#else
  const Float4 q = v;
#endif
  return (q[0] + q[2]) + (q[1] + q[3]);
}

// The half in the low 16 bits of each lane; the others are ignored.
inline Floats halfToFloat(Ints bits) {
#if RELUME_LANES == 16
  return (Floats)_mm512_maskz_cvtph_ps(kAll, _mm512_maskz_cvtepi32_epi16(kAll, (__m512i)bits));
#else
  const Ints magnitude = bits & 0x7FFF, sign = (bits & 0x8000) << 16;
  const Floats normal = asFloats((magnitude << 13) + (112 << 23));
  // Denormal halves: let the subtraction of 2^-14 shift the leading one out.
  const Floats denormal = asFloats((magnitude << 13) + (113 << 23)) - 6.103515625e-05f;
  const Ints isDenormal = magnitude < 0x0400;
  return asFloats((isDenormal & asInts(denormal)) | (~isDenormal & asInts(normal)) | sign);
#endif
}

// Halves widened.
typedef std::uint16_t Halves __attribute__((vector_size(2 * RELUME_LANES)));
inline Floats halvesToFloats(Halves halves) {
#if RELUME_LANES == 16
  return (Floats)_mm512_maskz_cvtph_ps(kAll, (__m256i)halves);
#elif RELUME_LANES == 8 && defined(__F16C__)
  return (Floats)_mm256_cvtph_ps((__m128i)halves);
#else
  return halfToFloat(__builtin_convertvector(halves, Ints));
#endif
}

typedef std::uint8_t Bytes __attribute__((vector_size(RELUME_LANES)));
// The first `count` of the bytes, then zeros. All of them may be read.
inline Bytes loadFirstBytes(const std::uint8_t* from, int count) {
#if RELUME_LANES == 16
  return (Bytes)_mm_maskz_loadu_epi8(static_cast<__mmask16>(count < kLanes ? (1u << count) - 1 : 0xFFFFu), from);
#else
  Bytes bytes = load<Bytes>(from);
  for (int i = count; i < kLanes; ++i) bytes[i] = 0;
  return bytes;
#endif
}
#if RELUME_LANES == 16
// g++ 12 converts bytes to words one by one.
inline Ints bytesToInts(Bytes bytes) { return (Ints)_mm512_maskz_cvtepu8_epi32(kAll, (__m128i)bytes); }
#endif
inline Halves bytesToHalves(Bytes bytes) {
#if RELUME_LANES == 16
  return (Halves)_mm256_cvtepu8_epi16((__m128i)bytes);
#else
  return __builtin_convertvector(bytes, Halves);
#endif
}

#if RELUME_LANES == 16
// 1 / sqrt(v) to 14 bits.
inline Floats roughInverseSqrt(Floats v) { return (Floats)_mm512_maskz_rsqrt14_ps(kAll, (__m512)v); }
#endif

// 1 / sqrt(v) to about 23 bits: the processor's estimate and one step of Newton's.
inline Floats inverseSqrt(Floats v) {
#if RELUME_LANES == 16
  const Floats e = roughInverseSqrt(v);
#elif RELUME_LANES == 8 && defined(__AVX__)
  const Floats e = (Floats)_mm256_rsqrt_ps((__m256)v);
#elif defined(__SSE2__)
  const Floats e = (Floats)_mm_rsqrt_ps((__m128)v);
#else
  Floats e = v;
  for (int i = 0; i < kLanes; ++i) e[i] = 1.0f / __builtin_sqrtf(v[i]);
#endif
  return e * (1.5f - 0.5f * v * e * e);
}

// Where a mask is on, a, else b.
inline Floats choose(Ints mask, Floats a, Floats b) { return asFloats((mask & asInts(a)) | (~mask & asInts(b))); }

inline Floats min(Floats a, Floats b) {
#if RELUME_LANES == 16
  return (Floats)_mm512_maskz_min_ps(kAll, (__m512)a, (__m512)b);
#elif RELUME_LANES == 8 && defined(__AVX__)
  return (Floats)_mm256_min_ps((__m256)a, (__m256)b);
#elif RELUME_LANES == 4 && defined(__SSE2__)
  return (Floats)_mm_min_ps((__m128)a, (__m128)b);
#else
  return choose(a < b, a, b);
#endif
}

inline Floats max(Floats a, Floats b) {
#if RELUME_LANES == 16
  return (Floats)_mm512_maskz_max_ps(kAll, (__m512)a, (__m512)b);
#elif RELUME_LANES == 8 && defined(__AVX__)
  return (Floats)_mm256_max_ps((__m256)a, (__m256)b);
#elif RELUME_LANES == 4 && defined(__SSE2__)
  return (Floats)_mm_max_ps((__m128)a, (__m128)b);
#else
  return choose(a > b, a, b);
#endif
}

// a, no larger than the limit in size. [limit >= 0]
inline Floats limitSize(Floats a, Floats limit) {
#if RELUME_LANES == 16
  constexpr int kLesserSizeSignOfFirst = 2;
  return (Floats)_mm512_maskz_range_ps(kAll, (__m512)a, (__m512)limit, kLesserSizeSignOfFirst);
#else
  const Ints signBit = Ints{} + INT32_MIN;
  return asFloats(asInts(min(asFloats(asInts(a) & ~signBit), limit)) | (asInts(a) & signBit));
#endif
}

inline Ints splatInt(std::int32_t v) { return v - Ints{}; }

inline Ints laneNumbers() {
  Ints v;
  for (int i = 0; i < kLanes; ++i) v[i] = i;
  return v;
}

// The words at these indices.
inline Ints gather(const std::uint32_t* from, Ints index) {
#if RELUME_LANES == 16
  return (Ints)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), kAll, (__m512i)index, from, 4);
#else
  Ints v;
  for (int i = 0; i < kLanes; ++i) v[i] = static_cast<std::int32_t>(from[index[i]]);
  return v;
#endif
}

// The same, of indices in memory.
inline Ints gather(const std::uint32_t* from, const std::uint32_t* index) {
#if RELUME_LANES == 16
  return gather(from, load<Ints>(index));
#else
  Ints v;
  for (int i = 0; i < kLanes; ++i) v[i] = static_cast<std::int32_t>(from[index[i]]);
  return v;
#endif
}

// Red, green and blue of packed colours (runtime/shared/pack_color.h).
inline void unpackColors(Ints bits, Floats& r, Floats& g, Floats& b) {
  const Floats scale = asFloats(((bits >> 3) & 0x1F800000) + (87 << 23));
  r = toFloats(bits & 511) * scale;
  g = toFloats((bits >> 9) & 511) * scale;
  b = toFloats((bits >> 18) & 255) * (scale + scale);
}

// packColor() of the colours of lanes whose dithers are given.
inline Ints packColors(Floats r, Floats g, Floats b, Floats dither) {
  const Floats largest = max(max(r, g), b);
  Ints exponent = (asInts(largest) >> 23) - 95;
  exponent = exponent & ~(exponent < 0);
  exponent = (exponent & (exponent < 63)) | (63 & ~(exponent < 63));
  const Floats scale = asFloats((167 - exponent) << 23);
  const auto part = [&dither](Floats v, float limit) __attribute__((always_inline)) {
    return __builtin_convertvector(min(max(v + dither, Floats{}), splat(limit)), Ints);
  };
  return part(r * scale, 511.0f) | part(g * scale, 511.0f) << 9 | part(b * (0.5f * scale), 255.0f) << 18 |
         exponent << 26;
}

// Y, Co, Cg of red, green, blue (formats/color.h).
inline void toYCoCg(Floats r, Floats g, Floats b, Floats& y, Floats& co, Floats& cg) {
  const Floats green = 0.5f * g, rest = 0.25f * (r + b);
  y = green + rest;
  co = 0.5f * (r - b);
  cg = green - rest;
}

// 4 Y, 2 Co and 4 Cg of packed colours (formats/color.h) whose channels are multiples of `scale`: sums of their bits.
__attribute__((always_inline)) inline void colorsInUnits(Ints bits, Floats scale, Floats* color) {
  const Ints red = bits & 511, green2 = (bits >> 8) & 1022, blue2 = (bits >> 17) & 510;
  const Ints redBlue = red + blue2;
  color[0] = toFloats(green2 + redBlue) * scale;
  color[1] = toFloats(red - blue2) * scale;
  color[2] = toFloats(green2 - redBlue) * scale;
}

// The same times f.
__attribute__((always_inline)) inline void scaledColors(Ints bits, Floats f, Floats* color) {
  colorsInUnits(bits, asFloats(((bits >> 3) & 0x1F800000) + (87 << 23)) * f, color);
}

// Unit direction of a packed octahedral one, kBits each of u and v from bit kFrom on (formats/pack.h, compact_links.h).
template <int kBits, int kFrom = 0>
__attribute__((always_inline)) inline void unpackDirections(Ints bits, Floats& x, Floats& y, Floats& z) {
  const Ints signBit = Ints{} + INT32_MIN;
  constexpr float kOne = static_cast<float>((1 << (kBits - 1)) - 1);
  constexpr int kRest = 32 - kBits;
  const Floats u = toFloats((bits << (kRest - kFrom)) >> kRest),
               v = toFloats((bits << (kRest - kBits - kFrom)) >> kRest);
  const Floats sizeV = asFloats(asInts(v) & ~signBit), restU = kOne - asFloats(asInts(u) & ~signBit),
               restV = kOne - sizeV;
  const Floats w = restU - sizeV;
  // The lower half is folded outward: |u| becomes what |v| leaves, and |v| what |u| leaves, where that is less.
  const Floats foldedU = limitSize(u, restV), foldedV = limitSize(v, restU);
  const Floats lengthSquared = foldedU * foldedU + foldedV * foldedV + w * w;
#if RELUME_LANES == 16
  // 14 bits of a direction that has six.
  const Floats scale = kBits <= 6 ? roughInverseSqrt(lengthSquared) : inverseSqrt(lengthSquared);
#else
  const Floats scale = inverseSqrt(lengthSquared);
#endif
  x = foldedU * scale;
  y = foldedV * scale;
  z = w * scale;
}

}  // namespace
}  // namespace relume::cpu
