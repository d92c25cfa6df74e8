// SPDX-License-Identifier: MIT
// What shaders/resolve.glsl is told of the bands it reads.
#pragma once

#include "runtime/shared/bands.h"

#include <string>
#include <utility>
#include <vector>

namespace relume {

// Definitions that fix the bands when a shader is compiled.
inline std::vector<std::pair<std::string, std::string>> bandDefines(const CacheBands& bands) {
  return {{"RELUME_LUMA_BANDS", std::to_string(bands.lumaBands)},
          {"RELUME_CHROMA_BANDS", std::to_string(bands.chromaBands)},
          {"RELUME_MAP_LUMA_BANDS", std::to_string(bands.onMap(bands.lumaBands))},
          {"RELUME_MAP_CHROMA_BANDS", std::to_string(bands.onMap(bands.chromaBands))},
          {"RELUME_MAP_IRRADIANCE", bands.irradianceOnMap ? "1" : "0"}};
}

// The same for receivers of hosts: glossy ones too, with what two bands lack guessed, on their side of walls, and with
// the grid's texture or what stands in for it.
inline std::vector<std::pair<std::string, std::string>> resolveDefines(const CacheBands& bands,
                                                                       bool gridTexture = false) {
  auto defines = bandDefines(bands);
  defines.emplace_back("RELUME_GLOSSY", "1");
  defines.emplace_back("RELUME_GUESS_BANDS", "1");
  defines.emplace_back("RELUME_MAP_SIGHT", "1");
  defines.emplace_back("RELUME_GRID_TEXTURE", gridTexture ? "1" : "0");
  return defines;
}

}  // namespace relume
