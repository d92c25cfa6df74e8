// SPDX-License-Identifier: MIT
// The rays of a fan on the faces of a cube around their point, and how far they reach; see fan_walk.h.
//
// Rays are sorted by face, strip of kFanStrip rows of cells, column and row: a rectangle's rays are one range a strip,
// a block's (kFanStrip² cells) one range. A pyramid over the blocks of a face holds the farthest ray of each.
#pragma once

#include "bake/scene/fan_vectors.h"

namespace relume {
namespace {

constexpr float kSlack = 1e-5f;       // of coordinates on a face
constexpr float kSlackCells = 1e-3f;  // of cells
constexpr std::uint32_t kBlockCells = kFanStrip * kFanStrip;

// The registers of rays are aligned: what was stored as one is read as one.
constexpr std::uint32_t firstOf(std::uint32_t ray) { return ray & ~(kFanLanes - 1); }
inline Ints lanesWithin(std::uint32_t first, std::uint32_t begin, std::uint32_t end) {
  return (kLane >= static_cast<std::int32_t>(begin - first)) & (kLane < static_cast<std::int32_t>(end - first));
}

// Coordinates on a face, tangents, become nearly angles, so that rays are nearly as dense everywhere: 4 / pi atan(u).
// Odd and monotonic on [-1, 1].
inline Floats evenOut(Floats u) {
  const Floats u2 = u * u;
  return u * (1.2732395f - u2 * (0.3795f - u2 * 0.1062605f));
}

// What the lanes' boxes or triangles cover of a face.
struct Rectangles {
  Floats u0, u1, v0, v1;
  Ints x0, x1, y0, y1;  // cells, first and last
};

inline Ints onFace(const Rectangles& r) {
  constexpr float kEdge = 1.0f + kSlack;
  return (r.u0 <= kEdge) & (r.u1 >= -kEdge) & (r.v0 <= kEdge) & (r.v1 >= -kEdge);
}

struct Range {
  std::uint32_t begin, end;
};

class FanRays {
 public:
  explicit FanRays(const FanJob& job)
      : job_(job),
        blocks_(job.blocks),
        side_(kFanStrip * job.blocks),
        cells_(side_ * side_),
        half_(0.5f * static_cast<float>(side_)) {
    for (std::uint32_t first = 0, side = blocks_;; side = (side + 1) / 2) {
      levelBegin_[levels_] = first;
      levelSide_[levels_++] = side;
      first += side * side;
      if (side == 1) break;
    }
  }

  void sort() {
    const std::uint32_t count = job_.count;
    for (std::uint32_t i = 0; i <= 6 * cells_; ++i) job_.begin[i] = 0;

    // Find each ray's face and cell.
    for (std::uint32_t first = 0; first < count; first += kFanLanes) {
      const std::uint32_t lanes = leastOf(kFanLanes, count - first);
      alignas(32) float lane[3][kFanLanes];
      for (std::uint32_t i = 0; i < kFanLanes; ++i) {
        const float* from = job_.direction + 3 * (first + leastOf(i, lanes - 1));
        lane[0][i] = from[0], lane[1][i] = from[1], lane[2][i] = from[2];
      }
      const Vectors d{load(lane[0]), load(lane[1]), load(lane[2])};
      const Floats x = magnitude(d.x), y = magnitude(d.y), z = magnitude(d.z);
      const Ints alongX = (x >= y) & (x >= z), alongY = ~alongX & (y >= z);
      const Floats depth = alongX ? d.x : alongY ? d.y : d.z;
      const Floats scale = 1.0f / magnitude(depth);
      const Floats u = (alongX ? d.y : alongY ? d.z : d.x) * scale, v = (alongX ? d.z : alongY ? d.x : d.y) * scale;
      const Ints column = cellOf(u, 0.0f), row = cellOf(v, 0.0f);
      const Ints face = (alongX ? Ints{} : alongY ? Ints{} + 2 : Ints{} + 4) + (depth < 0.0f ? Ints{} + 1 : Ints{});
      constexpr auto kStrip = static_cast<std::int32_t>(kFanStrip);
      const auto side = static_cast<std::int32_t>(side_);
      const Ints cell = face * (side * side) + row / kStrip * (kStrip * side) + column * kStrip + row % kStrip;
      store(job_.faceU + first, u);
      store(job_.faceV + first, v);
      storeInts(job_.place + first, cell);
      for (std::uint32_t i = 0; i < lanes; ++i) ++job_.begin[job_.place[first + i] + 1];
    }

    // Put them in order.
    for (std::uint32_t i = 0; i < 6 * cells_; ++i) {
      job_.cursor[i] = job_.begin[i];
      job_.begin[i + 1] += job_.begin[i];
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t place = job_.cursor[job_.place[i]]++;
      job_.place[i] = place;
      job_.u[place] = job_.faceU[i];
      job_.v[place] = job_.faceV[i];
      job_.x[place] = job_.direction[3 * i];
      job_.y[place] = job_.direction[3 * i + 1];
      job_.z[place] = job_.direction[3 * i + 2];
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      job_.t[i] = kInfinity;
      job_.hit[i] = kFanNone;
    }
    for (std::uint32_t i = 0; i < 6 * blocks_ * blocks_; ++i) {
      const std::uint32_t end = job_.begin[(i + 1) * kBlockCells];
      for (std::uint32_t k = job_.begin[i * kBlockCells]; k < end; ++k) {
        job_.block[k] = static_cast<std::uint16_t>(i % (blocks_ * blocks_));
      }
    }
  }

