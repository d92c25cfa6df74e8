// SPDX-License-Identifier: MIT
// What a sub-pixel's surface mirrors: of wide lobes by radiance records, of sharp ones along a ray.
#pragma once

#include "bake/preview/draw_splats.h"
#include "bake/preview/hit_radiance.h"
#include "bake/preview/mirror_surface.h"
#include "bake/preview/preview.h"
#include "bake/preview/radiance_records.h"
#include "bake/preview/record_tiles.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace relume {

struct MirrorInput {
  const PreviewScene& scene;
  const RadianceRecords& radiance;
  std::span<const Record> records;
  const RecordTiles& tiles;  // of those
  const LobeTable& lobes;
  const HitRadiance& reflected;  // what a ray finds
  bool emissive;                 // emitting surfaces are on
  std::uint64_t seed;
  // What a rasteriser has drawn of the lobes at the pixels' centres. Empty: nothing. [Size drawn = surfaces = pixels]
  std::span<const MirrorSplat> drawn{};
  std::span<const MirrorSurface> surfaces{};
};

struct MirroredLight {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] of what surfaces reflect and of the sky
  bool alongRay = false;     // and of what emits, which records do not know
};

class MirrorShader {
 public:
  // Memory of one thread.
  struct Scratch {
    RadianceSplat center, own;
    std::size_t pixel = static_cast<std::size_t>(-1);  // that `center` is of
  };

  explicit MirrorShader(const MirrorInput& input) : in_(input) {}

  // Mean radiance in the lobe. item: for random numbers, each sub-pixel has its own. center: of the pixel, where the
  // sub-pixel shows the same surface; else null. What is drawn counts for lobes that are all but the centre's.
  MirroredLight light(std::uint32_t x, std::uint32_t y, std::size_t pixel, std::uint64_t item,
                      const PixelReceiver& receiver, const PixelReceiver* center, const MirrorSurface& mirror,
                      Scratch& scratch) const;

 private:
  glm::vec3 alongLobe(std::uint64_t item, const PixelReceiver& receiver, const MirrorSurface& mirror) const;

  MirrorInput in_;
};

}  // namespace relume
