// SPDX-License-Identifier: MIT
// Vectors of 4, 8 or 16 floats, ints or bytes for the kernels of the runtime and the rays of the baker. A kernel is
// built once for each instruction set, by a source file that is compiled for that set; how many lanes it has is the
// template parameter of FloatsOf and its siblings, and the functions below deduce it from their arguments.
//
// Where a set has an instruction for what a function does, the instruction gives the same bits as the plain code,
// except for inverseSqrt() and roughInverseSqrt(). Everything is in an anonymous namespace and calls no inline function
// of other headers, so that the linker never takes code for a newer processor into an older one's path.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

namespace relume {
namespace {

template <class Number, int kCount>
struct VectorOf {
  typedef Number type __attribute__((vector_size(sizeof(Number) * kCount)));
};
template <int kLanes>
using FloatsOf = typename VectorOf<float, kLanes>::type;
template <int kLanes>
using IntsOf = typename VectorOf<std::int32_t, kLanes>::type;
template <int kLanes>
using HalvesOf = typename VectorOf<std::uint16_t, kLanes>::type;
template <int kLanes>
using BytesOf = typename VectorOf<std::uint8_t, kLanes>::type;
using Float4 = FloatsOf<4>;

// Lanes of a vector of floats or ints.
template <class V>
constexpr int kLanesOf = sizeof(V) / 4;

#if defined(__AVX512F__)
// Zero-masked intrinsics with every lane on: the plain ones start from an undefined vector, which g++ 12 warns of.
constexpr __mmask16 kAll = 0xFFFF;
#endif

template <class V>
inline V load(const void* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

template <class V>
inline void store(void* to, V v) {
  __builtin_memcpy(to, &v, sizeof v);
}

// The number in every lane.
template <class V, class Number>
inline V splat(Number v) {
  return v - V{};
}

// 0, 1, 2, ...
template <class Ints>
inline Ints laneNumbers() {
  Ints v;
  for (int i = 0; i < kLanesOf<Ints>; ++i) v[i] = i;
  return v;
}

template <class Ints>
inline FloatsOf<kLanesOf<Ints>> asFloats(Ints v) {
  return load<FloatsOf<kLanesOf<Ints>>>(&v);
}

template <class Floats>
inline IntsOf<kLanesOf<Floats>> asInts(Floats v) {
  return load<IntsOf<kLanesOf<Floats>>>(&v);
}

template <class Ints>
inline FloatsOf<kLanesOf<Ints>> toFloats(Ints v) {
  return __builtin_convertvector(v, FloatsOf<kLanesOf<Ints>>);
}

template <class Floats>
inline float sumLanes(Floats v) {
  if constexpr (kLanesOf<Floats> == 16) {
    return sumLanes(FloatsOf<8>(__builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
                                __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15)));
  } else if constexpr (kLanesOf<Floats> == 8) {
    return sumLanes(Float4(__builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7)));
  } else {
    return (v[0] + v[2]) + (v[1] + v[3]);
  }
}

// Where a mask is on, a, else b.
template <class Ints, class Floats>
inline Floats choose(Ints mask, Floats a, Floats b) {
  return asFloats((mask & asInts(a)) | (~mask & asInts(b)));
}

// Of vectors, lane by lane, or of numbers: a < b ? a : b, which is b where either is NaN.
template <class V>
inline V min(V a, V b) {
#if defined(__AVX512F__)
  if constexpr (__is_same(V, FloatsOf<16>)) return (V)_mm512_maskz_min_ps(kAll, (__m512)a, (__m512)b);
#endif
#if defined(__AVX__)
  if constexpr (__is_same(V, FloatsOf<8>)) return (V)_mm256_min_ps((__m256)a, (__m256)b);
#endif
#if defined(__SSE2__)
  if constexpr (__is_same(V, FloatsOf<4>)) return (V)_mm_min_ps((__m128)a, (__m128)b);
#elif defined(__wasm_simd128__)
  if constexpr (__is_same(V, FloatsOf<4>)) return (V)wasm_f32x4_pmin((v128_t)b, (v128_t)a);
#endif
  return a < b ? a : b;
}

// The same: a > b ? a : b.
template <class V>
inline V max(V a, V b) {
#if defined(__AVX512F__)
  if constexpr (__is_same(V, FloatsOf<16>)) return (V)_mm512_maskz_max_ps(kAll, (__m512)a, (__m512)b);
#endif
#if defined(__AVX__)
  if constexpr (__is_same(V, FloatsOf<8>)) return (V)_mm256_max_ps((__m256)a, (__m256)b);
#endif
#if defined(__SSE2__)
  if constexpr (__is_same(V, FloatsOf<4>)) return (V)_mm_max_ps((__m128)a, (__m128)b);
#elif defined(__wasm_simd128__)
  if constexpr (__is_same(V, FloatsOf<4>)) return (V)wasm_f32x4_pmax((v128_t)b, (v128_t)a);
#endif
  return a > b ? a : b;
}

// The largest lane. None is NaN.
template <class Floats>
inline float maxLane(Floats v) {
  if constexpr (kLanesOf<Floats> == 16) {
    return maxLane(max(FloatsOf<8>(__builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7)),
                       FloatsOf<8>(__builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15))));
  }
