// SPDX-License-Identifier: MIT
// Sorts the rays of a bundle into bins: small rectangles of the faces of a cube around the bundle's origin. Bins are in
// the order of their face, strip of kBundleStrip rows, column and row. So the rays of a rectangle of bins are one range
// per strip, and those of a block (kBundleStrip x kBundleStrip bins) are one range.
#pragma once

#include "bake/rays/bundle/bundle_vectors.h"

namespace relume {
namespace {

constexpr float kSlack = 1e-5f;      // of coordinates on a face
constexpr float kSlackBins = 1e-3f;  // of bins
constexpr std::uint32_t kBlockBins = kBundleStrip * kBundleStrip;

// Turns coordinates on a face, which are tangents, nearly into angles, 4 / pi atan(u), so that rays are nearly as dense
// everywhere. Odd and monotonic on [-1, 1].
inline Floats evenOut(Floats u) {
  const Floats u2 = u * u;
  return u * (1.2732395f - u2 * (0.3795f - u2 * 0.1062605f));
}

// The inverse, by Newton's method: the coordinate that evenOut() turns into `even`.
inline Floats unevenOut(Floats even) {
  Floats u = even;
  for (int step = 0; step < 4; ++step) {
    const Floats u2 = u * u;
    u -= (evenOut(u) - even) / (1.2732395f - u2 * (3.0f * 0.3795f - u2 * (5.0f * 0.1062605f)));
  }
  return u;
}

// The bins of a face, whose coordinates go from -1 to 1. Bins are numbered from 0 to side - 1 along each axis.
struct FaceBins {
  explicit FaceBins(std::uint32_t blocksASide)
      : blocks(blocksASide), side(kBundleStrip * blocks), count(side * side), half(0.5f * static_cast<float>(side)) {}

  Ints of(Floats u, float shift = 0.0f) const {
    const Floats inside = min(max(u, splat(-1.0f)), splat(1.0f));
    const Floats bin = evenOut(inside) * half + (half + shift);
    return __builtin_convertvector(min(max(bin, Floats{}), splat(static_cast<float>(side - 1))), Ints);
  }

  std::uint32_t blocks, side, count;  // blocks along a side, bins along a side, bins of a face
  float half;
};

// The interval of coordinates in which all rays of a column of blocks, or of a row, lie.
struct BlockEdges {
  explicit BlockEdges(const FaceBins& bins) {
    const float slack = kSlack + 4.0f * kSlackBins / static_cast<float>(bins.side);
    const float block = 2.0f / static_cast<float>(bins.blocks);
    for (std::uint32_t x = 0; x < bins.blocks; x += kBundleLanes) {
      const Floats from = __builtin_convertvector(kLane + static_cast<std::int32_t>(x), Floats) * block - 1.0f;
      store(begin + x, unevenOut(min(from, splat(1.0f))) - slack);
      store(end + x, unevenOut(min(from + block, splat(1.0f))) + slack);
    }
  }

  float begin[kMaxBundleBlocks + kBundleLanes] = {}, end[kMaxBundleBlocks + kBundleLanes] = {};
};

// The arrays of rays are aligned to registers: what is stored as one register is read as one.
constexpr std::uint32_t firstOf(std::uint32_t ray) { return ray & ~(kBundleLanes - 1); }
inline Ints lanesWithin(std::uint32_t first, std::uint32_t begin, std::uint32_t end) {
  return (kLane >= static_cast<std::int32_t>(begin - first)) & (kLane < static_cast<std::int32_t>(end - first));
}

// Sort the rays by their bins, and mark all as having no hit yet.
inline void sortRays(const BundleJob& job, const FaceBins& bins) {
  const std::uint32_t count = job.count, blocksAFace = bins.blocks * bins.blocks;
  for (std::uint32_t i = 0; i <= 6 * bins.count; ++i) job.begin[i] = 0;

  // Find each ray's face and bin.
  for (std::uint32_t first = 0; first < count; first += kBundleLanes) {
    const std::uint32_t lanes = min(kBundleLanes, count - first);
    alignas(32) float lane[3][kBundleLanes];
    for (std::uint32_t i = 0; i < kBundleLanes; ++i) {
      const float* from = job.direction + 3 * (first + min(i, lanes - 1));
      lane[0][i] = from[0], lane[1][i] = from[1], lane[2][i] = from[2];
    }
    const Vectors d{load(lane[0]), load(lane[1]), load(lane[2])};
    const Floats x = magnitude(d.x), y = magnitude(d.y), z = magnitude(d.z);
    const Ints alongX = (x >= y) & (x >= z), alongY = ~alongX & (y >= z);
    const Floats depth = alongX ? d.x : alongY ? d.y : d.z;
    const Floats scale = 1.0f / magnitude(depth);
    const Floats u = (alongX ? d.y : alongY ? d.z : d.x) * scale, v = (alongX ? d.z : alongY ? d.x : d.y) * scale;
    const Ints column = bins.of(u), row = bins.of(v);
    const Ints face = (alongX ? Ints{} : alongY ? Ints{} + 2 : Ints{} + 4) + (depth < 0.0f ? Ints{} + 1 : Ints{});
    constexpr auto kStrip = static_cast<std::int32_t>(kBundleStrip);
    const auto side = static_cast<std::int32_t>(bins.side);
    const Ints bin = face * (side * side) + row / kStrip * (kStrip * side) + column * kStrip + row % kStrip;
    store(job.faceU + first, u);
    store(job.faceV + first, v);
    store(job.slot + first, bin);
    for (std::uint32_t i = 0; i < lanes; ++i) ++job.begin[job.slot[first + i] + 1];
  }

  // Put them in order.
  for (std::uint32_t i = 0; i < 6 * bins.count; ++i) {
    job.cursor[i] = job.begin[i];
    job.begin[i + 1] += job.begin[i];
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t slot = job.cursor[job.slot[i]]++;
    job.slot[i] = slot;
    job.u[slot] = job.faceU[i];
    job.v[slot] = job.faceV[i];
    job.x[slot] = job.direction[3 * i];
    job.y[slot] = job.direction[3 * i + 1];
    job.z[slot] = job.direction[3 * i + 2];
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    job.t[i] = kInfinity;
    job.hit[i] = kBundleNone;
  }
  for (std::uint32_t i = 0; i < 6 * blocksAFace; ++i) {
    const std::uint32_t end = job.begin[(i + 1) * kBlockBins];
    for (std::uint32_t k = job.begin[i * kBlockBins]; k < end; ++k) {
      job.block[k] = static_cast<std::uint16_t>(i % blocksAFace);
    }
  }
}

}  // namespace
}  // namespace relume
