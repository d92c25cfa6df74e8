// SPDX-License-Identifier: MIT
// Rows of links with a cone of up to four bands (PIC 4.6, Eq. (5), (6)), with all sums in registers: lanes are links.
// For processors of 32 registers; cone_rows.h is for the others, and for more bands.
#pragma once

#include "runtime/cpu/cone_rows.h"

#include <utility>

namespace relume::cpu {
namespace {

// Bands and colours whose sums fit the registers.
constexpr bool sumsFit(int luma, int chroma) {
  return kLanes == 16 && luma <= 4 && luma * luma + 2 * chroma * chroma <= 27;
}

// Sums over links of band ratio * y_i(direction) * (4 Y, 2 Co, 4 Cg), monic polynomials as in cone_rows.h.
template <int kLuma, int kChroma>
struct LinkSums {
  static constexpr int kCo = kLuma * kLuma, kCg = kCo + kChroma * kChroma, kCount = kCg + kChroma * kChroma;
  Floats sum[kCount]{};  // as a cache's coefficients: luma, Co, Cg

  // One coefficient of band kBand: factor * form, where `factor` has Y in it if chroma has no such band.
  template <int kBand, int kIndex>
  __attribute__((always_inline)) void addTo(Floats factor, Floats form, const Floats* color) {
    if constexpr (kBand < kChroma) {
      const Floats w = factor * form;
      sum[kIndex] += w * color[0];
      sum[kCo + kIndex] += w * color[1];
      sum[kCg + kIndex] += w * color[2];
    } else {
      sum[kIndex] += factor * form;
    }
  }
  template <int kBand>
  __attribute__((always_inline)) Floats factorOf(const Floats* ratio, const Floats* color) const {
    return kBand < kChroma ? ratio[kBand] : ratio[kBand] * color[0];
  }

  __attribute__((always_inline)) void add(const Floats* ratio, Floats x, Floats y, Floats z, const Floats* color) {
    sum[0] += color[0];
    sum[kCo] += color[1];
    sum[kCg] += color[2];
    if constexpr (kLuma > 1) {
      const Floats g = factorOf<1>(ratio, color);
      addTo<1, 1>(g, y, color);
      addTo<1, 2>(g, z, color);
      addTo<1, 3>(g, x, color);
    }
    if constexpr (kLuma > 2) {
      // (x + i y)^m = re + i im.
      const Floats z2 = z * z, re2 = x * x - y * y, im2 = (x + x) * y;
      const Floats g = factorOf<2>(ratio, color), gz = g * z;
      addTo<2, 4>(g, im2, color);
      addTo<2, 5>(gz, y, color);
      addTo<2, 6>(g, z2 - 1.0f / 3.0f, color);
      addTo<2, 7>(gz, x, color);
      addTo<2, 8>(g, re2, color);
      if constexpr (kLuma > 3) {
        const Floats h = factorOf<3>(ratio, color), hz = h * z, hq = h * (z2 - 0.2f);
        addTo<3, 9>(h, re2 * y + im2 * x, color);
        addTo<3, 10>(hz, im2, color);
        addTo<3, 11>(hq, y, color);
        addTo<3, 12>(hz, z2 - 0.6f, color);
        addTo<3, 13>(hq, x, color);
        addTo<3, 14>(hz, re2, color);
        addTo<3, 15>(h, re2 * x - im2 * y, color);
      }
    }
  }
};

#if RELUME_LANES == 16
// Lanes without bit kBit: of a, plus those with it; the others: the same of b.
template <int kBit, int... kLane>
__attribute__((always_inline)) inline Floats addPairs(Floats a, Floats b, std::integer_sequence<int, kLane...>) {
  constexpr auto kWithBit = static_cast<__mmask16>(((kLane & kBit ? 1u << kLane : 0u) | ...));
  return (Floats)_mm512_mask_blend_ps(kWithBit, (__m512)a, (__m512)b) +
         __builtin_shufflevector(a, b, (kLane & kBit ? 16 + (kLane ^ kBit) : kLane ^ kBit)...);
}

// Lane i: sum over the lanes of v[i], i < kCount, in the order of sumLanes(). All indices are constants, without which
// the sums would be kept in memory.
template <int kCount, int kIndex = 0, int kBit = 1>
__attribute__((always_inline)) inline Floats sumsOf(const Floats* v) {
  if constexpr (kBit == 16) {
    return v[kIndex];
  } else {
    const Floats a = sumsOf<kCount, kIndex, 2 * kBit>(v);
    // What would be the sums of vectors past the last may be anything.
    if constexpr ((kIndex | kBit) >= kCount) {
      return addPairs<kBit>(a, a, std::make_integer_sequence<int, 16>());
    } else {
      return addPairs<kBit>(a, sumsOf<kCount, kIndex | kBit, 2 * kBit>(v), std::make_integer_sequence<int, 16>());
    }
  }
}

// out[i] = the sum over the lanes of sum[i] * scale[i] * unit, sixteen at a time.
template <int kCount>
__attribute__((always_inline)) inline void writeSums(const Floats* sum, const float* scale, float unit, float* out) {
  constexpr int kFirst = kCount < kLanes ? kCount : kLanes;
  const Floats sums = sumsOf<kFirst>(sum) * (load<Floats>(scale) * unit);
  __builtin_memcpy(out, &sums, sizeof(float) * kFirst);
  if constexpr (kCount > kLanes) writeSums<kCount - kLanes>(sum + kLanes, scale + kLanes, unit, out + kLanes);
}
#else
template <int kCount>
void writeSums(const Floats*, const float*, float, float*);  // the sums do not fit
#endif

template <class Links, int kLuma, int kChroma>
void sumConeRow(const LightCachesJob& job, std::uint32_t cache, float* coefficients) {
  const std::uint32_t begin = rowBegin(job, cache), end = rowBegin(job, cache + 1);
  const int count = static_cast<int>(end - begin);
  typename Links::Row row(job, cache);
  LinkSums<kLuma, kChroma> sums;
  for (int k = 0; k < count; k += kLanes) {
    const Links links(job, std::size_t{begin} + static_cast<std::size_t>(k), count - k);
    Floats ratio[kLuma], color[3], x, y, z;
    links.unpackDirection(x, y, z);
    links.template ratios<kLuma>(ratio);
    links.colors(job.node, row, k, count - k, color);
    sums.add(ratio, x, y, z, color);
  }
  writeSums<LinkSums<kLuma, kChroma>::kCount>(sums.sum, job.coneScale, Links::kColorUnit, coefficients);
}

// sumConeRow(), or null where the sums do not fit.
template <class Links, int kLuma = 4, int kChroma = 4>
ConeRow summedRow(int luma, int chroma) {
  if constexpr (kLuma == 0) {
    return nullptr;
  } else if constexpr (kChroma == 0) {
    return summedRow<Links, kLuma - 1, kLuma - 1>(luma, chroma);
  } else {
    if constexpr (sumsFit(kLuma, kChroma)) {
      if (luma == kLuma && chroma == kChroma) return sumConeRow<Links, kLuma, kChroma>;
    }
    return summedRow<Links, kLuma, kChroma - 1>(luma, chroma);
  }
}

}  // namespace
}  // namespace relume::cpu
