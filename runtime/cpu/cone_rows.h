// SPDX-License-Identifier: MIT
// Rows of links with a cone, of any number of bands, many links at a time (PIC 4.6, Eq. (5), (6)). A row is cut into
// chunks; for each chunk
//   A. lanes are links: w_i = band ratio(cos alpha) * y_i(direction), monic polynomials, go into a buffer in L1, and so
//      does f times the nodes' radiosity, b = (4 Y, 2 Co, 4 Cg);
//   B. sums L_i += w_i * b, a small matrix product, several coefficients at a time in registers.
#pragma once

#include "runtime/cpu/link_vectors.h"

namespace relume::cpu {
namespace {

// Floats of the buffer w: a share of the first-level cache.
constexpr int kBufferFloats = 6144;
// Coefficients summed at a time: their sums, one of each colour, must stay in registers.
template <int kColors>
constexpr int kMaxBlock = (kLanes == 16 ? 24 : 12) / kColors;

// Orders m = kM .. kBands-1 of one group of links: w[i * stride] = g_l q_l^m(z) (x + i y)^m. The monic q obey
// q_{l+1} = z q_l - (l² - m²) / (4 l² - 1) q_{l-1}. The first, 1, is not written.
template <int kBands, int kM>
inline void writeOrders(const Floats* g, Floats x, Floats y, Floats z, Floats re, Floats im, float* w, int stride) {
  Floats previous{}, q = splat(1.0f);
#pragma GCC unroll 8
  for (int l = kM; l < kBands; ++l) {
    const Floats gq = l == kM ? g[l] : g[l] * q;
    if constexpr (kM == 0) {
      if (l > 0) store(w + (l * l + l) * stride, gq);
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

// Phase B for kCount coefficients from `first` on and kColors of Y, Co, Cg. kFromZero: first = 0, whose w is 1.
template <int kCount, int kColors, bool kFromZero>
inline void sumBlock(const float* w, int stride, const float* b, int bStride, int links, float* const* out, int first) {
  Floats sum[kColors][kCount];
  for (auto& color : sum) {
    for (Floats& each : color) each = Floats{};
  }
  w += first * stride;
  for (int k = 0; k < links; k += kLanes) {
    Floats color[kColors];
#pragma GCC unroll 3
    for (int c = 0; c < kColors; ++c) {
      color[c] = load<Floats>(b + c * bStride + k);
      if constexpr (kFromZero) sum[c][0] += color[c];
    }
#pragma GCC unroll 24
    for (int i = kFromZero ? 1 : 0; i < kCount; ++i) {
      const Floats each = load<Floats>(w + i * stride + k);
#pragma GCC unroll 3
      for (int c = 0; c < kColors; ++c) sum[c][i] += each * color[c];
    }
  }
#pragma GCC unroll 3
  for (int c = 0; c < kColors; ++c) {
#pragma GCC unroll 24
    for (int i = 0; i < kCount; ++i) out[c][first + i] += sumLanes(sum[c][i]);
  }
}

// Phase B for the coefficients [first, last), kCount at a time and then fewer. One for all kinds and bands: not
// inlined.
template <int kColors, int kCount = kMaxBlock<kColors>>
__attribute__((noinline)) void sumCoefficients(const float* w, int stride, const float* b, int bStride, int links,
                                               float* const* out, int first, int last) {
  for (; first + kCount <= last; first += kCount) {
    // Luma alone begins where chroma ends.
    if (kColors > 1 && first == 0) {
      sumBlock<kCount, kColors, kColors != 1>(w, stride, b, bStride, links, out, first);
    } else {
      sumBlock<kCount, kColors, false>(w, stride, b, bStride, links, out, first);
    }
  }
  if constexpr (kCount > 1) {
    // Of luma alone, four bands over two of chroma have 12 coefficients, three have 5.
    constexpr int kNext = kCount == 12 || kCount == 24 ? 8 : kCount == 8 ? 5 : kCount / 2;
    if (first < last) sumCoefficients<kColors, kNext>(w, stride, b, bStride, links, out, first, last);
  }
}

// One row of links with a cone: all coefficients of its cache.
template <class Links, int kBands>
void lightConeRow(const LightCachesJob& job, std::uint32_t cache, float* coefficients) {
  const std::uint32_t begin = rowBegin(job, cache), end = rowBegin(job, cache + 1);
  constexpr int kCoefficients = kBands * kBands;
  constexpr int kWanted = kBufferFloats / kCoefficients / kLanes * kLanes;
  constexpr int kChunk = kWanted > 512 ? 512 : kWanted;
  // Rows do not begin a power of two apart, which would put them all in a few sets of the first-level cache.
  constexpr int kStride = kChunk + 16;
  alignas(64) float w[kCoefficients * kStride];
  if constexpr (kBands == 1) w[0] = 1.0f;  // g++ 12 warns where nothing is written
  alignas(64) float b[3 * kStride];
  alignas(64) std::uint32_t node[kChunk + kLanes];
  const int chroma = job.chromaBands * job.chromaBands;
  const int all = kCoefficients + 2 * chroma;
  float* const out[3] = {coefficients, coefficients + kCoefficients, coefficients + kCoefficients + chroma};
  for (int i = 0; i < all; ++i) coefficients[i] = 0.0f;
  for (std::uint32_t at = begin; at < end; at += kChunk) {
    const int count = end - at < kChunk ? static_cast<int>(end - at) : kChunk;
    Links::writeNodes(job, cache, at, count, node);
    for (int k = 0; k < count; k += kLanes) {
      const Links links(job, std::size_t{at} + static_cast<std::size_t>(k), count - k);
      Floats ratio[kBands], color[3], x, y, z;
      links.unpackDirection(x, y, z);
      links.template ratios<kBands>(ratio);
      writeOrders<kBands, 0>(ratio, x, y, z, splat(1.0f), Floats{}, w + k, kStride);
      scaledColors(gatherAt<Ints>(job.node, node + k), links.transfer(), color);
      for (int c = 0; c < 3; ++c) store(b + c * kStride + k, color[c]);
    }
    sumCoefficients<3>(w, kStride, b, kStride, count, out, 0, chroma);
    sumCoefficients<1>(w, kStride, b, kStride, count, out, chroma, kCoefficients);
  }
  for (int i = 0; i < all; ++i) coefficients[i] *= job.coneScale[i];
}

using ConeRow = void (*)(const LightCachesJob&, std::uint32_t cache, float* coefficients);
#if !defined(RELUME_FEW_BANDS)
template <class Links>
constexpr ConeRow kConeRow[8] = {lightConeRow<Links, 1>, lightConeRow<Links, 2>, lightConeRow<Links, 3>,
                                 lightConeRow<Links, 4>, lightConeRow<Links, 5>, lightConeRow<Links, 6>,
                                 lightConeRow<Links, 7>, lightConeRow<Links, 8>};
#else
// For programs that never ask for more than four bands of luma (bindings/js), and save their size.
template <class Links>
constexpr ConeRow kConeRow[4] = {lightConeRow<Links, 1>, lightConeRow<Links, 2>, lightConeRow<Links, 3>,
                                 lightConeRow<Links, 4>};
#endif

}  // namespace
}  // namespace relume::cpu
