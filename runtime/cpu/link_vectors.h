// SPDX-License-Identifier: MIT
// The links of a row, kLanes at a time, whatever the way of storing them (include/relume/links.h): their nodes'
// radiosity and, unpacked, transfers and cones.
#pragma once

#include "runtime/cpu/light_caches_job.h"
#include "runtime/cpu/vectors.h"

namespace relume::cpu {
namespace {

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

// Y, Co, Cg of the nodes of kLanes links.
__attribute__((always_inline)) inline void loadNodes(const std::uint32_t* node, Ints links, Floats& y, Floats& co,
                                                     Floats& cg) {
  Floats r, g, b;
  unpackColors(gather(node, links), r, g, b);
  toYCoCg(r, g, b, y, co, cg);
}

// The ratios of bands 0 .. kBands-1 to band 0 for cones of cosine c, without the constants that coneScale holds
// (formats/sh.h, coneBandRatios()).
template <int kBands>
__attribute__((always_inline)) inline void bandRatios(Floats c, Floats* g) {
  const Floats c2 = c * c, u = 1.0f + c, uc = u * c;
  g[0] = splat(1.0f);
  if constexpr (kBands > 1) g[1] = u;
  if constexpr (kBands > 2) g[2] = uc;
  if constexpr (kBands > 3) g[3] = u * (5.0f * c2 - 1.0f);
  if constexpr (kBands > 4) g[4] = uc * (7.0f * c2 - 3.0f);
  if constexpr (kBands > 5) g[5] = u * ((21.0f * c2 - 14.0f) * c2 + 1.0f);
  if constexpr (kBands > 6) g[6] = uc * ((33.0f * c2 - 30.0f) * c2 + 5.0f);
  if constexpr (kBands > 7) g[7] = u * (((429.0f * c2 - 495.0f) * c2 + 135.0f) * c2 - 5.0f);
}

// The `count` words from `from` on, at most kLanes, then zeros.
template <class V, class Word>
__attribute__((always_inline)) inline V loadFirst(const Word* from, int count) {
  if (count >= kLanes) return load<V>(from);
  V v{};
  __builtin_memcpy(&v, from, sizeof(Word) * static_cast<std::size_t>(count));
  return v;
}

// The links from `at` on of one group: transfers f, ratios of bands for their cones, directions. Lanes past the `count`
// that are left carry nothing, and name node 0. Row: what nodes() needs of the whole row; `index` is the group's within
// it. writeNodes() writes the nodes of any number of links, and zeros up to a whole vector. One struct a way of storing
// them (include/relume/links.h).
struct PlainLinks {
  struct Row {
    Row(const LightCachesJob&, std::uint32_t) {}
  };
  const std::uint32_t* link;
  std::uint32_t tail[3 * kLanes];
  Ints packed, direction;

  PlainLinks(const LightCachesJob& job, std::size_t at, int count) : link(job.cone + 3 * at) {
    if (count < kLanes) {
      __builtin_memset(tail, 0, sizeof tail);
      __builtin_memcpy(tail, link, sizeof(std::uint32_t) * 3 * static_cast<std::size_t>(count));
      link = tail;
    }
    loadLinks(link, packed, direction);
  }
  static void writeNodes(const LightCachesJob& job, std::uint32_t, std::size_t at, int count, std::uint32_t* node) {
    for (int i = 0; i < count; ++i) node[i] = job.cone[3 * (at + static_cast<std::size_t>(i))];
    for (int i = count; i % kLanes != 0; ++i) node[i] = 0;
  }
  Ints nodes(const Row&, std::int32_t, int) const {
    Ints v;
    for (int i = 0; i < kLanes; ++i) v[i] = static_cast<std::int32_t>(link[3 * i]);
    return v;
  }
  Floats transfer() const { return halfToFloat(packed); }
  static constexpr float kColorUnit = 1.0f;
  void colors(const std::uint32_t* node, const Row& row, std::int32_t index, int count, Floats* color) const {
    scaledColors(gather(node, nodes(row, index, count)), transfer(), color);
  }
  // Cosines of the cones' half opening angles.
  Floats cosines() const { return halfToFloat(packed >> 16); }
  template <int kBands>
  __attribute__((always_inline)) void ratios(Floats* g) const {
    bandRatios<kBands>(cosines(), g);
  }
  __attribute__((always_inline)) void unpackDirection(Floats& x, Floats& y, Floats& z) const {
    unpackDirections<16>(direction, x, y, z);
  }
};

struct Heads {
  struct Row {
    Row(const LightCachesJob&, std::uint32_t) {}
  };
  Ints head;

