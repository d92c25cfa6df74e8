// SPDX-License-Identifier: MIT
// See stored_light.h. The kernels of runtime/cpu write whole ranges of rows.
#include "runtime/shared/stored_light.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace relume {
namespace {

void widen(const std::uint16_t* from, float unit, std::size_t count, float* to) {
  const auto one = [&](std::size_t i) { to[i] = unit * static_cast<float>(static_cast<std::int16_t>(from[i])); };
  std::size_t i = 0;
  // Eight at a time become a vector's work.
  for (; i + 8 <= count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) one(i + k);
  }
  for (; i < count; ++i) one(i);
}

}  // namespace

StoredLight::StoredLight(const CacheBands& bands, std::uint32_t caches, std::uint32_t firstMapCache,
                         std::pmr::memory_resource* memory)
    : bands_(bands),
      caches_(caches),
      firstMapCache_(std::min(firstMapCache, caches)),
      words_(mapBegin() + std::size_t{rowWords(bands.ofMap())} * (caches - firstMapCache_) + kLightRowRoom, 0, memory) {
}

void StoredLight::read(std::uint32_t cache, float* c) const {
  const LightRows rows = cache < firstMapCache_ ? gridRows() : mapRows();
  const std::uint16_t* from = rows.word + std::size_t{rows.words} * (cache - rows.first);
  const float unit = std::bit_cast<float>(std::uint32_t{*from++} << 23);
  if (rows.lumaCount == bands_.lumaCount() && rows.chromaCount == bands_.chromaCount())
    return widen(from, unit, bands_.stride(), c);
  const auto channel = [&](std::size_t held, std::size_t wanted) {
    widen(from, unit, held, c);
    std::fill(c + held, c + wanted, 0.0f);
    from += held;
    c += wanted;
  };
  channel(rows.lumaCount, bands_.lumaCount());
  channel(rows.chromaCount, bands_.chromaCount());
  channel(rows.chromaCount, bands_.chromaCount());
}

void StoredLight::write(std::uint32_t cache, const float* c) {
  const LightRowsOf<std::uint16_t> rows = cache < firstMapCache_ ? gridRows() : mapRows();
  const float* const channel[3] = {c, c + bands_.lumaCount(), c + bands_.lumaCount() + bands_.chromaCount()};
  const std::size_t count[3] = {rows.lumaCount, rows.chromaCount, rows.chromaCount};
  float largest = 0.0f;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < count[k]; ++i) largest = std::max(largest, std::abs(channel[k][i]));
  }
  const std::int32_t exponent = std::max((std::bit_cast<std::int32_t>(largest) >> 23) - kLightBits, 1);
  const float scale = std::bit_cast<float>((254 - exponent) << 23);
  std::uint16_t* to = rows.word + std::size_t{rows.words} * (cache - rows.first);
  *to++ = static_cast<std::uint16_t>(exponent);
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < count[k]; ++i)
      to[i] = static_cast<std::uint16_t>(std::lrint(std::clamp(channel[k][i] * scale, -32767.0f, 32767.0f)));
    to += count[k];
  }
}

void StoredLight::clear() { std::fill(words_.begin(), words_.end(), std::uint16_t{0}); }

}  // namespace relume
