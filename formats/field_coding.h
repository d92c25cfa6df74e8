// SPDX-License-Identifier: MIT
// Arrays regrouped so that a general compressor (gzip, Brotli, zstd) finds what repeats in them: the words of each
// column are cut into fields of bits, a field may stand as its differences from row to row, and the bytes of a field
// lie together by significance. Nothing is lost and, but for rounding fields up to bytes, nothing is saved: the
// compressor does that. formats/README.md documents the bytes.
#pragma once

#include "relume/result.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// How the words of an array are coded; stands in the file. A byte for each of up to four fields, lowest bits first:
// bits 0..5 the width [1..32], bit 6 set: differences from row to row. The widths add up to the words' size, 16 or 32
// bits. 0 = bytes as they are.
using FieldCoding = std::uint32_t;
inline constexpr FieldCoding kUncoded = 0;

inline constexpr std::uint32_t kDifferences = 0x40;
constexpr FieldCoding fieldCoding(std::uint32_t a, std::uint32_t b = 0, std::uint32_t c = 0, std::uint32_t d = 0) {
  return a | b << 8 | c << 16 | d << 24;
}

// [bit] of a word: 16 or 32; 0 = no coding there is, kUncoded among them.
std::uint32_t wordBits(FieldCoding coding);

// Of coded rows of `rowBytes`, a multiple of the words' size. rows * rowBytes must fit in 61 bits.
std::uint64_t codedBytes(FieldCoding coding, std::uint64_t rows, std::uint64_t rowBytes);

// A difference of two numbers of `width` bits [1..32], modulo 2^width, as one that is small where the difference is
// near 0: 0, -1, 1, -2, ... become 0, 1, 2, 3, ...; and back.
constexpr std::uint32_t foldSign(std::uint32_t difference, std::uint32_t width) {
  const std::uint32_t sign = difference >> (width - 1) & 1u;
  return ((difference << 1) ^ (sign ? 0xFFFFFFFFu : 0u)) & (0xFFFFFFFFu >> (32 - width));
}
constexpr std::uint32_t unfoldSign(std::uint32_t folded, std::uint32_t width) {
  return ((folded >> 1) ^ (folded & 1u ? 0xFFFFFFFFu : 0u)) & (0xFFFFFFFFu >> (32 - width));
}

// data: rows of rowBytes [multiple of the words' size]. wordBits(coding) is not 0.
std::vector<std::byte> encodeFields(FieldCoding coding, std::span<const std::byte> data, std::size_t rowBytes);

// The opposite. coded: codedBytes() of the rows that `data` has room for. False: a field has bits beyond its width,
// which no encoder writes.
bool decodeFields(FieldCoding coding, std::span<const std::byte> coded, std::size_t rowBytes,
                  std::span<std::byte> data);

}  // namespace relume
