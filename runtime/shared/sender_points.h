// SPDX-License-Identifier: MIT
// Places on the senders of links: for each node of the hierarchy a few of the surfels or sky directions below it, so
// that what stands between a cache and a node is found by rays to them, whatever a link stores.
#pragma once

#include "relume/hierarchy.h"
#include "relume/surfels.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

class SenderPoints {
 public:
  struct Point {
    glm::vec3 place{0.0f};                // [m] of a surfel; of the sky a unit direction
    std::array<std::int8_t, 3> normal{};  // 127 times the surfel's
    bool isSky = false;
  };
  static constexpr std::uint32_t kMost = 8;  // of a node

  // memory: keeps all of this.
  SenderPoints(const Hierarchy& hierarchy, const Surfels& surfels, std::pmr::memory_resource* memory);
  SenderPoints(const SenderPoints&) = delete;
  SenderPoints& operator=(const SenderPoints&) = delete;

  // How many points of a node there are, and point i of n that are spread over them. [i < n <= kMost]
  std::uint32_t count(std::uint32_t node) const { return first_[node].count; }
  const Point& point(std::uint32_t node, std::uint32_t i, std::uint32_t n) const {
    const Range& range = first_[node];
    return point_[range.first + static_cast<std::uint32_t>((2 * std::uint64_t{i} + 1) * range.count / (2 * n))];
  }
  // All of them: first point and how many of each node, and the points.
  struct Range {
    std::uint32_t first = 0, count = 0;  // in points()
  };
  std::span<const Range> ranges() const { return first_; }
  std::span<const Point> points() const { return point_; }
  // Bring what count() and point() read of a node nearer to the processor.
  void prefetch(std::uint32_t node) const { __builtin_prefetch(&first_[node]); }
  void prefetch(std::uint32_t node, std::uint32_t n) const {
    for (std::uint32_t i = 0; i < n; ++i) __builtin_prefetch(&point(node, i, n));
  }
  std::size_t bytes() const;

 private:
  std::pmr::vector<Point> point_;  // those of a node's children one after the other
  std::pmr::vector<Range> first_;  // [Size nodes]
};

}  // namespace relume
