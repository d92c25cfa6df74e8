// SPDX-License-Identifier: MIT
// The kernels of light_surfels.h and pull.h for one vector width (vectors.h): lanes are surfels, or nodes.
#pragma once

#include "runtime/cpu/color_caches_kernel.h"
#include "runtime/cpu/light_row.h"
#include "runtime/cpu/light_surfels_job.h"
#include "runtime/cpu/lobe.h"
#include "runtime/cpu/vectors.h"

#include <utility>

namespace relume::cpu {
namespace {

inline Floats3 splat3(const float* v) { return {splat(v[0]), splat(v[1]), splat(v[2])}; }

inline Ints loadWord(const LightSurfelsJob& job, int word, std::uint32_t first) {
  return load<Ints>(job.word[word] + first);
}

// Unsigned halves of words.
inline Floats lowHalf(Ints v) { return toFloats(v & 0xFFFF); }
inline Floats highHalf(Ints v) { return toFloats((v >> 16) & 0xFFFF); }

inline Floats3 positions(const LightSurfelsJob& job, std::uint32_t first) {
  const Ints xy = loadWord(job, 0, first);
  return {job.origin[0] + job.step[0] * lowHalf(xy), job.origin[1] + job.step[1] * highHalf(xy),
          job.origin[2] + job.step[2] * lowHalf(loadWord(job, 1, first))};
}

inline Floats3 normals(const LightSurfelsJob& job, std::uint32_t first) {
  Floats3 n;
  unpackDirections<12>(loadWord(job, 2, first), n.x, n.y, n.z);
  return n;
}

// discFactor() of direct_light.cpp, of the squares of the height and of the distance in radii; 0 below the plane.
inline Floats discFactor(Floats b, Floats a, float inverseRadius2) {
  const Floats zero{}, one = splat(1.0f), tiny = splat(1e-30f);
  const auto root = [tiny](Floats v) __attribute__((always_inline)) { return v * inverseSqrt(max(v, tiny)); };
  const Floats u = a - one, w = max(root(u * u + 4.0f * b), splat(1e-15f));
  const Floats across2 = (u > zero ? 2.0f * b / (w + u) : 0.5f * (w - u)) / w;
  const Floats x = min(root(across2 / max(a, b + one)), one);
  const Floats factor = (2.0f * inverseRadius2) * x / (one + root(one - x));
  return b > zero ? factor : zero;
}

// What a light's intensity is multiplied with. KHR_lights_punctual: E = I cos / d², with a window that ends at the
// range. Near surfels are discs.
inline Floats lightFactor(const LightSurfelsJob& job, const PreparedLight& light, const Floats3& p, const Floats3& n) {
  const Floats zero{}, one = splat(1.0f);
  const Floats3 direction = splat3(light.direction);
  if (light.kind == 0) return max(-dot(direction, n), zero);
  const Floats3 toward{light.position[0] - p.x, light.position[1] - p.y, light.position[2] - p.z};
  const Floats d2 = max(dot(toward, toward), splat(1e-12f));
  const Floats cosineTimesD = max(dot(toward, n), zero);
  const Floats inverseD = inverseSqrt(d2), share = d2 * light.inverseRange2;
  Floats factor = cosineTimesD * inverseD / max(d2, splat(1e-8f));
  const Floats reach2 = splat(job.discReach2);
  if (maxLane(reach2 - d2) > 0.0f) {
    const float r = job.inverseRadius2;
    factor = d2 < reach2 ? discFactor(cosineTimesD * cosineTimesD * r, d2 * r, r) : factor;
  }
  factor *= max(one - share * share, zero);
  if (light.kind == 2) {
    const Floats cosine = -dot(direction, toward) * inverseD;
    const Floats t = min(max((cosine - light.cosOuter) * light.coneScale, zero), one);
    factor *= t * t;
  }
  return factor;
}

inline void lightDirectly(const LightSurfelsJob& job, std::uint32_t first, std::uint32_t count, float* e) {
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    const Floats3 p = positions(job, first + i), n = normals(job, first + i);
    Floats r{}, g{}, b{};
    for (std::uint32_t k = 0; k < job.lightCount; ++k) {
      const PreparedLight& light = job.light[k];
      const Floats factor = lightFactor(job, light, p, n);
      r += light.intensity[0] * factor;
      g += light.intensity[1] * factor;
      b += light.intensity[2] * factor;
    }
    store(e + i, r);
    store(e + kSurfelBlock + i, g);
    store(e + 2 * kSurfelBlock + i, b);
  }
}

// The four texels around receivers and their weights, as texelsAround() of stencil.h.
struct TexelQuads {
  Ints texel[4];
  Floats weight[4];

