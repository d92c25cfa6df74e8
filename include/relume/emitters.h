// SPDX-License-Identifier: MIT
// Emitters whose light a frame may replace (lights.h, MaterialEmission): the materials by name, and where each of their
// surfels lies on an image that is put in place of the emissive texture.
//
// A material is drivable when it emits, or when the level says so of it (extras.relume.drivable): a screen that is dark
// in the level. The surfels of a marked one lie in the group of emitters whatever they emit.
#pragma once

#include "relume/array.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace relume {

// Points of an image that stand for equal parts of a surfel's footprint.
inline constexpr std::uint32_t kFootprintTaps = 4;
// Greatest Emitters::tapWidth.
inline constexpr float kMaxTapWidth = 65536.0f;

struct DrivableMaterial {
  std::string name;                              // glTF material name, or "material<index>"
  std::uint32_t firstEntry = 0, entryCount = 0;  // of Emitters: its surfels
  bool marked = false;                           // extras.relume.drivable
  bool textured = false;                         // has texture coordinates: images can drive it
  bool clampU = false, clampV = false;           // how images continue past their edges; false = repeated
};

// Entries by material, and by ascending surfel within one. All empty in bakes of levels without emitters, and in those
// of format version 3.
struct Emitters {
  Array<DrivableMaterial> materials;  // in the level's order; their entries follow one another
  Array<std::uint32_t> surfel;        // [Size n_E] index of the surfel; each at most once
  Array<std::uint32_t> tap;  // [Size kFootprintTaps n_E] packUnorm16x2: points on the image, (0,0) the outer corner of
                             // its first texel, the one glTF has at the top left
  Array<float>
      tapWidth;  // [Size n_E] [0..kMaxTapWidth] square root of the part of the image's area that a tap stands for

  std::uint32_t count() const { return static_cast<std::uint32_t>(surfel.size()); }
};

// Index of the first drivable material of that name: MaterialEmission::material. Nothing where there is none.
inline std::optional<std::uint32_t> findMaterial(const Emitters& emitters, std::string_view name) {
  for (std::uint32_t i = 0; i < emitters.materials.size(); ++i) {
    if (emitters.materials[i].name == name) return i;
  }
  return std::nullopt;
}

}  // namespace relume
