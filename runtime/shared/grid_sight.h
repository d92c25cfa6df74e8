// SPDX-License-Identifier: MIT
// How far grid caches see (formats/grid_depth.h), as look-ups keep it. A receiver reads the caches of the cell that it
// lies in, so that of each cache's map only those triangles count that hide some place of the cells around it. The
// nodes of these are kept, a byte each, with a bit for each node of the lattice that says whether it is; half of them
// on Sponza. Places of those cells, and up to half a spacing beyond the grid, see exactly what the whole map says.
#pragma once

#include "formats/grid_depth.h"
#include "relume/caches.h"

#include <bit>
#include <cstddef>
#include <cstdint>
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
  // Three rows of the lattice's nodes, a bit each from the lowest on, and above them how many of the map's bytes belong
  // to the rows before.
  static constexpr int kWordRows = 3, kCountShift = kWordRows * kDepthSide;
  static constexpr std::size_t kWords = (kDepthSide + kWordRows - 1) / kWordRows, kWordBytes = 8 * kWords;

  std::uint64_t word(const std::uint8_t* map, int row) const;
  // Where a node's byte is, from where the bytes of its map begin; its bit must be set.
  static std::size_t placeOf(std::uint64_t word, int bit) {
    return static_cast<std::size_t>(word >> kCountShift) +
           static_cast<std::size_t>(std::popcount(word & ((std::uint64_t{1} << bit) - 1)));
  }

  float unit_, spacing_;                   // [m] CacheGrid::depthUnit(), finestSpacing()
  std::pmr::vector<std::uint32_t> begin_;  // [Size 0 or caches + 1] of each map in byte_; one without nodes is empty
  std::pmr::vector<std::uint8_t> byte_;    // kWords words of a map, then its nodes
};

}  // namespace relume
