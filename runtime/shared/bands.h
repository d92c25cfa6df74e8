// SPDX-License-Identifier: MIT
// Pairs of bands by the names that CRC gives them: "Y3Co1Cg1" is three bands of luma and one of each chroma.
#pragma once

#include "formats/sh.h"

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

// Bands of the caches on the light map, of those that the relighter has: its receivers see a hemisphere by the clamped
// cosine, which has nothing of the last of 4, 6 or 8 (clampedCosineFactors()), and irradiance caches have one.
inline int mapBands(int bands, bool irradianceOnMap) {
  if (irradianceOnMap) return 1;
  return bands > 2 && bands % 2 == 0 ? bands - 1 : bands;
}

}  // namespace relume
