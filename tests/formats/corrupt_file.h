// SPDX-License-Identifier: MIT
// Damage to the bytes of a bake file, with and without the checksums made to fit again. Offsets are those of
// formats/README.md, spelled out here a second time on purpose.
#pragma once

#include "relume/bake_file.h"

#include <xxhash.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace relume {

using Bytes = std::vector<std::byte>;

inline constexpr std::size_t kHeaderBytes = 64, kRowBytes = 64;

template <class T>
T getAt(const Bytes& file, std::size_t offset) {
  T value;
  std::memcpy(&value, file.data() + offset, sizeof(T));
  return value;
}

template <class T>
void putAt(Bytes& file, std::size_t offset, T value) {
  std::memcpy(file.data() + offset, &value, sizeof(T));
}

inline std::uint32_t chunkCount(const Bytes& file) { return getAt<std::uint32_t>(file, 20); }
inline std::size_t rowOffset(std::size_t row) { return kHeaderBytes + row * kRowBytes; }

// Row of the chunk with that name; chunkCount() when there is none.
inline std::size_t findRow(const Bytes& file, const std::string& name) {
  for (std::size_t row = 0; row < chunkCount(file); ++row) {
    char text[17] = {};
    std::memcpy(text, file.data() + rowOffset(row), 16);
    if (name == text) return row;
  }
  return chunkCount(file);
}

// Make all checksums fit the bytes again, as an attacker would. Does nothing that would read out of the file.
inline void reseal(Bytes& file) {
  if (file.size() < kHeaderBytes) return;
  const std::size_t rows = std::min<std::size_t>(chunkCount(file), (file.size() - kHeaderBytes) / kRowBytes);
  for (std::size_t row = 0; row < rows; ++row) {
    const auto offset = getAt<std::uint64_t>(file, rowOffset(row) + 40);
    const auto bytes = getAt<std::uint64_t>(file, rowOffset(row) + 48);
    if (offset <= file.size() && bytes <= file.size() - offset)
      putAt<std::uint64_t>(file, rowOffset(row) + 56, XXH3_64bits(file.data() + offset, bytes));
  }
  putAt<std::uint64_t>(file, 32, 0);
  putAt<std::uint64_t>(file, 32, XXH3_64bits(file.data(), kHeaderBytes + rows * kRowBytes));
}

// What a reader says of a file, "no error" when it takes it.
inline std::string errorOf(const Bytes& file) {
  const Result<Bake> bake = parseBake(file, nullptr);
  return bake ? "no error" : bake.error().message;
}

}  // namespace relume