  __attribute__((always_inline)) Heads(const LightCachesJob& job, std::size_t at, int count)
      : head(loadFirst<Ints>(job.head + at, count)) {}
  static void writeNodes(const LightCachesJob& job, std::uint32_t, std::size_t at, int count, std::uint32_t* node) {
    for (int i = 0; i < count; i += kLanes) {
      const Ints each = loadFirst<Ints>(job.head + at + i, count - i) & 0xFFFFF;
      __builtin_memcpy(node + i, &each, sizeof each);
    }
  }
  Ints nodes() const { return head & 0xFFFFF; }
  Floats transfer() const { return halfToFloat((head >> 18) & 0x3FFC); }
  static constexpr float kColorUnit = 1.0f;
  __attribute__((always_inline)) void colors(const std::uint32_t* node, const Row&, std::int32_t, int,
                                             Floats* color) const {
    scaledColors(gather(node, nodes()), transfer(), color);
  }
};

template <class Word, int kUvBits, int kConeBits>
struct CompactLinks : Heads {
  Ints shape;

  __attribute__((always_inline)) CompactLinks(const LightCachesJob& job, std::size_t at, int count)
      : Heads(job, at, count) {
    using Words = typename VectorOf<Word, kLanes>::type;
    shape = __builtin_convertvector(loadFirst<Words>(reinterpret_cast<const Word*>(job.shape) + at, count), Ints);
  }
  __attribute__((always_inline)) Floats cosines() const {
    const Floats q = toFloats((shape >> (2 * kUvBits)) & ((1 << kConeBits) - 1));
    constexpr float kMax = static_cast<float>((1 << kConeBits) - 1);
    return 1.0f - q * q * (2.0f / (kMax * kMax));
  }
  template <int kBands>
  __attribute__((always_inline)) void ratios(Floats* g) const {
    bandRatios<kBands>(cosines(), g);
  }
  __attribute__((always_inline)) void unpackDirection(Floats& x, Floats& y, Floats& z) const {
    unpackDirections<kUvBits>(shape, x, y, z);
  }
};
using GridIrradianceLinks = CompactLinks<std::uint32_t, 12, 8>;
using Oct6Links = CompactLinks<std::uint16_t, 6, 4>;

#if RELUME_LANES == 16
// Ratios of bands 1 to 3 for the sixteen cones of oct6 links.
struct RatioTable {
  alignas(64) float band[3][16];

  constexpr RatioTable() : band{} {
    for (int q = 0; q < 16; ++q) {
      const float c = 1.0f - static_cast<float>(2 * q * q) / 225.0f;
      band[0][q] = 1.0f + c;
      band[1][q] = (1.0f + c) * c;
      band[2][q] = (1.0f + c) * (5.0f * c * c - 1.0f);
    }
  }
};
constexpr RatioTable kRatioTable;
#endif

// oct6 links that LinkSet has packed again.
struct RepackedLinks {
  Ints word;
#if RELUME_LANES == 4
  Ints f;
#else
  Bytes f;
#endif