  TexelQuads(const LightSurfelsJob& job, Ints receiver) {
    const Floats zero{}, one = splat(1.0f);
    const auto width = static_cast<float>(job.mapWidth), height = static_cast<float>(job.mapHeight);
    const Floats x = min(max(lowHalf(receiver) * (width / 65535.0f) - 0.5f, zero), splat(width - 1.0f));
    const Floats y = min(max(highHalf(receiver) * (height / 65535.0f) - 0.5f, zero), splat(height - 1.0f));
    const Ints x0 = __builtin_convertvector(x, Ints), y0 = __builtin_convertvector(y, Ints);
    // One texel on, but for the last.
    const Ints right = (x0 + 1 < job.mapWidth) & 1, down = (y0 + 1 < job.mapHeight) & job.mapWidth;
    const Floats fx = x - toFloats(x0), fy = y - toFloats(y0);
    texel[0] = y0 * job.mapWidth + x0;
    texel[1] = texel[0] + right;
    texel[2] = texel[0] + down;
    texel[3] = texel[1] + down;
    weight[0] = (one - fx) * (one - fy);
    weight[1] = fx * (one - fy);
    weight[2] = (one - fx) * fy;
    weight[3] = fx * fy;
  }

  // Their caches, counted from the light map's first, all ones where there is none. Where a texel's right neighbour is
  // not the next one, but the same, its weight is 0 and its cache anything.
  __attribute__((always_inline)) void caches(const LightSurfelsJob& job, Ints* cache) const {
    if (job.mapCache != nullptr) {
      for (int k = 0; k < 4; k += 2) {
        const Ints pair = gatherPairs(job.mapCache, texel[k]), first = pair & 0xFFFF, second = (pair >> 16) & 0xFFFF;
        cache[k] = first | (first == 0xFFFF);
        cache[k + 1] = second | (second == 0xFFFF);
      }
      return;
    }
    for (int k = 0; k < 4; ++k) {
      const Ints found = gather(job.wideMapCache, texel[k]);
      cache[k] = (found - job.wideFirst) | (found == -1);
    }
  }
};

// Adds the colours of these caches, and their weights, where there are any.
inline void addCaches(const LightSurfelsJob& job, Ints cache, Floats weight, Floats& r, Floats& g, Floats& b,
                      Floats& total) {
  const Ints isThere = cache != -1, bits = gather(job.color, cache & isThere);
  weight = asFloats(asInts(weight) & isThere);
  Floats tr, tg, tb;
  unpackColors(bits, tr, tg, tb);
  r += weight * tr;
  g += weight * tg;
  b += weight * tb;
  total += weight;
}

inline void addFlatBounce(const LightSurfelsJob& job, std::uint32_t first, std::uint32_t count, float* e) {
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    const Ints receiver = loadWord(job, 3, first + i);
    const TexelQuads quads(job, receiver);
    Ints cache[4];
    quads.caches(job, cache);
    Floats r{}, g{}, b{}, total{};
    for (int k = 0; k < 4; ++k) addCaches(job, cache[k], quads.weight[k], r, g, b, total);
    Floats scale = job.bounceScale / max(total, splat(1e-20f));
    scale = asFloats(asInts(scale) & (receiver != -1) & (total > 0.0f));
    store(e + i, load<Floats>(e + i) + scale * r);
    store(e + kSurfelBlock + i, load<Floats>(e + kSurfelBlock + i) + scale * g);
    store(e + 2 * kSurfelBlock + i, load<Floats>(e + 2 * kSurfelBlock + i) + scale * b);
  }
}

