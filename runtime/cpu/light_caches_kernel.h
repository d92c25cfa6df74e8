// SPDX-License-Identifier: MIT
// The kernel of light_caches.h for one vector width (vectors.h).
#pragma once

#include "runtime/cpu/light_row.h"
#include "runtime/cpu/stored_rows.h"
#include "runtime/cpu/summed_rows.h"

namespace relume::cpu {
namespace {

// LinkKind's numbers, without its header.
constexpr std::uint32_t kSh = 0, kCone = 1, kOct6 = 3, kIrradiance = 5;

// Several caches in turn, so that rounding one does not wait for its sums.
constexpr std::uint32_t kTurn = 8;

template <class Links>
ConeRow coneRow(int luma, int chroma) {
  const ConeRow summed = summedRow<Links>(luma, chroma);
  return summed ? summed : kConeRow<Links>[luma - 1];
}

// Add what moving parts change to the coefficients of `caches` caches, at most kTurn, from `first` on. Whole vectors
// reach behind the last of them, where another thread may be writing what its caches change: what is read there is a
// copy. [Size lit = caches * stride]
inline void addChanges(const LightCachesJob& job, std::uint32_t first, std::uint32_t caches, int count, int stride,
                       float* lit) {
  constexpr float kMostScale = 2.0f;  // of a change that was found in other light
  std::int32_t nodes[kTurn + kLanes];
  float perLumas[kTurn + kLanes], scale[kTurn + kLanes];
  for (std::uint32_t k = 0; k < kTurn + kLanes; ++k) {
    nodes[k] = k < caches ? job.changeNode[first + k] : -1;
    perLumas[k] = k < caches ? job.changePerLuma[first + k] : 0.0f;
  }
  for (std::uint32_t k = 0; k < caches; k += kLanes) {
    const Ints node = load<Ints>(nodes + k), changes = node >= 0;
    const Floats perLuma = load<Floats>(perLumas + k);
    Floats color[3];
    scaledColors(gather(job.node, node & changes), perLuma, color);
    const Floats now = min(0.25f * color[0], splat(kMostScale));
    const Ints isScaled = perLuma > 0.0f;
    store(scale + k, asFloats(((asInts(now) & isScaled) | (asInts(splat(1.0f)) & ~isScaled)) & changes));
  }
  const std::uint32_t behind = (kLanes - 1) / job.change.words + 1;  // rows
  for (std::uint32_t k = 0; k < caches; ++k, lit += stride) {
    if (scale[k] == 0.0f) continue;
    const std::uint16_t* row = rowOf(job.change, first + k);
    std::uint16_t last[1 + 3 * 64 + kLanes];
    if (k + behind >= caches) {
      for (int i = 0; i < 1 + count + static_cast<int>(kLanes); ++i)
        last[i] = i < 1 + count ? row[i] : std::uint16_t{0};
      row = last;
    }
    const float unit = scale[k] * unitOf(row);
    for (int i = 0; i < count; i += kLanes) {
      const Ints isOfRow = laneNumbers<Ints>() + i < count;
      const Floats each = unit * loadWords<kLanes>(row + 1 + i);
      store(lit + i, load<Floats>(lit + i) + asFloats(asInts(each) & isOfRow));
    }
  }
}

inline void lightCachesOf(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) {
  const auto pick = job.kind == kCone            ? coneRow<PlainLinks>
                    : job.kind == kOct6          ? coneRow<Oct6Links>
                    : job.kind == kRepackedLinks ? coneRow<RepackedLinks>
                                                 : coneRow<GridIrradianceLinks>;
  const ConeRow row = pick(job.lumaBands, job.chromaBands);
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const int count = luma + 2 * chroma, stride = (count + kLanes - 1) / kLanes * kLanes;
  alignas(64) float lit[kTurn * 3 * 64];
  for (int i = 0; i < static_cast<int>(kTurn) * stride; ++i) lit[i] = 0.0f;
  // Rows that whole vectors, stored from within one, reach behind it.
  const std::uint32_t behind = (kLanes - 1) / job.light.words + 1;
  for (std::uint32_t first = begin; first < end; first += kTurn) {
    const std::uint32_t last = end - first < kTurn ? end : first + kTurn;
    float* to = lit;
    for (std::uint32_t cache = first; cache < last; ++cache, to += stride) {
      float* const out[3] = {to, to + luma, to + luma + chroma};
      const std::uint32_t linksBegin = rowBegin(job, cache), linksEnd = rowBegin(job, cache + 1);
      if (job.kind == kSh) {
        lightShRow(job, linksBegin, linksEnd, out);
      } else if (job.kind == kIrradiance && linksBegin >= job.gridLinks) {
        for (int i = 0; i < count; ++i) to[i] = 0.0f;
        lightIrradianceRow(job, linksBegin, linksEnd, out);
      } else {
        row(job, cache, to);
      }
    }
    if (job.changeNode != nullptr) addChanges(job, first, last - first, count, stride, lit);
    to = lit;
    for (std::uint32_t cache = first; cache < last; ++cache, to += stride)
      storeRow(to, count, cache + behind < end,
               job.light.word + std::size_t{job.light.words} * (cache - job.light.first));
  }
}

}  // namespace
}  // namespace relume::cpu
