// SPDX-License-Identifier: MIT
// The directions that links of kind oct6 store (compact_links.h), told from where their caches and senders lie, so that
// a packed bake keeps only how far they are from that: they point near the middle of a sender's surfels. Arithmetic is
// IEEE single precision in a fixed order, which gives the same numbers on every machine; the code must be compiled
// without contraction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

// Chunks of a bake, decoded, by their names in the file. Any numbers do: what tells nothing is taken for a direction
// of 0.
struct LinkEnds {
  std::span<const float> surfelPosition, skyDirection, cachePosition;  // x, y, z of each
  std::span<const std::uint32_t> child, row, head;
};

// [byte] of a coded shape: differences of the two coordinates, and the cone as it is, each a plane of their own.
inline constexpr std::size_t kCodedShapeBytes = 3;

// shapes: link.shape, two of them a word; one past the last link is coded as it is.
std::vector<std::byte> encodeDirections(const LinkEnds& ends, std::span<const std::byte> shapes);

// The opposite. coded: kCodedShapeBytes for each shape that there is room for. False: bits beyond a coordinate's, which
// no encoder writes. What it needs meanwhile, 16 bytes a node, is from `memory` [not null]; throws std::bad_alloc.
bool decodeDirections(const LinkEnds& ends, std::span<const std::byte> coded, std::span<std::byte> shapes,
                      std::pmr::memory_resource* memory);

}  // namespace relume
