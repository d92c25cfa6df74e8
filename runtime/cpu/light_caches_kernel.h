// SPDX-License-Identifier: MIT
// The kernel of light_caches.h for one vector width. Included by one file for each instruction set, which defines
// RELUME_LANES (4, 8 or 16 floats a vector) and is compiled for that set. Everything here is in an anonymous namespace and
// nothing comes from other headers' inline functions, so that no code for a newer processor is linked into an older's path.
//
// Cone links of any size, many links at a time (PIC 4.6, Eq. (5), (6)): a row is cut into chunks; for each chunk
//   A. lanes are links: w_i = f * band ratio(cos alpha) * y_i(direction), monic polynomials, into a buffer in L1, and the
//      nodes' radiosity b = (Y, Co, Cg) beside it;
//   B. sums L_i += w_i * b, a small matrix product, several coefficients at a time in registers.
// SH links, a link at a time: lanes are coefficients, halves or bytes are widened and added with the radiosity as factor.
// oct6 links of up to four bands likewise, their coefficients looked up.
// Irradiance links of caches on a surface: lanes are Y, Co, Cg.
#include "runtime/cpu/light_caches_job.h"

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

// Floats of the buffer w: a share of the first-level cache.
constexpr int kBufferFloats = 6144;
// Coefficients summed at a time: three sums each must stay in registers.
constexpr int kBlock = kLanes == 16 ? 8 : 4;

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

// Words 1 (f, cos alpha) and 2 (direction) of kLanes links of three words each.
inline void loadLinks(const std::uint32_t* link, Ints& packed, Ints& direction) {
  const Ints a = load<Ints>(link), b = load<Ints>(link + kLanes), c = load<Ints>(link + 2 * kLanes);
#if RELUME_LANES == 16
  // Positions 3 i + 1 and 3 i + 2 of a, b, c in a row; the lanes from c come in a second step.
  const Ints p = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0);
  packed = __builtin_shufflevector(p, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30);
  const Ints d = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0);
  direction = __builtin_shufflevector(d, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31);
#elif RELUME_LANES == 8
  const Ints p = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 0, 0, 0);
  packed = __builtin_shufflevector(p, c, 0, 1, 2, 3, 4, 8, 11, 14);
  const Ints d = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 0, 0, 0);
  direction = __builtin_shufflevector(d, c, 0, 1, 2, 3, 4, 9, 12, 15);
#else
  const Ints p = __builtin_shufflevector(a, b, 1, 4, 7, 0);
  packed = __builtin_shufflevector(p, c, 0, 1, 2, 6);
  const Ints d = __builtin_shufflevector(a, b, 2, 5, 0, 0);
  direction = __builtin_shufflevector(d, c, 0, 1, 4, 7);
#endif
}

