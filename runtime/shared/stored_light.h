// SPDX-License-Identifier: MIT
// The caches' coefficients as the CPU backend keeps them: 16 bits each, in units that a cache's largest coefficient
// decides, and of caches on the light map only those that its receivers read. That is half of what floats take, two
// fifths on the light map; rounding errs by up to 1 / 32768 of the largest coefficient.
#pragma once

#include "runtime/shared/bands.h"
#include "runtime/shared/light_rows.h"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

class StoredLight {
 public:
  // Of no light. firstMapCache: the caches from there on are the light map's. memory: keeps the rows.
  StoredLight(const CacheBands& bands, std::uint32_t caches, std::uint32_t firstMapCache,
              std::pmr::memory_resource* memory);
  StoredLight(const StoredLight&) = delete;
  StoredLight& operator=(const StoredLight&) = delete;

  const CacheBands& bands() const { return bands_; }
  std::uint32_t cacheCount() const { return caches_; }
  std::uint32_t firstMapCache() const { return firstMapCache_; }
  LightRows gridRows() const { return rowsOf(words_.data(), 0, bands_); }
  LightRows mapRows() const { return rowsOf(words_.data() + mapBegin(), firstMapCache_, bands_.ofMap()); }
  LightRowsOf<std::uint16_t> gridRows() { return rowsOf(words_.data(), 0, bands_); }
  LightRowsOf<std::uint16_t> mapRows() { return rowsOf(words_.data() + mapBegin(), firstMapCache_, bands_.ofMap()); }
  // Coefficients of a cache, zeros where the light map's have fewer. [Size c = bands().stride()]
  void read(std::uint32_t cache, float* c) const;
  // Store the coefficients of a cache; those that the light map's caches do not have are not read. [Size c =
  // bands().stride()]
  void write(std::uint32_t cache, const float* c);
  void clear();
  std::size_t bytes() const { return words_.size() * sizeof(words_[0]); }

  // Words of a row that has these coefficients.
  static std::uint32_t rowWords(const CacheBands& held) {
    return (1 + static_cast<std::uint32_t>(held.stride()) + 1) / 2 * 2;
  }

 private:
  template <class Word>
  static LightRowsOf<Word> rowsOf(Word* word, std::uint32_t first, const CacheBands& held) {
    return {word, first, rowWords(held), static_cast<std::uint32_t>(held.lumaCount()),
            static_cast<std::uint32_t>(held.chromaCount())};
  }
  std::size_t mapBegin() const { return std::size_t{rowWords(bands_)} * firstMapCache_; }

  CacheBands bands_;
  std::uint32_t caches_, firstMapCache_;
  std::pmr::vector<std::uint16_t> words_;
};

}  // namespace relume
