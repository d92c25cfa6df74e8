// SPDX-License-Identifier: MIT
// The cells of a cube's faces, into which a bundle's rays are sorted: by face, strip of kBundleStrip rows of cells,
// column and row. A rectangle's rays are one range a strip, a block's (kBundleStrip² cells) one range.
#pragma once

#include "bake/rays/bundle/bundle_vectors.h"

namespace relume {
namespace {

constexpr float kSlack = 1e-5f;       // of coordinates on a face
constexpr float kSlackCells = 1e-3f;  // of cells
constexpr std::uint32_t kBlockCells = kBundleStrip * kBundleStrip;

// Coordinates on a face, tangents, become nearly angles, so that rays are nearly as dense everywhere: 4 / pi atan(u).
// Odd and monotonic on [-1, 1].
inline Floats evenOut(Floats u) {
  const Floats u2 = u * u;
  return u * (1.2732395f - u2 * (0.3795f - u2 * 0.1062605f));
}

// The coordinate that becomes `even`, by Newton's method.
inline Floats unevenOut(Floats even) {
  Floats u = even;
  for (int step = 0; step < 4; ++step) {
    const Floats u2 = u * u;
    u -= (evenOut(u) - even) / (1.2732395f - u2 * (3.0f * 0.3795f - u2 * (5.0f * 0.1062605f)));
  }
  return u;
}

// Coordinates on a face go from -1 to 1, its cells from 0 to side - 1.
struct FaceCells {
  explicit FaceCells(std::uint32_t blocksASide)
      : blocks(blocksASide), side(kBundleStrip * blocks), count(side * side), half(0.5f * static_cast<float>(side)) {}

  Ints of(Floats u, float shift = 0.0f) const {
    const Floats inside = min(max(u, splat(-1.0f)), splat(1.0f));
    const Floats cell = evenOut(inside) * half + (half + shift);
    return __builtin_convertvector(min(max(cell, Floats{}), splat(static_cast<float>(side - 1))), Ints);
  }

  std::uint32_t blocks, side, count;  // blocks along a side, cells along a side, cells of a face
  float half;
};

// Coordinates between which the rays of a column, or a row, of blocks lie.
struct BlockEdges {
  explicit BlockEdges(const FaceCells& cells) {
    const float slack = kSlack + 4.0f * kSlackCells / static_cast<float>(cells.side);
    const float block = 2.0f / static_cast<float>(cells.blocks);
    for (std::uint32_t x = 0; x < cells.blocks; x += kBundleLanes) {
      const Floats from = __builtin_convertvector(kLane + static_cast<std::int32_t>(x), Floats) * block - 1.0f;
      store(begin + x, unevenOut(min(from, splat(1.0f))) - slack);
      store(end + x, unevenOut(min(from + block, splat(1.0f))) + slack);
    }
  }

  float begin[kMaxBundleBlocks + kBundleLanes] = {}, end[kMaxBundleBlocks + kBundleLanes] = {};
};

// The registers of rays are aligned: what was stored as one is read as one.
constexpr std::uint32_t firstOf(std::uint32_t ray) { return ray & ~(kBundleLanes - 1); }
inline Ints lanesWithin(std::uint32_t first, std::uint32_t begin, std::uint32_t end) {
  return (kLane >= static_cast<std::int32_t>(begin - first)) & (kLane < static_cast<std::int32_t>(end - first));
}

// Puts the rays into the order of their cells, none of them with a hit yet.
inline void sortRays(const BundleJob& job, const FaceCells& cells) {
  const std::uint32_t count = job.count, blocksAFace = cells.blocks * cells.blocks;
  for (std::uint32_t i = 0; i <= 6 * cells.count; ++i) job.begin[i] = 0;

  // Find each ray's face and cell.
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
    const Ints column = cells.of(u), row = cells.of(v);
    const Ints face = (alongX ? Ints{} : alongY ? Ints{} + 2 : Ints{} + 4) + (depth < 0.0f ? Ints{} + 1 : Ints{});
    constexpr auto kStrip = static_cast<std::int32_t>(kBundleStrip);
    const auto side = static_cast<std::int32_t>(cells.side);
    const Ints cell = face * (side * side) + row / kStrip * (kStrip * side) + column * kStrip + row % kStrip;
    store(job.faceU + first, u);
    store(job.faceV + first, v);
    store(job.place + first, cell);
    for (std::uint32_t i = 0; i < lanes; ++i) ++job.begin[job.place[first + i] + 1];
  }

  // Put them in order.
  for (std::uint32_t i = 0; i < 6 * cells.count; ++i) {
    job.cursor[i] = job.begin[i];
    job.begin[i + 1] += job.begin[i];
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t place = job.cursor[job.place[i]]++;
    job.place[i] = place;
    job.u[place] = job.faceU[i];
    job.v[place] = job.faceV[i];
    job.x[place] = job.direction[3 * i];
    job.y[place] = job.direction[3 * i + 1];
    job.z[place] = job.direction[3 * i + 2];
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    job.t[i] = kInfinity;
    job.hit[i] = kBundleNone;
  }
  for (std::uint32_t i = 0; i < 6 * blocksAFace; ++i) {
    const std::uint32_t end = job.begin[(i + 1) * kBlockCells];
    for (std::uint32_t k = job.begin[i * kBlockCells]; k < end; ++k) {
      job.block[k] = static_cast<std::uint16_t>(i % blocksAFace);
    }
  }
}

}  // namespace
}  // namespace relume