#if defined(__AVX__)
  if constexpr (kLanesOf<Floats> == 8) {
    const __m128 half = _mm_max_ps(_mm256_castps256_ps128((__m256)v), _mm256_extractf128_ps((__m256)v, 1));
    const __m128 two = _mm_max_ps(half, _mm_movehl_ps(half, half));
    return _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps(two, two, 1)));
  }
#endif
  float m = v[0];
  for (int i = 1; i < kLanesOf<Floats>; ++i) m = max(m, v[i]);
  return m;
}

// |v| of a vector or a number.
template <class V>
inline V magnitude(V v) {
  return v < 0.0f ? -v : v;
}

// a, no larger than the limit in size. [limit >= 0]
template <class Floats>
inline Floats limitSize(Floats a, Floats limit) {
#if defined(__AVX512DQ__)
  if constexpr (sizeof(Floats) == 64) {
    constexpr int kLesserSizeSignOfFirst = 2;
    return (Floats)_mm512_maskz_range_ps(kAll, (__m512)a, (__m512)limit, kLesserSizeSignOfFirst);
  }
#endif
  const auto signBit = IntsOf<kLanesOf<Floats>>{} + INT32_MIN;
  return asFloats(asInts(min(asFloats(asInts(a) & ~signBit), limit)) | (asInts(a) & signBit));
}

#if defined(__AVX512F__)
// 1 / sqrt(v) to 14 bits.
inline FloatsOf<16> roughInverseSqrt(FloatsOf<16> v) { return (FloatsOf<16>)_mm512_maskz_rsqrt14_ps(kAll, (__m512)v); }
#endif

// 1 / sqrt(v) to about 23 bits: with 8 and 16 lanes the processor's estimate, whose last bits are each maker's own, and
// one step of Newton's. With 4 lanes the quotient itself, the same on every processor: certificates are made by them.
template <class Floats>
inline Floats inverseSqrt(Floats v) {
  [[maybe_unused]] const auto refined = [&v](Floats e) __attribute__((always_inline)) {
    return e * (1.5f - 0.5f * v * e * e);
  };
#if defined(__AVX512F__)
  if constexpr (sizeof(Floats) == 64) return refined(roughInverseSqrt(v));
#endif
#if defined(__AVX__)
  if constexpr (sizeof(Floats) == 32) return refined((Floats)_mm256_rsqrt_ps((__m256)v));
#endif
#if defined(__SSE2__)
  if constexpr (sizeof(Floats) == 16) return (Floats)_mm_div_ps(_mm_set1_ps(1.0f), _mm_sqrt_ps((__m128)v));
#elif defined(__wasm_simd128__)
  if constexpr (sizeof(Floats) == 16) return (Floats)wasm_f32x4_div(wasm_f32x4_splat(1.0f), wasm_f32x4_sqrt((v128_t)v));
#endif
  Floats inverse;
  for (int i = 0; i < kLanesOf<Floats>; ++i) inverse[i] = 1.0f / __builtin_sqrtf(v[i]);
  return inverse;
}