// Eight coefficients, in vectors no wider than the kernel's: g++ 12 keeps wider ones in memory.
constexpr int kPartLanes = kLanes < 8 ? kLanes : 8, kParts = 8 / kPartLanes;
using Part = FloatsOf<kPartLanes>;
using Eight = FloatsOf<8>;

// Nine coefficients each of Y, Co, Cg summed over caches under a lobe: the first and eight more. Co and Cg may be left
// out beyond their first kChromaParts vectors.
template <int kChromaParts>
struct LobeSum {
  float first[3] = {};
  Part luma[kParts] = {}, chroma[2][kChromaParts] = {};

  // share: weight times the row's unit.
  __attribute__((always_inline)) void add(const LightRows& light, const std::uint16_t* row, float share) {
    const std::uint16_t* const y = row + 1;
    const std::uint16_t* const channel[3] = {y, y + light.lumaCount, y + light.lumaCount + light.chromaCount};
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) {
      first[c] += share * wordAt(channel[c]);
      addParts(channel[c] + 1, share, c == 0 ? luma : chroma[c - 1], c == 0 ? kParts : kChromaParts);
    }
  }
  // Y, Co, Cg under the lobe. stored: 1 where Co and Cg have a coefficient; past their own, they have read another
  // channel's.
  __attribute__((always_inline)) void finish(const LightRows& light, const float* lobe, const Part* stored, float& y,
                                             float& co, float& cg) const {
    Part others[kParts], chromas[kChromaParts];
    for (int k = 0; k < kParts; ++k) others[k] = load<Part>(lobe + 1 + k * kPartLanes);
    for (int k = 0; k < kChromaParts; ++k) chromas[k] = others[k] * stored[k];
    y = lobe[0] * first[0] + sumParts<kParts>(others, luma);
    if (light.chromaCount == 1 && light.lumaCount > 1) {
      // Chroma follows luma.
      const float ratio = first[0] > 0.0f ? y / first[0] : 0.0f;
      co = ratio * first[1];
      cg = ratio * first[2];
    } else {
      co = lobe[0] * first[1] + sumParts<kChromaParts>(chromas, chroma[0]);
      cg = lobe[0] * first[2] + sumParts<kChromaParts>(chromas, chroma[1]);
    }
  }

 private:
  __attribute__((always_inline)) static void addParts(const std::uint16_t* words, float share, Part* sum, int parts) {
#pragma GCC unroll 2
    for (int k = 0; k < parts; ++k) sum[k] += share * loadWords<kPartLanes>(words + k * kPartLanes);
  }
  template <int kCount>
  __attribute__((always_inline)) static float sumParts(const Part* a, const Part* b) {
    if constexpr (kCount == 1) return sumLanes(a[0] * b[0]);
    return sumLanes(a[0] * b[0] + a[kCount - 1] * b[kCount - 1]);
  }
};

struct StoredChroma {
  Part part[kParts];

  explicit StoredChroma(const LightRows& light) {
    for (std::uint32_t i = 0; i < 8; ++i)
      part[i / kPartLanes][i % kPartLanes] = i + 1 < light.chromaCount ? 1.0f : 0.0f;
  }
};

#if RELUME_LANES == 16
// The same with two bands of chroma: Y in one vector, Co and Cg in the halves of another.
struct TwoBandLobeSum {
  Floats luma{};
  Eight chroma = {};

  __attribute__((always_inline)) void add(const LightRows& light, const std::uint16_t* row, float share) {
    luma += share * loadWords<16>(row + 1);
    chroma += share * loadWords<8>(row + 1 + light.lumaCount);
  }
  __attribute__((always_inline)) void finish(const LightRows&, const float* lobe, const Part*, float& y, float& co,
                                             float& cg) const {
    y = sumLanes(luma * (Floats)_mm512_maskz_loadu_ps(0x1FF, lobe));
    const Float4 four = load<Float4>(lobe);
    const Float4 a = four * __builtin_shufflevector(chroma, chroma, 0, 1, 2, 3);
    const Float4 b = four * __builtin_shufflevector(chroma, chroma, 4, 5, 6, 7);
    const Float4 pairs = __builtin_shufflevector(a, b, 0, 1, 4, 5) + __builtin_shufflevector(a, b, 2, 3, 6, 7);
    co = pairs[0] + pairs[1];
    cg = pairs[2] + pairs[3];
  }
};
#else
using TwoBandLobeSum = LobeSum<1>;
#endif

