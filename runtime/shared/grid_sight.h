// SPDX-License-Identifier: MIT
// How far grid caches see (formats/grid_depth.h), as look-ups keep it. A receiver reads the caches of the cell that it
// lies in, so that of each cache's map only those triangles count that hide some place of the cells around it. The
// nodes of these are kept, a byte each, and in each row of the lattice what lies between them; half of all on Sponza.
// Places of those cells, and up to half a spacing beyond the grid, see exactly what the whole map says.
#pragma once

#include "formats/grid_depth.h"
#include "relume/caches.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

class GridSight {
 public:
  // Of a grid's depths, which may be none. memory: keeps them.
  GridSight(const Caches& caches, std::pmr::memory_resource* memory);

  // Whether receivers behind walls are told apart.
  bool empty() const { return begin_.empty(); }
  // depthWeight() of a cache's map. toward [m]: from the cache to the receiver.
  float weight(std::uint32_t cache, const glm::vec3& toward) const;
  // The map, zeros where it counts for nothing. [Size kDepthWords]
  void read(std::uint32_t cache, std::span<std::uint32_t> words) const;
  std::size_t bytes() const;

 private:
  // The nodes kept of a row: where the first of them lies, and above that the index of its byte. One more says where
  // the last row's end.
  using Row = std::uint16_t;
  static constexpr int kFirstBits = 5;
  static constexpr std::size_t kRowBytes = sizeof(Row) * (kDepthSide + 1);

  // The byte of a node, 0 where it is not kept. map: not empty.
  static std::uint32_t byteAt(const std::uint8_t* map, int node);

  float unit_, spacing_;                   // [m] CacheGrid::depthUnit(), finestSpacing()
  std::pmr::vector<std::uint32_t> begin_;  // [Size 0 or caches + 1] of each map in byte_; one without nodes is empty
  std::pmr::vector<std::uint8_t> byte_;    // rows of a map, then its nodes
};

inline std::uint32_t GridSight::byteAt(const std::uint8_t* map, int node) {
  const int row = node / kDepthSide, x = node % kDepthSide;
  std::array<Row, 2> rows;
  std::memcpy(rows.data(), map + sizeof(Row) * static_cast<std::size_t>(row), sizeof rows);
  const int begin = rows[0] >> kFirstBits, end = rows[1] >> kFirstBits;
  const int at = begin + x - (rows[0] & ((1 << kFirstBits) - 1));
  return at >= begin && at < end ? map[kRowBytes + static_cast<std::size_t>(at)] : 0u;
}

inline float GridSight::weight(std::uint32_t cache, const glm::vec3& toward) const {
  const float l1 = std::abs(toward.x) + std::abs(toward.y) + std::abs(toward.z);
  if (!(l1 > 0.0f) || begin_[cache] == begin_[cache + 1]) return 1.0f;
  const DepthNodes nodes = depthNodesAround(toward, l1);
  const std::uint8_t* const map = byte_.data() + begin_[cache];
  float t = 0.0f;
  for (std::size_t k = 0; k < 3; ++k) t += nodes.weight[k] * unpackDepth(byteAt(map, nodes.node[k]));
  return depthWeightAt(t, l1, toward, unit_, spacing_);
}

}  // namespace relume