// Y, Co, Cg of the nodes of kLanes links, transposed.
template <class Links>
__attribute__((always_inline)) inline void loadNodes(const float* node, const Links& links, Floats& y, Floats& co, Floats& cg) {
  const auto color = [node, &links](int lane) __attribute__((always_inline)) { return load<Float4>(node + 4 * std::size_t{links.node(lane)}); };
#if RELUME_LANES == 4
  const Floats r0 = color(0), r1 = color(1), r2 = color(2), r3 = color(3);
  const Floats y01 = __builtin_shufflevector(r0, r1, 0, 4, 1, 5), y23 = __builtin_shufflevector(r2, r3, 0, 4, 1, 5);
  const Floats z01 = __builtin_shufflevector(r0, r1, 2, 6, 3, 7), z23 = __builtin_shufflevector(r2, r3, 2, 6, 3, 7);
  y = __builtin_shufflevector(y01, y23, 0, 1, 4, 5);
  co = __builtin_shufflevector(y01, y23, 2, 3, 6, 7);
  cg = __builtin_shufflevector(z01, z23, 0, 1, 4, 5);
#else
  const auto pair = [&color](int lane, int other) __attribute__((always_inline)) {
    return __builtin_shufflevector(color(lane), color(other), 0, 1, 2, 3, 4, 5, 6, 7);
  };
#if RELUME_LANES == 8
  // Row r holds nodes r and r + 4; transpose 4 x 4 within each half.
  const Floats r0 = pair(0, 4), r1 = pair(1, 5), r2 = pair(2, 6), r3 = pair(3, 7);
  const Floats y01 = __builtin_shufflevector(r0, r1, 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats y23 = __builtin_shufflevector(r2, r3, 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats z01 = __builtin_shufflevector(r0, r1, 2, 10, 3, 11, 6, 14, 7, 15);
  const Floats z23 = __builtin_shufflevector(r2, r3, 2, 10, 3, 11, 6, 14, 7, 15);
  y = __builtin_shufflevector(y01, y23, 0, 1, 8, 9, 4, 5, 12, 13);
  co = __builtin_shufflevector(y01, y23, 2, 3, 10, 11, 6, 7, 14, 15);
  cg = __builtin_shufflevector(z01, z23, 0, 1, 8, 9, 4, 5, 12, 13);
#else
  const auto four = [&pair](int lane) __attribute__((always_inline)) {
    const Float8 low = pair(lane, lane + 4), high = pair(lane + 8, lane + 12);
    return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  };
  // Row r holds nodes r, r + 4, r + 8, r + 12; transpose 4 x 4 within each quarter.
  const Floats r0 = four(0), r1 = four(1), r2 = four(2), r3 = four(3);
#define RELUME_LOW 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29
#define RELUME_HIGH 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31
#define RELUME_LOW_PAIRS 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29
#define RELUME_HIGH_PAIRS 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31
  const Floats y01 = __builtin_shufflevector(r0, r1, RELUME_LOW), y23 = __builtin_shufflevector(r2, r3, RELUME_LOW);
  const Floats z01 = __builtin_shufflevector(r0, r1, RELUME_HIGH), z23 = __builtin_shufflevector(r2, r3, RELUME_HIGH);
  y = __builtin_shufflevector(y01, y23, RELUME_LOW_PAIRS);
  co = __builtin_shufflevector(y01, y23, RELUME_HIGH_PAIRS);
  cg = __builtin_shufflevector(z01, z23, RELUME_LOW_PAIRS);
#endif
#endif
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

// Band ratios times f, without the constants that coneScale holds (formats/sh.h, coneBandRatios()).
template <int kBands>
inline void bandFactors(Floats f, Floats c, Floats* g) {
  const Floats c2 = c * c, u = f + f * c, uc = u * c;
  g[0] = f;
  if constexpr (kBands > 1) g[1] = u;
  if constexpr (kBands > 2) g[2] = uc;
  if constexpr (kBands > 3) g[3] = u * (5.0f * c2 - 1.0f);
  if constexpr (kBands > 4) g[4] = uc * (7.0f * c2 - 3.0f);
  if constexpr (kBands > 5) g[5] = u * ((21.0f * c2 - 14.0f) * c2 + 1.0f);
  if constexpr (kBands > 6) g[6] = uc * ((33.0f * c2 - 30.0f) * c2 + 5.0f);
  if constexpr (kBands > 7) g[7] = u * (((429.0f * c2 - 495.0f) * c2 + 135.0f) * c2 - 5.0f);
}

// Orders m = kM .. kBands-1 of one group of links: w[i * stride] = g_l q_l^m(z) (x + i y)^m. The monic q obey
// q_{l+1} = z q_l - (l² - m²) / (4 l² - 1) q_{l-1}.
template <int kBands, int kM>
inline void writeOrders(const Floats* g, Floats x, Floats y, Floats z, Floats re, Floats im, float* w, int stride) {
  Floats previous{}, q = splat(1.0f);
#pragma GCC unroll 8
  for (int l = kM; l < kBands; ++l) {
    const Floats gq = l == kM ? g[l] : g[l] * q;
    if constexpr (kM == 0) {
      store(w + (l * l + l) * stride, gq);
    } else {
      store(w + (l * l + l + kM) * stride, gq * re);
      store(w + (l * l + l - kM) * stride, gq * im);
    }
    const float a = static_cast<float>(l * l - kM * kM) / static_cast<float>(4 * l * l - 1);
    const Floats next = l == kM ? z : z * q - a * previous;
    previous = q;
    q = next;
  }
  if constexpr (kM + 1 < kBands) {
    const Floats nextRe = kM == 0 ? x : re * x - im * y, nextIm = kM == 0 ? y : re * y + im * x;
    writeOrders<kBands, kM + 1>(g, x, y, z, nextRe, nextIm, w, stride);
  }
}

// The links from `at` on of one group: their nodes, transfers f, and directions with cosines c of the cones. Lanes past the
// `count` that are left name node 0 and carry nothing. One struct a way of storing them (formats/links.h).
struct PlainLinks {
  const std::uint32_t* link;
  std::uint32_t tail[3 * kLanes];

  PlainLinks(const LightCachesJob& job, std::size_t at, int count) : link(job.cone + 3 * at) {
    if (count >= kLanes) return;
    __builtin_memset(tail, 0, sizeof tail);
    __builtin_memcpy(tail, link, sizeof(std::uint32_t) * 3 * static_cast<std::size_t>(count));
    link = tail;
  }
  std::uint32_t node(int lane) const { return link[3 * lane]; }
  __attribute__((always_inline)) void unpack(Floats& f, Floats& c, Floats& x, Floats& y, Floats& z) const {
    Ints packed, bits;
    loadLinks(link, packed, bits);
    f = halfToFloat(packed);
    c = halfToFloat(packed >> 16);
    unpackDirections<16>(bits, x, y, z);
  }
};

struct Heads {
  std::uint32_t head[kLanes];

  __attribute__((always_inline)) Heads(const LightCachesJob& job, std::size_t at, int count) {
    if (count >= kLanes) {
      __builtin_memcpy(head, job.head + at, sizeof head);
    } else {
      __builtin_memset(head, 0, sizeof head);
      __builtin_memcpy(head, job.head + at, sizeof(std::uint32_t) * static_cast<std::size_t>(count));
    }
  }
  std::uint32_t node(int lane) const { return head[lane] & 0xFFFFFu; }
  Floats transfer() const { return halfToFloat((load<Ints>(head) >> 18) & 0x3FFC); }
};

template <class Word, int kUvBits, int kConeBits>
struct CompactLinks : Heads {
  Word shape[kLanes];

  __attribute__((always_inline)) CompactLinks(const LightCachesJob& job, std::size_t at, int count) : Heads(job, at, count) {
    const Word* from = reinterpret_cast<const Word*>(job.shape) + at;
    if (count >= kLanes) {
      __builtin_memcpy(shape, from, sizeof shape);
    } else {
      __builtin_memset(shape, 0, sizeof shape);
      __builtin_memcpy(shape, from, sizeof(Word) * static_cast<std::size_t>(count));
    }
  }
  __attribute__((always_inline)) void unpack(Floats& f, Floats& c, Floats& x, Floats& y, Floats& z) const {
    typedef Word Words __attribute__((vector_size(sizeof(Word) * RELUME_LANES)));
    const Ints bits = __builtin_convertvector(load<Words>(shape), Ints);
    f = transfer();
    const Floats q = toFloats((bits >> (2 * kUvBits)) & ((1 << kConeBits) - 1));
    constexpr float kMost = static_cast<float>((1 << kConeBits) - 1);
    c = 1.0f - q * q * (2.0f / (kMost * kMost));
    unpackDirections<kUvBits>(bits, x, y, z);
  }
};
using Oct8Links = CompactLinks<std::uint32_t, 12, 8>;
using Oct6Links = CompactLinks<std::uint16_t, 6, 4>;

// Phase B for kCount coefficients from `first` on and kColors of Y, Co, Cg.
template <int kCount, int kColors>
inline void sumBlock(const float* w, int stride, const float* b, int bStride, int links, float* const* out, int first) {
  Floats sum[kColors][kCount];
  for (auto& color : sum) {
    for (Floats& each : color) each = Floats{};
  }
  w += first * stride;
  for (int k = 0; k < links; k += kLanes) {
    Floats color[kColors];
#pragma GCC unroll 3
    for (int c = 0; c < kColors; ++c) color[c] = load<Floats>(b + c * bStride + k);
#pragma GCC unroll 8
    for (int i = 0; i < kCount; ++i) {
      const Floats each = load<Floats>(w + i * stride + k);
#pragma GCC unroll 3
      for (int c = 0; c < kColors; ++c) sum[c][i] += each * color[c];
    }
  }
#pragma GCC unroll 3
  for (int c = 0; c < kColors; ++c) {
#pragma GCC unroll 8
    for (int i = 0; i < kCount; ++i) out[c][first + i] += sumLanes(sum[c][i]);
  }
}

// Phase B for the coefficients [first, last).
template <int kColors, int kCount>
inline void sumCoefficients(const float* w, int stride, const float* b, int bStride, int links, float* const* out,
                            int first, int last) {
  for (; first + kCount <= last; first += kCount) sumBlock<kCount, kColors>(w, stride, b, bStride, links, out, first);
  if constexpr (kCount > 1) {
    if (first < last) sumCoefficients<kColors, kCount / 2>(w, stride, b, bStride, links, out, first, last);
  }
}

// One row of links with a cone.
template <class Links, int kBands>
void lightConeRow(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end, float* const* out) {
  constexpr int kCoefficients = kBands * kBands;
  constexpr int kWanted = kBufferFloats / kCoefficients / kLanes * kLanes;
  constexpr int kChunk = kWanted > 512 ? 512 : kWanted;
  constexpr int kMost = kBlock < kCoefficients ? kBlock : kCoefficients;
  alignas(64) float w[kCoefficients * kChunk];
  alignas(64) float b[3 * kChunk];
  const int chroma = job.chromaBands * job.chromaBands;
  for (std::uint32_t at = begin; at < end; at += kChunk) {
    const int count = end - at < kChunk ? static_cast<int>(end - at) : kChunk;
    for (int k = 0; k < count; k += kLanes) {
      const Links links(job, std::size_t{at} + static_cast<std::size_t>(k), count - k);
      Floats f, c, x, y, z, g[kBands];
      links.unpack(f, c, x, y, z);
      bandFactors<kBands>(f, c, g);
      writeOrders<kBands, 0>(g, x, y, z, splat(1.0f), Floats{}, w + k, kChunk);
      Floats luma, co, cg;
      loadNodes(job.node, links, luma, co, cg);
      store(b + k, luma);
      store(b + kChunk + k, co);
      store(b + 2 * kChunk + k, cg);
    }
    sumCoefficients<3, kMost>(w, kChunk, b, kChunk, count, out, 0, chroma);
    sumCoefficients<1, kMost>(w, kChunk, b, kChunk, count, out, chroma, kCoefficients);
  }
}

using ConeRow = void (*)(const LightCachesJob&, std::uint32_t, std::uint32_t, float* const*);
template <class Links>
constexpr ConeRow kConeRow[8] = {lightConeRow<Links, 1>, lightConeRow<Links, 2>, lightConeRow<Links, 3>, lightConeRow<Links, 4>,
                                 lightConeRow<Links, 5>, lightConeRow<Links, 6>, lightConeRow<Links, 7>, lightConeRow<Links, 8>};

// One row of irradiance links: coefficient 0 alone.
void lightIrradianceRow(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end, float* const* out) {
  // Four sums, so that none waits for the one before.
  Float4 sum[4] = {};
  for (std::uint32_t at = begin; at < end; at += kLanes) {
    const Heads links(job, at, static_cast<int>(end - at < kLanes ? end - at : kLanes));
    float f[kLanes];
    store(f, links.transfer());
#pragma GCC unroll 16
    for (int k = 0; k < kLanes; ++k) sum[k % 4] += f[k] * load<Float4>(job.node + 4 * std::size_t{links.node(k)});
  }
  const Float4 all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  for (int c = 0; c < 3; ++c) out[c][0] = all[c];
}

// Radiosity times f of each link into memory, whence sums read it spread over a vector.
inline void scaleColors(const LightCachesJob& job, const Heads& links, int count, float* color) {
  float f[kLanes];
  store(f, links.transfer());
  for (int k = 0; k < count; ++k) {
    const Float4 b = f[k] * load<Float4>(job.node + 4 * std::size_t{links.node(k)});
    __builtin_memcpy(color + 4 * k, &b, sizeof b);
  }
}

// One row of oct6 links of up to four bands, a link at a time: lanes are coefficients. Directions and cones are so few that
// their coefficients lie in tables, c_i = f * directionTable_i * coneTable_i. kVectors cover sixteen coefficients.
void lightTableRow(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end, float* const* out) {
  constexpr int kVectors = 16 / kLanes;
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const auto* shapes = reinterpret_cast<const std::uint16_t*>(job.shape);
  Floats sum[3][kVectors] = {};
  for (std::uint32_t at = begin; at < end; at += kLanes) {
    const int count = end - at < kLanes ? static_cast<int>(end - at) : kLanes;
    const Heads links(job, at, count);
    float color[4 * kLanes];
    scaleColors(job, links, count, color);
    for (int k = 0; k < count; ++k) {
      const std::uint32_t shape = shapes[at + static_cast<std::uint32_t>(k)];
      const float* direction = job.directionTable + 16 * (shape & 0xFFFu);
      const float* cone = job.coneTable + 16 * (shape >> 12);
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) {
        const Floats c = load<Floats>(direction + kLanes * v) * load<Floats>(cone + kLanes * v);
        sum[0][v] += color[4 * k] * c;
        sum[1][v] += color[4 * k + 1] * c;
        sum[2][v] += color[4 * k + 2] * c;
      }
    }
  }
  for (int i = 0; i < luma; ++i) out[0][i] = sum[0][i / kLanes][i % kLanes];
  for (int i = 0; i < chroma; ++i) out[1][i] = sum[1][i / kLanes][i % kLanes];
  for (int i = 0; i < chroma; ++i) out[2][i] = sum[2][i / kLanes][i % kLanes];
}

// The signed bytes of a link of kind sh8 from `at` on, widened; reads none at or beyond `end`.
inline Floats loadBytes(const std::int8_t* at, const std::int8_t* end) {
  typedef std::int8_t Bytes __attribute__((vector_size(RELUME_LANES)));
  Bytes bytes{};
  if (end - at >= kLanes) {
    bytes = load<Bytes>(at);
  } else {
    __builtin_memcpy(&bytes, at, static_cast<std::size_t>(end - at));
  }
  return toFloats(__builtin_convertvector(bytes, Ints));
}

// One row of sh8 links, a link at a time: lanes are coefficients.
void lightSh8Row(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end, float* const* out) {
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const auto* bytes = reinterpret_cast<const std::int8_t*>(job.shape);
  const std::int8_t* bytesEnd = bytes + job.shapeBytes;
  const std::size_t stride = (std::size_t{job.shStride} + 3) / 4 * 4;
  for (int first = 0; first < luma; first += kLanes) {
    Floats sum[3] = {};
    for (std::uint32_t at = begin; at < end; at += kLanes) {
      const int count = end - at < kLanes ? static_cast<int>(end - at) : kLanes;
      const Heads links(job, at, count);
      float color[4 * kLanes];
      scaleColors(job, links, count, color);
      for (int k = 0; k < count; ++k) {
        const std::size_t link = std::size_t{at} + static_cast<std::size_t>(k);
        const Floats c = loadBytes(bytes + link * stride + first, bytesEnd);
        sum[0] += color[4 * k] * c;
        sum[1] += color[4 * k + 1] * c;
        sum[2] += color[4 * k + 2] * c;
      }
    }
    for (int lane = 0; lane < kLanes && first + lane < luma; ++lane) {
      const int i = first + lane;
      out[0][i] = sum[0][lane] * job.sh8Scale[i];
      if (i >= chroma) continue;
      out[1][i] = sum[1][lane] * job.sh8Scale[i];
      out[2][i] = sum[2][lane] * job.sh8Scale[i];
    }
  }
}

// kLanes halves from `at` on, widened; reads no half at or beyond `end`.
inline Floats loadHalves(const std::uint16_t* at, const std::uint16_t* end) {
  typedef std::uint16_t Halves __attribute__((vector_size(2 * RELUME_LANES)));
  Halves halves{};
  if (end - at >= kLanes) {
    halves = load<Halves>(at);
  } else {
    __builtin_memcpy(&halves, at, sizeof(std::uint16_t) * static_cast<std::size_t>(end - at));
  }
#if RELUME_LANES == 16
  return (Floats)_mm512_maskz_cvtph_ps(kAll, (__m256i)halves);
#elif RELUME_LANES == 8 && defined(__F16C__)
  return (Floats)_mm256_cvtph_ps((__m128i)halves);
#else
  return halfToFloat(__builtin_convertvector(halves, Ints));
#endif
}

void lightShRow(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end, float* const* out) {
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const std::uint16_t* halvesEnd = job.shCoefficients + job.shHalfCount;
  for (int first = 0; first < luma; first += kLanes) {
    Floats sum[3] = {};
    for (std::uint32_t k = begin; k < end; ++k) {
      const Floats c = loadHalves(job.shCoefficients + std::size_t{k} * job.shStride + first, halvesEnd);
      const float* color = job.node + 4 * std::size_t{job.shNode[k]};
      sum[0] += color[0] * c;
      sum[1] += color[1] * c;
      sum[2] += color[2] * c;
    }
    // Lanes beyond the bands wanted hold higher bands or the next link: leave them out.
    for (int lane = 0; lane < kLanes && first + lane < luma; ++lane) {
      out[0][first + lane] = sum[0][lane];
      if (first + lane >= chroma) continue;
      out[1][first + lane] = sum[1][lane];
      out[2][first + lane] = sum[2][lane];
    }
  }
}

// LinkKind's numbers, without its header.
constexpr std::uint32_t kSh = 0, kCone = 1, kOct6 = 3, kSh8 = 4, kIrradiance = 5;

void lightCachesOf(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) {
  const int bands = job.lumaBands - 1;
  const ConeRow row = job.kind == kCone   ? kConeRow<PlainLinks>[bands]
                      : job.kind == kOct6 ? kConeRow<Oct6Links>[bands]
                                          : kConeRow<Oct8Links>[bands];
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const std::size_t stride = static_cast<std::size_t>(luma + 2 * chroma);
  for (std::uint32_t cache = begin; cache < end; ++cache) {
    float* y = job.coefficients + stride * cache;
    float* const out[3] = {y, y + luma, y + luma + chroma};
    const std::uint32_t linksBegin = job.rowBegin[cache], linksEnd = job.rowBegin[cache + 1];
    if (job.kind == kSh) {
      lightShRow(job, linksBegin, linksEnd, out);
      continue;
    }
    if (job.kind == kSh8) {
      lightSh8Row(job, linksBegin, linksEnd, out);
      continue;
    }
    if (job.kind == kOct6 && job.directionTable) {
      lightTableRow(job, linksBegin, linksEnd, out);
      continue;
    }
    for (std::size_t i = 0; i < stride; ++i) y[i] = 0.0f;
    if (job.kind == kIrradiance && linksBegin >= job.gridLinks) {
      lightIrradianceRow(job, linksBegin, linksEnd, out);
      continue;
    }
    row(job, linksBegin, linksEnd, out);
    for (int i = 0; i < luma; ++i) out[0][i] *= job.coneScale[i];
    for (int i = 0; i < chroma; ++i) out[1][i] *= job.coneScale[i];
    for (int i = 0; i < chroma; ++i) out[2][i] *= job.coneScale[i];
  }
}

}  // namespace
}  // namespace relume::cpu