#if RELUME_LANES == 16
// One step of a transposition: swaps bit kBit of rows' and lanes' numbers.
template <int kBit, int... kLane>
__attribute__((always_inline)) inline void swapBit(Floats* row, std::integer_sequence<int, kLane...>) {
  for (int i = 0; i < 16; ++i) {
    if (i & kBit) continue;
    const Floats low = row[i], high = row[i | kBit];
    row[i] = __builtin_shufflevector(low, high, (kLane & kBit ? 16 + (kLane ^ kBit) : kLane)...);
    row[i | kBit] = __builtin_shufflevector(low, high, (kLane & kBit ? 16 + kLane : kLane ^ kBit)...);
  }
}
#endif

// rows[lane][k] = vectors[k][lane] for nine vectors; the rest of a row may be anything finite.
__attribute__((always_inline)) inline void writeTransposed(const Floats* vectors, float (*rows)[16]) {
#if RELUME_LANES == 16
  constexpr std::make_integer_sequence<int, 16> kAllLanes;
  Floats row[16] = {};
  for (int k = 0; k < 9; ++k) row[k] = vectors[k];
  swapBit<8>(row, kAllLanes);
  swapBit<4>(row, kAllLanes);
  swapBit<2>(row, kAllLanes);
  swapBit<1>(row, kAllLanes);
  for (int i = 0; i < 16; ++i) store(rows[i], row[i]);
#else
  for (int k = 0; k < 9; ++k) {
    for (int i = 0; i < kLanes; ++i) rows[i][k] = vectors[k][i];
  }
#endif
}

// Y, Co, Cg to red, green and blue, not negative, times bounceScale.
__attribute__((always_inline)) inline void toBouncedRgb(const LightSurfelsJob& job, float (*sum)[kLanes]) {
  const Floats y = load<Floats>(sum[0]), co = load<Floats>(sum[1]), cg = load<Floats>(sum[2]), t = y - cg, zero{};
  store(sum[0], job.bounceScale * max(t + co, zero));
  store(sum[1], job.bounceScale * max(y + cg, zero));
  store(sum[2], job.bounceScale * max(t - co, zero));
}

// Lanes are surfels up to their lobes and caches, then one surfel at a time with coefficients as lanes.
template <class Sum>
inline void addTilted(const LightSurfelsJob& job, std::uint32_t first, const TiltedSurfel* tilted, std::uint32_t count,
                      const float* before, float* e) {
  const auto* lobes = reinterpret_cast<const std::uint32_t*>(job.lobe);
  const LightRows light = job.mapLight;
  const StoredChroma chroma(light);
  for (std::uint32_t begin = 0; begin < count; begin += kLanes) {
    const std::uint32_t here = count - begin < kLanes ? count - begin : kLanes;
    Ints surfel{}, angle{};
    for (std::uint32_t i = 0; i < here; ++i) {
      surfel[i] = static_cast<std::int32_t>(first + tilted[begin + i].slot);
      angle[i] = tilted[begin + i].angle;
    }
    Floats3 n;
    unpackDirections<12>(gather(job.word[2], surfel), n.x, n.y, n.z);
    TexelQuads quads(job, gather(job.word[3], surfel));
    alignas(64) std::uint32_t pair[4][kLanes];  // of words, where a cache's row begins
    alignas(64) float weight[4][kLanes], lobe[kLanes][16], sum[3][kLanes] = {};
    Floats total{};
    Ints cache[4];
    quads.caches(job, cache);
    for (int k = 0; k < 4; ++k) {
      const Ints isThere = cache[k] != -1;
      const Ints index = cache[k] * static_cast<std::int32_t>(light.words / 2) & isThere;
      __builtin_memcpy(pair[k], &index, sizeof index);
      quads.weight[k] = asFloats(asInts(quads.weight[k]) & isThere);
      store(weight[k], quads.weight[k] * unitsOf(light, index));
      total += quads.weight[k];
    }
    const Floats share = 1.0f / max(total, splat(1e-20f));
    Floats vectors[9];
    writeLobe(true, job.thirdBand, n, asFloats(gather(lobes, angle * 2)) * share,
              asFloats(gather(lobes, angle * 2 + 1)) * share, vectors);
    writeTransposed(vectors, lobe);
    for (std::uint32_t i = 0; i < here; ++i) {
      Sum each;
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) each.add(light, light.word + 2 * std::size_t{pair[k][i]}, weight[k][i]);
      each.finish(light, lobe[i], chroma.part, sum[0][i], sum[1][i], sum[2][i]);
    }
    toBouncedRgb(job, sum);
    for (std::uint32_t c = 0; c < 3; ++c) {
      float* to = e + c * kSurfelBlock;
      const float* from = before + c * kSurfelBlock + begin;
      for (std::uint32_t i = 0; i < here; ++i) to[tilted[begin + i].slot] = from[i] + sum[c][i];
    }
  }
}

