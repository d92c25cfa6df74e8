// SPDX-License-Identifier: MIT
// See point_grid.h.
#include "bake/base/point_grid.h"

#include "bake/base/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace relume {
namespace {

constexpr float kMaxBucketsAlong = 1048576.0f;
constexpr std::size_t kPointsPerChunk = std::size_t{1} << 15;

// Sort (key, index) pairs by key, where indices of equal keys stay ascending: a radix sort, 11 bits per pass. Each
// chunk counts its digits, and puts its items behind those of the chunks before it.
void sortByKey(std::vector<std::pair<std::uint64_t, std::uint32_t>>& items, std::uint64_t largestKey,
               Context& context) {
  constexpr int kBits = 11;
  constexpr std::size_t kDigits = std::size_t{1} << kBits;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> other(items.size());
  std::vector<std::uint32_t> at((items.size() + kPointsPerChunk - 1) / kPointsPerChunk * kDigits);
  for (int shift = 0; shift < 64 && (largestKey >> shift) != 0; shift += kBits) {
    const auto digit = [shift](std::uint64_t key) { return (key >> shift) & (kDigits - 1); };
    parallelChunks(context, "", items.size(), kPointsPerChunk, [&](std::size_t begin, std::size_t end) {
      const std::span<std::uint32_t> own = std::span(at).subspan(begin / kPointsPerChunk * kDigits, kDigits);
      std::fill(own.begin(), own.end(), 0);
      for (std::size_t i = begin; i < end; ++i) ++own[digit(items[i].first)];
    });
    if (context.cancelled()) return;
    std::uint32_t before = 0;
    for (std::size_t d = 0; d < kDigits; ++d) {
      for (std::size_t c = d; c < at.size(); c += kDigits) before += std::exchange(at[c], before);
    }
    parallelChunks(context, "", items.size(), kPointsPerChunk, [&](std::size_t begin, std::size_t end) {
      const std::span<std::uint32_t> own = std::span(at).subspan(begin / kPointsPerChunk * kDigits, kDigits);
      for (std::size_t i = begin; i < end; ++i) other[own[digit(items[i].first)]++] = items[i];
    });
    items.swap(other);
  }
}

}  // namespace

PointGrid::Bucket PointGrid::bucketOf(const glm::vec3& p) const {
  // A point far outside of the grid, or NaN, gets a bucket far outside of it, without overflow.
  const auto along = [&](float value, float origin) {
    const float c = std::floor((value - origin) / bucketSize_);
    return static_cast<std::int64_t>(c > -1e9f ? (c < 1e9f ? c : 1e9f) : -1e9f);
  };
  return {along(p.x, origin_.x), along(p.y, origin_.y), along(p.z, origin_.z)};
}

PointGrid::PointGrid(std::span<const glm::vec3> points, float bucketSize, Context& context) {
  begin_.push_back(0);
  rows_.resize(1);
  if (points.empty()) return;
  glm::vec3 low = points[0], high = points[0];
  for (const glm::vec3& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::vec3 extent = high - low;
  const float longest = std::max({extent.x, extent.y, extent.z});
  bucketSize_ = std::max({bucketSize, longest / kMaxBucketsAlong, 1e-30f});
  origin_ = low;
  const Bucket last = bucketOf(high);
  size_ = {last.x + 1, last.y + 1, last.z + 1};

  std::vector<std::pair<std::uint64_t, std::uint32_t>> items(points.size());
  parallelChunks(context, "", points.size(), kPointsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) items[i] = {keyOf(bucketOf(points[i])), static_cast<std::uint32_t>(i)};
  });
  sortByKey(items, keyOf(last), context);

  order_.resize(points.size());
  begin_.clear();
  std::size_t rows = 0;
  const auto rowOf = [&](std::uint64_t key) {
    return static_cast<std::size_t>(key) / static_cast<std::size_t>(size_.x);
  };
  for (std::size_t i = 0; i < items.size(); ++i) {
    order_[i] = items[i].second;
    if (i > 0 && items[i].first == items[i - 1].first) continue;
    if (key_.empty() || rowOf(key_.back()) != rowOf(items[i].first)) ++rows;
    key_.push_back(items[i].first);
    begin_.push_back(static_cast<std::uint32_t>(i));
  }
  begin_.push_back(static_cast<std::uint32_t>(items.size()));

  // Hash the occupied rows.
  rows_.assign(std::bit_ceil(2 * rows), {});
  rowMask_ = rows_.size() - 1;
  for (std::size_t c = 0; c < key_.size();) {
    const std::size_t row = rowOf(key_[c]);
    std::size_t end = c + 1;
    while (end < key_.size() && rowOf(key_[end]) == row) ++end;
    std::size_t slot = (row * kRowHash >> 20) & rowMask_;
    while (rows_[slot].row != static_cast<std::size_t>(-1)) slot = (slot + 1) & rowMask_;
    rows_[slot] = {row, static_cast<std::uint32_t>(c), static_cast<std::uint32_t>(end)};
    c = end;
  }
}

bool PointGrid::findRow(std::size_t slot, std::size_t row, std::size_t& first, std::size_t& last) const {
  for (;; slot = (slot + 1) & rowMask_) {
    if (rows_[slot].row == static_cast<std::size_t>(-1)) return false;
    if (rows_[slot].row != row) continue;
    first = rows_[slot].first;
    last = rows_[slot].last;
    return true;
  }
}

}  // namespace relume
