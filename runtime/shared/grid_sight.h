// SPDX-License-Identifier: MIT
// How far grid caches see (formats/grid_depth.h), as look-ups keep it. A receiver reads the caches of the cell that it
// lies in, so that of each cache's map only those triangles count that hide some place of the cells around it. The
// nodes of these are kept, and in each row of the lattice what lies between them; half of all on Sponza. Places of
// those cells, and up to half a spacing beyond the grid, see exactly what the whole map of such codes says.
//
// A node takes six bits. Receivers are within a spacing or so, where codes are even in distance, a 24th of the finest
// spacing apart; farther away are ten more. They are rounded outward: what the bake's bytes see stays seen.
#pragma once

#include "formats/grid_depth.h"
#include "relume/caches.h"

#include <array>
#include <bitset>
#include <cmath>
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
  // The map as bytes, zeros where it counts for nothing. [Size kDepthWords]
  void read(std::uint32_t cache, std::span<std::uint32_t> words) const;
  std::size_t bytes() const;

  // The byte that is kept of one of the bake's: the same or less.
  std::uint32_t roundDepth(std::uint32_t byte) const { return byteOf_[codeOf(byte)]; }

 private:
  static constexpr std::uint32_t kCodes = 64, kFarCodes = 10;
  static constexpr int kCodeBits = 6;

  // A map begins with its rows: the first of the lattice that it has in the low bits, how many it has above them. Then
  // of each row where the first node kept lies, and above that the index of its code; one more says where the last
  // row's end. Then the codes.
  static constexpr std::size_t kRowBytes = 2;
  static constexpr int kFirstBits = 5;
  static constexpr std::uint32_t kFirstMask = (1u << kFirstBits) - 1;

  // The last code whose byte is not above this one.
  std::uint32_t codeOf(std::uint32_t byte) const;
  // The code of a node, 0 where it is not kept. map: not empty.
  static std::uint32_t codeAt(const std::uint8_t* map, int node);
  static std::uint32_t word16(const std::uint8_t* from) { return from[0] | static_cast<std::uint32_t>(from[1]) << 8; }
  // kept: the nodes that count of a map with these bytes.
  void addMap(const std::array<std::uint8_t, kDepthNodes>& bytes, const std::bitset<kDepthNodes>& kept);

  float unit_, spacing_;                     // [m] CacheGrid::depthUnit(), finestSpacing()
  std::array<std::uint8_t, kCodes> byteOf_;  // of a code, ascending
  std::array<float, kCodes> depthOf_;        // unpackDepth() of it
  std::pmr::vector<std::uint32_t> begin_;    // [Size 0 or caches + 1] of each map in byte_; one without nodes is empty
  std::pmr::vector<std::uint8_t> byte_;      // maps, and room to read a word at the last code
};

inline std::uint32_t GridSight::codeAt(const std::uint8_t* map, int node) {
  const std::uint32_t rows = word16(map), count = rows >> kFirstBits;
  const auto row = static_cast<std::uint32_t>(node / kDepthSide) - (rows & kFirstMask);
  if (row >= count) return 0;
  const std::uint8_t* const entry = map + kRowBytes * (1 + row);
  const std::uint32_t here = word16(entry), begin = here >> kFirstBits, end = word16(entry + kRowBytes) >> kFirstBits;
  const std::uint32_t at = static_cast<std::uint32_t>(node % kDepthSide) - (here & kFirstMask);
  if (at >= end - begin) return 0;
  const std::uint32_t bit = kCodeBits * (begin + at);
  return word16(map + kRowBytes * (2 + count) + bit / 8) >> bit % 8 & (kCodes - 1);
}

inline float GridSight::weight(std::uint32_t cache, const glm::vec3& toward) const {
  const float l1 = std::abs(toward.x) + std::abs(toward.y) + std::abs(toward.z);
  if (!(l1 > 0.0f) || begin_[cache] == begin_[cache + 1]) return 1.0f;
  const DepthNodes nodes = depthNodesAround(toward, l1);
  const std::uint8_t* const map = byte_.data() + begin_[cache];
  float t = 0.0f;
  for (std::size_t k = 0; k < 3; ++k) t += nodes.weight[k] * depthOf_[codeAt(map, nodes.node[k])];
  return depthWeightAt(t, l1, toward, unit_, spacing_);
}

}  // namespace relume