inline void addTiltedBounce(const LightSurfelsJob& job, std::uint32_t first, const TiltedSurfel* tilted,
                            std::uint32_t count, const float* before, float* e) {
  if (job.mapLight.chromaCount == 4) return addTilted<TwoBandLobeSum>(job, first, tilted, count, before, e);
  addTilted<LobeSum<kParts>>(job, first, tilted, count, before, e);
}

// The same for surfels of the grid, whose caches are known.
template <class Sum>
inline void addGridded(const LightSurfelsJob& job, std::uint32_t first, const GriddedSurfel* gridded,
                       std::uint32_t count, const std::uint32_t* share, float* e) {
  const LightRows light = job.gridLight;
  const StoredChroma chroma(light);
  for (std::uint32_t begin = 0; begin < count; begin += kLanes) {
    const std::uint32_t here = count - begin < kLanes ? count - begin : kLanes;
    Ints surfel{};
    for (std::uint32_t i = 0; i < here; ++i) surfel[i] = static_cast<std::int32_t>(first + gridded[begin + i].slot);
    Floats3 n;
    unpackDirections<12>(gather(job.word[2], surfel), n.x, n.y, n.z);
    Floats vectors[9];
    writeLobe(light.lumaCount > 1, job.thirdBand, n, Floats{}, splat(1.0f / static_cast<float>(kShareOne)), vectors);
    alignas(64) float lobe[kLanes][16], sum[3][kLanes] = {};
    writeTransposed(vectors, lobe);
    for (std::uint32_t i = 0; i < here; ++i) {
      Sum each;
      for (std::uint32_t k = gridded[begin + i].caches; k > 0; --k, ++share) {
        const std::uint16_t* const row = rowOf(light, *share & ((1u << kShareShift) - 1));
        each.add(light, row, unitOf(row) * static_cast<float>(*share >> kShareShift));
      }
      each.finish(light, lobe[i], chroma.part, sum[0][i], sum[1][i], sum[2][i]);
    }
    toBouncedRgb(job, sum);
    for (std::uint32_t c = 0; c < 3; ++c) {
      for (std::uint32_t i = 0; i < here; ++i) e[c * kSurfelBlock + gridded[begin + i].slot] += sum[c][i];
    }
  }
}

inline void addGriddedBounce(const LightSurfelsJob& job, std::uint32_t first, const GriddedSurfel* gridded,
                             std::uint32_t count, const std::uint32_t* share, float* e) {
  if (job.gridLight.chromaCount == 4) return addGridded<TwoBandLobeSum>(job, first, gridded, count, share, e);
  addGridded<LobeSum<kParts>>(job, first, gridded, count, share, e);
}