// The half in the low 16 bits of each lane; the others are ignored.
template <class Ints>
inline FloatsOf<kLanesOf<Ints>> halfToFloat(Ints bits) {
#if defined(__AVX512F__)
  if constexpr (sizeof(Ints) == 64) {
    return (FloatsOf<16>)_mm512_maskz_cvtph_ps(kAll, _mm512_maskz_cvtepi32_epi16(kAll, (__m512i)bits));
  }
#endif
  const Ints size = bits & 0x7FFF, sign = (bits & 0x8000) << 16;
  const auto normal = asFloats((size << 13) + (112 << 23));
  // Denormal halves: let the subtraction of 2^-14 shift the leading one out.
  const auto denormal = asFloats((size << 13) + (113 << 23)) - 6.103515625e-05f;
  const Ints isDenormal = size < 0x0400;
  return asFloats((isDenormal & asInts(denormal)) | (~isDenormal & asInts(normal)) | sign);
}

// Halves widened.
template <class Halves>
inline FloatsOf<sizeof(Halves) / 2> halvesToFloats(Halves halves) {
#if defined(__AVX512F__)
  if constexpr (sizeof(Halves) == 32) return (FloatsOf<16>)_mm512_maskz_cvtph_ps(kAll, (__m256i)halves);
#endif
#if defined(__F16C__)
  if constexpr (sizeof(Halves) == 16) return (FloatsOf<8>)_mm256_cvtph_ps((__m128i)halves);
#endif
  return halfToFloat(__builtin_convertvector(halves, IntsOf<sizeof(Halves) / 2>));
}

// The first `count` of the bytes, then zeros. As many as the vector has may be read.
template <class Bytes>
inline Bytes loadFirstBytes(const std::uint8_t* from, int count) {
#if defined(__AVX512BW__) && defined(__AVX512VL__)
  if constexpr (sizeof(Bytes) == 16) {
    return (Bytes)_mm_maskz_loadu_epi8(static_cast<__mmask16>(count < 16 ? (1u << count) - 1 : 0xFFFFu), from);
  }
#endif
  auto bytes = load<Bytes>(from);
  for (int i = count; i < static_cast<int>(sizeof(Bytes)); ++i) bytes[i] = 0;
  return bytes;
}

// The same of four, widened.
inline IntsOf<4> firstOfFourBytes(const std::uint8_t* from, int count) {
  std::uint32_t word;
  __builtin_memcpy(&word, from, sizeof word);
  if (count < 4) word &= (1u << (8 * count)) - 1;
#if defined(__SSE2__)
  const __m128i zero = _mm_setzero_si128(), bytes = _mm_cvtsi32_si128(static_cast<int>(word));
  return (IntsOf<4>)_mm_unpacklo_epi16(_mm_unpacklo_epi8(bytes, zero), zero);
#else
  return __builtin_convertvector(load<BytesOf<4>>(&word), IntsOf<4>);
#endif
}

template <class Bytes>
inline HalvesOf<sizeof(Bytes)> bytesToHalves(Bytes bytes) {
#if defined(__AVX512F__)
  if constexpr (sizeof(Bytes) == 16) return (HalvesOf<16>)_mm256_cvtepu8_epi16((__m128i)bytes);
#endif
  return __builtin_convertvector(bytes, HalvesOf<sizeof(Bytes)>);
}

#if defined(__AVX512F__)
// g++ 12 converts bytes to words one by one.
inline IntsOf<16> bytesToInts(BytesOf<16> bytes) {
  return (IntsOf<16>)_mm512_maskz_cvtepu8_epi32(kAll, (__m128i)bytes);
}
#endif

#if defined(__wasm_simd128__)
// The compiler loads words one by one and then moves them into lanes; the instruction does both.
template <class Index>
inline v128_t gatherWords(const void* from, Index index) {
  const auto* const word = static_cast<const std::uint32_t*>(from);
  v128_t v = wasm_v128_load32_zero(word + static_cast<std::uint32_t>(index[0]));
  v = wasm_v128_load32_lane(word + static_cast<std::uint32_t>(index[1]), v, 1);
  v = wasm_v128_load32_lane(word + static_cast<std::uint32_t>(index[2]), v, 2);
  return wasm_v128_load32_lane(word + static_cast<std::uint32_t>(index[3]), v, 3);
}
#endif

// The words at these indices, none of which is negative.
template <class Ints>
inline Ints gather(const std::uint32_t* from, Ints index) {
#if defined(__AVX512F__)
  if constexpr (sizeof(Ints) == 64) {
    return (Ints)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), kAll, (__m512i)index, from, 4);
  }