  // LinkSet has room behind the last link.
  __attribute__((always_inline)) RepackedLinks(const LightCachesJob& job, std::size_t at, int count)
      : word(load<Ints>(job.word + at)),
#if RELUME_LANES == 4
        f(firstOfFourBytes(job.transfer + at, count)) {
  }
#else
        f(loadFirstBytes<Bytes>(job.transfer + at, count)) {
  }
#endif
  static void writeNodes(const LightCachesJob& job, std::uint32_t cache, std::size_t at, int count,
                         std::uint32_t* node) {
    const std::uint8_t* step = job.nodeStep + std::size_t{job.nodeSteps} * cache;
    int next = -static_cast<int>(at - rowBegin(job, cache)), i = 0;
    std::int32_t high = 0;
    for (std::uint32_t k = 0; k <= job.nodeSteps; ++k) {
      next = k < job.nodeSteps ? next + step[k] : count;
      const int last = next < count ? next : count;
      // What is written past the step's last is written again by the next step.
      for (int j = i; j < last; j += kLanes) {
        const Ints each = (load<Ints>(job.word + at + j) & 0xFFFF) + high;
        __builtin_memcpy(node + j, &each, sizeof each);
      }
      if (last > i) i = last;
      if (k < job.nodeSteps && step[k] != kNoGrowth) high += 1 << 16;
    }
    const Ints zero{};
    __builtin_memcpy(node + count, &zero, sizeof zero);
  }
#if RELUME_LANES == 4
  // Halves without a conversion: their bits, put where a float has them, are 2^112 too small. (f never is a denormal
  // half: link_set.cpp.)
  Floats transfer() const { return asFloats(f << 19) * 0x1p112f; }
#else
  Floats transfer() const { return halvesToFloats(bytesToHalves(f) << 6); }
#endif
#if RELUME_LANES == 16
  // The high bits of a row's nodes, which grow by 2^16 from some indices on, for vectors read in their order.
  struct Row {
    const std::uint8_t *step, *end;
    std::int32_t next;  // index of the next step
    Ints high{};        // of the nodes before it

    __attribute__((always_inline)) Row(const LightCachesJob& job, std::uint32_t cache)
        : step(job.nodeStep + std::size_t{job.nodeSteps} * cache),
          end(step + job.nodeSteps),
          next(step < end ? *step : kNever) {}
    __attribute__((always_inline)) Ints nodes(Ints low, std::int32_t index) {
      Ints node = low | high;
      while (next < index + kLanes) {
        const std::int32_t growth = *step != kNoGrowth ? 1 << 16 : 0;
        node += (laneNumbers<Ints>() + index >= next) & growth;
        high += growth;
        next = ++step < end ? next + *step : kNever;
      }
      return node;
    }
    static constexpr std::int32_t kNever = INT32_MAX;
  };
  // What carries nothing is not read. The bits of f, put where a float has them, add to the exponent of a colour's
  // unit: a product without a multiplication, 2^8 too small (f never is a denormal half: link_set.cpp).
  static constexpr float kColorUnit = 256.0f;
  __attribute__((always_inline)) void colors(const std::uint32_t* node, Row& row, std::int32_t index, int,
                                             Floats* color) const {
    const Ints at = row.nodes(word & 0xFFFF, index);
    const __mmask16 carries = _mm_test_epi8_mask((__m128i)f, (__m128i)f);
    const auto bits = (Ints)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), carries, (__m512i)at, node, 4);
    const Ints unit = ((bits >> 3) & 0x1F800000) | (64 << 23), factor = bytesToInts(f) << 19;
    colorsInUnits(bits, (Floats)_mm512_maskz_add_epi32(carries, (__m512i)unit, (__m512i)factor), color);
  }
#endif
  __attribute__((always_inline)) Floats cosines() const {
    const Floats q = toFloats((word >> 28) & 15);
    return 1.0f - q * q * (2.0f / 225.0f);
  }
  template <int kBands>
  __attribute__((always_inline)) void ratios(Floats* g) const {
#if RELUME_LANES == 16
    if constexpr (kBands <= 4) {
      const __m512i cone = _mm512_maskz_srli_epi32(kAll, (__m512i)word, 28);
      g[0] = splat(1.0f);
      for (int l = 1; l < kBands; ++l)
        g[l] = (Floats)_mm512_maskz_permutexvar_ps(kAll, cone, _mm512_load_ps(kRatioTable.band[l - 1]));
      return;
    }
#endif
    bandRatios<kBands>(cosines(), g);
  }
  __attribute__((always_inline)) void unpackDirection(Floats& x, Floats& y, Floats& z) const {
    unpackDirections<6, 16>(word, x, y, z);
  }
};

}  // namespace
}  // namespace relume::cpu