  // Turn to a face, of which no ray has ended yet. False when it has none.
  bool turnTo(std::uint32_t face) {
    begin_ = job_.begin + face * cells_;
    if (begin_[0] == begin_[cells_]) return false;
    for (std::uint32_t i = 0; i < blocks_ * blocks_; ++i) {
      job_.farthest[i] = begin_[(i + 1) * kBlockCells] > begin_[i * kBlockCells] ? kInfinity : 0.0f;
    }
    for (std::uint32_t level = 1; level < levels_; ++level) {
      const std::uint32_t side = levelSide_[level];
      for (std::uint32_t i = 0; i < side * side; ++i) {
        job_.farthest[levelBegin_[level] + i] = farthestBelow(level, i % side, i / side);
      }
    }
    return true;
  }

  void findCells(Rectangles& r) const {
    r.x0 = cellOf(r.u0, -kSlackCells), r.x1 = cellOf(r.u1, kSlackCells);
    r.y0 = cellOf(r.v0, -kSlackCells), r.y1 = cellOf(r.v1, kSlackCells);
  }

  std::uint32_t blockAt(std::uint32_t x, std::uint32_t y) const { return y * blocks_ + x; }
  Range inBlock(std::uint32_t block) const { return {begin_[block * kBlockCells], begin_[(block + 1) * kBlockCells]}; }
  // The rays in cells x0 to x1 of a strip.
  Range inStrip(std::uint32_t strip, std::uint32_t x0, std::uint32_t x1) const {
    const std::uint32_t* row = begin_ + strip * kFanStrip * side_;
    return {row[x0 * kFanStrip], row[(x1 + 1) * kFanStrip]};
  }

  // [m] no ray of the block reaches farther.
  float farthest(std::uint32_t block) const { return job_.farthest[block]; }
  // The same of blocks x0 to x1, y0 to y1, and some around, by the level at which they are at most three a side.
  float farthest(std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1) const {
    const auto level = 31u - static_cast<unsigned>(__builtin_clz((x1 - x0) | (y1 - y0) | 1u));
    const float* farthest = job_.farthest + levelBegin_[level];
    float all = 0.0f;
    for (std::uint32_t y = y0 >> level; y <= y1 >> level; ++y) {
      for (std::uint32_t x = x0 >> level; x <= x1 >> level; ++x) all = most(all, farthest[y * levelSide_[level] + x]);
    }
    return all;
  }

  // The rays of a block were shortened.
  void lower(std::uint32_t block) {
    const auto [begin, end] = inBlock(block);
    Floats all{};
    for (std::uint32_t i = firstOf(begin); i < end; i += kFanLanes) {
      all = most(all, lanesWithin(i, begin, end) ? load(job_.t + i) : Floats{});
    }
    float farthest = mostLane(all);
    if (!(farthest < job_.farthest[block])) return;
    job_.farthest[block] = farthest;
    std::uint32_t x = block % blocks_, y = block / blocks_;
    for (std::uint32_t level = 1; level < levels_; ++level) {
      x /= 2, y /= 2;
      farthest = farthestBelow(level, x, y);
      float& old = job_.farthest[levelBegin_[level] + y * levelSide_[level] + x];
      if (!(farthest < old)) return;
      old = farthest;
    }
  }

 private:
  Ints cellOf(Floats u, float shift) const {
    const Floats inside = least(most(u, splat(-1.0f)), splat(1.0f));
    const Floats cell = evenOut(inside) * half_ + (half_ + shift);
    return __builtin_convertvector(least(most(cell, Floats{}), splat(static_cast<float>(side_ - 1))), Ints);
  }

  // The farthest of the four below a block of a level >= 1.
  float farthestBelow(std::uint32_t level, std::uint32_t x, std::uint32_t y) const {
    const std::uint32_t side = levelSide_[level - 1];
    const float* below = job_.farthest + levelBegin_[level - 1];
    const std::uint32_t x0 = 2 * x, x1 = leastOf(x0 + 1, side - 1), y0 = 2 * y * side;
    const std::uint32_t y1 = leastOf(2 * y + 1, side - 1) * side;
    return most(most(below[y0 + x0], below[y0 + x1]), most(below[y1 + x0], below[y1 + x1]));
  }

  const FanJob& job_;
  std::uint32_t blocks_, side_, cells_;  // a side; cells a side; cells a face
  float half_;
  std::uint32_t levels_ = 0, levelBegin_[8], levelSide_[8];
  const std::uint32_t* begin_ = nullptr;  // of the face's cells
};

}  // namespace
}  // namespace relume