#endif
#if defined(__wasm_simd128__)
  if constexpr (sizeof(Ints) == 16) return (Ints)gatherWords(from, index);
#endif
  Ints v;
  for (int i = 0; i < kLanesOf<Ints>; ++i) v[i] = static_cast<std::int32_t>(from[static_cast<std::uint32_t>(index[i])]);
  return v;
}

// The pairs of 16-bit words from these indices on, the first in the low half.
template <class Ints>
inline Ints gatherPairs(const std::uint16_t* from, Ints index) {
#if defined(__AVX512F__)
  if constexpr (sizeof(Ints) == 64)
    return (Ints)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), kAll, (__m512i)index, from, 2);
#endif
  Ints v;
  for (int i = 0; i < kLanesOf<Ints>; ++i) {
    std::int32_t pair;
    __builtin_memcpy(&pair, from + static_cast<std::uint32_t>(index[i]), sizeof pair);
    v[i] = pair;
  }
  return v;
}

// gather() of indices in memory.
template <class Ints>
inline Ints gatherAt(const std::uint32_t* from, const std::uint32_t* index) {
#if defined(__AVX512F__)
  if constexpr (sizeof(Ints) == 64) return gather(from, load<Ints>(index));
#endif
#if defined(__wasm_simd128__)
  if constexpr (sizeof(Ints) == 16) return (Ints)gatherWords(from, index);
#endif
  Ints v;
  for (int i = 0; i < kLanesOf<Ints>; ++i) v[i] = static_cast<std::int32_t>(from[index[i]]);
  return v;
}

// The floats at these indices.
template <class Ints>
inline FloatsOf<kLanesOf<Ints>> gather(const float* from, Ints index) {
#if defined(__AVX2__)
  if constexpr (sizeof(Ints) == 32) return (FloatsOf<8>)_mm256_i32gather_ps(from, (__m256i)index, 4);
#endif
#if defined(__wasm_simd128__)
  if constexpr (sizeof(Ints) == 16) return (Float4)gatherWords(from, index);
#endif
  FloatsOf<kLanesOf<Ints>> v;
  for (int i = 0; i < kLanesOf<Ints>; ++i) v[i] = from[static_cast<std::uint32_t>(index[i])];
  return v;
}

// A bit for each lane of a mask of eight.
inline unsigned bitsOf(IntsOf<8> mask) {
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < 8; ++i) bits |= (static_cast<unsigned>(mask[i]) >> 31) << i;
  return bits;
#endif
}

// The number of the lowest bit that is set. [bits > 0]
inline unsigned lowestBit(unsigned bits) { return static_cast<unsigned>(__builtin_ctz(bits)); }

#if defined(__AVX2__)
// The numbers of the bits that are set in a byte, in order.
struct SetBits {
  alignas(8) std::uint8_t of[256][8] = {};
  constexpr SetBits() {
    for (unsigned byte = 0; byte < 256; ++byte) {
      for (unsigned bit = 0, n = 0; bit < 8; ++bit) {
        if (byte >> bit & 1u) of[byte][n++] = static_cast<std::uint8_t>(bit);
      }
    }
  }
};
constexpr SetBits kSetBits;
#endif

// Appends those lanes of eight whose bits are set; anything may lie in the seven places behind them. Returns how many.
inline std::uint32_t append(std::uint32_t* to, IntsOf<8> v, unsigned bits) {
#if defined(__AVX2__)
  const __m256i order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kSetBits.of[bits])));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32((__m256i)v, order));
  return static_cast<std::uint32_t>(__builtin_popcount(bits));
#else
  std::uint32_t n = 0;
  for (; bits != 0; bits &= bits - 1) to[n++] = static_cast<std::uint32_t>(v[lowestBit(bits)]);
  return n;
#endif
}

// A three-dimensional vector per lane.
template <class Floats>
struct Vectors3 {
  Floats x, y, z;
};
template <class Floats>
inline Vectors3<Floats> operator-(const Vectors3<Floats>& a, const Vectors3<Floats>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Floats>
inline Vectors3<Floats> operator+(const Vectors3<Floats>& a, const Vectors3<Floats>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Floats>
inline Vectors3<Floats> cross(const Vectors3<Floats>& a, const Vectors3<Floats>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class Floats>
inline Floats dot(const Vectors3<Floats>& a, const Vectors3<Floats>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

}  // namespace
}  // namespace relume
