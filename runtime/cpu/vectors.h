// SPDX-License-Identifier: MIT
// Vectors of RELUME_LANES (4, 8 or 16) floats for the kernels: each kernel is built once for each instruction set, by the
// file kernels_<set>.cpp, which defines RELUME_LANES and is compiled for that set. Everything is in an anonymous namespace
// and nothing comes from other headers' inline functions, so that no code for a newer processor is linked into an older's
// path.
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

// 1 / sqrt(v) to about 23 bits: the processor's estimate and one step of Newton's.
inline Floats inverseSqrt(Floats v) {
#if RELUME_LANES == 16
  const Floats e = (Floats)_mm512_maskz_rsqrt14_ps(kAll, (__m512)v);
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
inline Floats least(Floats a, Floats b) { return choose(a < b, a, b); }
inline Floats most(Floats a, Floats b) { return choose(a > b, a, b); }

inline Ints splatInt(std::int32_t v) { return v - Ints{}; }

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

// Red, green and blue of packed colours (runtime/pack_color.h).
inline void unpackColors(Ints bits, Floats& r, Floats& g, Floats& b) {
  const Floats scale = asFloats(((bits >> 3) & 0x1F800000) + (87 << 23));
  r = toFloats(bits & 511) * scale;
  g = toFloats((bits >> 9) & 511) * scale;
  b = toFloats((bits >> 18) & 255) * (scale + scale);
}

// packColor() of the colours of lanes whose dithers are given.
inline Ints packColors(Floats r, Floats g, Floats b, Floats dither) {
  const Floats largest = most(most(r, g), b);
  Ints exponent = (asInts(largest) >> 23) - 95;
  exponent = exponent & ~(exponent < 0);
  exponent = (exponent & (exponent < 63)) | (63 & ~(exponent < 63));
  const Floats scale = asFloats((167 - exponent) << 23);
  const auto part = [&dither](Floats v, float limit) __attribute__((always_inline)) {
    return __builtin_convertvector(least(most(v + dither, Floats{}), splat(limit)), Ints);
  };
  return part(r * scale, 511.0f) | part(g * scale, 511.0f) << 9 | part(b * (0.5f * scale), 255.0f) << 18 | exponent << 26;
}

// Y, Co, Cg of red, green, blue (formats/color.h).
inline void toYCoCg(Floats r, Floats g, Floats b, Floats& y, Floats& co, Floats& cg) {
  const Floats green = 0.5f * g, rest = 0.25f * (r + b);
  y = green + rest;
  co = 0.5f * (r - b);
  cg = green - rest;
}

// Unit direction of a packed octahedral one, kBits each of u and v from the lowest on (formats/pack.h, compact_links.h).
template <int kBits>
__attribute__((always_inline)) inline void unpackDirections(Ints bits, Floats& x, Floats& y, Floats& z) {
  const Ints signBit = Ints{} + INT32_MIN;
  constexpr float kScale = 1.0f / static_cast<float>((1 << (kBits - 1)) - 1);
  constexpr int kRest = 32 - kBits;
  const Floats u = toFloats((bits << kRest) >> kRest) * kScale, v = toFloats((bits << (kRest - kBits)) >> kRest) * kScale;
  const Floats absU = asFloats(asInts(u) & ~signBit), absV = asFloats(asInts(v) & ~signBit);
  const Floats w = 1.0f - absU - absV;
  // The lower half is folded outward: |u| and |v| shrink by as much as w lies below zero.
  const Floats fold = asFloats(asInts(-w) & (w < 0.0f));
  const Floats foldedU = u - asFloats(asInts(fold) | (asInts(u) & signBit));
  const Floats foldedV = v - asFloats(asInts(fold) | (asInts(v) & signBit));
  const Floats scale = inverseSqrt(foldedU * foldedU + foldedV * foldedV + w * w);
  x = foldedU * scale;
  y = foldedV * scale;
  z = w * scale;
}

}  // namespace
}  // namespace relume::cpu
