// SPDX-License-Identifier: MIT
// Pairs of bands by the names that CRC gives them: "Y3Co1Cg1" is three bands of luma and one of each chroma.
#pragma once

#include "formats/sh.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace relume {

// For RelightOptions; 0 = what the bake recommends.
struct Bands {
  int luma = 0;    // [0, 1..8]
  int chroma = 0;  // [0, 1..luma]
};

// "Y3Co1Cg1". Any thread.
inline std::string bandsName(const Bands& bands) {
  const std::string chroma = std::to_string(bands.chroma);
  return "Y" + std::to_string(bands.luma) + "Co" + chroma + "Cg" + chroma;
}

// Nothing when it is not such a name, Co and Cg differ, or chroma has more bands than luma.
inline std::optional<Bands> bandsByName(std::string_view name) {
  if (name.size() != 8) return std::nullopt;
  const Bands bands{name[1] - '0', name[4] - '0'};
  if (bands.chroma < 1 || bands.luma < bands.chroma || bands.luma > kMaxBands) return std::nullopt;
  return name == bandsName(bands) ? std::optional(bands) : std::nullopt;
}

// Which coefficients the caches hold.
struct CacheBands {
  int lumaBands = 1, chromaBands = 1;  // [1..8] chroma at most luma: of the grid's caches
  // Caches on the light map hold E / (2 pi y_0) in coefficient 0 and zeros (LinkKind::irradiance).
  bool irradianceOnMap = false;
  bool glossy = false;  // the light map has the bands too that glossy receivers alone read

  // Bands of the caches on the light map, of a channel that has so many in the grid. Its receivers see a hemisphere by
  // the clamped cosine, which has nothing of the last of 4, 6 or 8 (clampedCosineFactors()).
  int onMap(int bands) const {
    if (irradianceOnMap) return 1;
    return !glossy && bands > 2 && bands % 2 == 0 ? bands - 1 : bands;
  }
  // The same of the light map's caches alone.
  CacheBands ofMap() const { return {onMap(lumaBands), onMap(chromaBands), irradianceOnMap, glossy}; }

  std::size_t lumaCount() const { return static_cast<std::size_t>(lumaBands * lumaBands); }
  std::size_t chromaCount() const { return static_cast<std::size_t>(chromaBands * chromaBands); }
  std::size_t stride() const { return lumaCount() + 2 * chromaCount(); }
};

}  // namespace relume