inline void listBits(const std::uint64_t* bits, std::uint32_t first, std::uint32_t wanted, std::uint32_t* at) {
  std::uint32_t number = first / 64 * 64;
  std::uint64_t word = bits[first / 64] & (~std::uint64_t{0} << (first % 64));
  for (const std::uint32_t* const end = at + wanted;; number += 64, word = bits[number / 64]) {
#if RELUME_LANES == 16
    for (std::uint32_t part = 0; part < 64; part += 16) {
      const auto here = static_cast<std::uint32_t>(word >> part) & 0xFFFFu;
      const Ints numbers = static_cast<std::int32_t>(number + part) + laneNumbers<Ints>();
      _mm512_storeu_si512(at, _mm512_maskz_compress_epi32(static_cast<__mmask16>(here), (__m512i)numbers));
      at += __builtin_popcount(here);
      if (at >= end) return;
    }
#else
    for (; word != 0; word &= word - 1) {
      *at++ = number + static_cast<std::uint32_t>(__builtin_ctzll(word));
      if (at == end) return;
    }
#endif
  }
}

// Up to kLanes packed colours to these nodes.
inline void scatter(Ints colors, const std::uint32_t* at, std::uint32_t count, std::uint32_t* node) {
#if RELUME_LANES == 16
  const auto there = static_cast<__mmask16>(count < kLanes ? (1u << count) - 1 : 0xFFFFu);
  _mm512_mask_i32scatter_epi32(node, there, load<__m512i>(at), (__m512i)colors, 4);
#else
  for (std::uint32_t i = 0; i < (count < kLanes ? count : kLanes); ++i)
    node[at[i]] = static_cast<std::uint32_t>(colors[i]);
#endif
}

inline void storeSurfels(const LightSurfelsJob& job, std::uint32_t first, std::uint32_t count, const float* e,
                         const float* emitted, const std::uint32_t* at, std::uint32_t* node) {
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    const Ints redGreen = loadWord(job, 1, first + i), blue = loadWord(job, 2, first + i);
    constexpr float kUnit = 1.0f / 255.0f;
    Floats r = load<Floats>(e + i) * toFloats((redGreen >> 16) & 255) * kUnit;
    Floats g = load<Floats>(e + kSurfelBlock + i) * toFloats((redGreen >> 24) & 255) * kUnit;
    Floats b = load<Floats>(e + 2 * kSurfelBlock + i) * toFloats((blue >> 24) & 255) * kUnit;
    if (emitted) {
      r += load<Floats>(emitted + i);
      g += load<Floats>(emitted + kSurfelBlock + i);
      b += load<Floats>(emitted + 2 * kSurfelBlock + i);
    }
    // `at` has room for a whole block.
    scatter(packColors(r, g, b, dithers(load<Ints>(at + i))), at + i, count - i, node);
  }
}

// Words 0, 2, 4, .. of two vectors in a row, and words 1, 3, 5, ..
inline void separate(Ints a, Ints b, Ints& even, Ints& odd) {
#if RELUME_LANES == 16
  even = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  odd = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
#elif RELUME_LANES == 8
  even = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14);
  odd = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15);
#else
  even = __builtin_shufflevector(a, b, 0, 2, 4, 6);
  odd = __builtin_shufflevector(a, b, 1, 3, 5, 7);
#endif
}

inline void pullNodes(const std::uint32_t* child, const std::uint16_t* weight, const std::uint32_t* at,
                      std::uint32_t count, std::uint32_t* node) {
  for (std::uint32_t i = 0; i < count; i += kLanes) {
    Ints pair[2] = {};
    HalvesOf<kLanes> share{};
    if (count - i >= kLanes) {
      __builtin_memcpy(pair, child + 2 * i, sizeof pair);
      __builtin_memcpy(&share, weight + i, sizeof share);
    } else {
      __builtin_memcpy(pair, child + 2 * i, 2 * sizeof(std::uint32_t) * (count - i));
      __builtin_memcpy(&share, weight + i, sizeof(std::uint16_t) * (count - i));
    }
    Ints even, odd;
    separate(pair[0], pair[1], even, odd);
    Floats r, g, b, otherR, otherG, otherB;
    unpackColors(even, r, g, b);
    unpackColors(odd, otherR, otherG, otherB);
    const Floats w = toFloats(__builtin_convertvector(share, Ints)) * (1.0f / 65534.0f);
    const Ints mean = packColors(otherR + w * (r - otherR), otherG + w * (g - otherG), otherB + w * (b - otherB),
                                 dithers(load<Ints>(at + i)));
    scatter(mean, at + i, count - i, node);
  }
}

}  // namespace
}  // namespace relume::cpu
