// SPDX-License-Identifier: MIT
// The rows and links of a LinkSet as plain memory. No other header is included here: the kernels of the CPU backend
// read this, and no inline function may be compiled for a newer processor and linked into everyone's path.
#pragma once

#include <cstddef>
#include <cstdint>

namespace relume {

// LinkRows::kind of links that LinkSet has packed again.
constexpr std::uint32_t kRepackedLinks = 0xFFFFFFFFu;
// LinkRows::nodeStep: after so many links more the nodes of a row have grown by 2^16, but after this many they have
// not.
constexpr std::uint32_t kNoGrowth = 255;

// Borrowed from the LinkSet. Which arrays there are depends on `kind`; the others are null.
struct LinkRows {
  // Row c begins at rowBase[c >> rowShift] + rowOffset[c], and ends where row c + 1 would begin.
  const std::uint32_t* rowBase = nullptr;
  const std::uint16_t* rowOffset = nullptr;  // [Size caches + 1]
  std::uint32_t rowShift = 0;
  std::uint32_t kind = 0;               // LinkKind, or kRepackedLinks
  const std::uint32_t* cone = nullptr;  // three words per link
  const std::uint32_t* shNode = nullptr;
  const std::uint16_t* shCoefficients = nullptr;
  std::size_t shHalfCount = 0;           // halves in shCoefficients
  std::uint32_t shStride = 0;            // coefficients of an SH link
  const std::uint32_t* head = nullptr;   // node and transfer of a compact link
  const std::uint32_t* shape = nullptr;  // the rest of it
  std::size_t shapeBytes = 0;
  const std::uint32_t* word = nullptr;  // links packed again: see link_set.h
  const std::uint8_t* transfer = nullptr;
  const std::uint8_t* nodeStep = nullptr;  // nodeSteps of them per row
  std::uint32_t nodeSteps = 0;
  std::uint32_t gridLinks = 0;  // irradiance links: how many have a shape, from the first on
};

namespace {

// First link of a row. [cache <= caches]
inline std::uint32_t rowBegin(const LinkRows& rows, std::uint32_t cache) {
  return rows.rowBase[cache >> rows.rowShift] + rows.rowOffset[cache];
}

}  // namespace
}  // namespace relume
