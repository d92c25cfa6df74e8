// SPDX-License-Identifier: MIT
// Records splatted by a rasteriser in place of RecordTiles (RCS 4.2, steps 2 and 5). This library knows no rasteriser:
// the caller brings one.
#pragma once

#include "bake/preview/mirror_surface.h"
#include "bake/preview/radiance_records.h"
#include "bake/preview/receiver.h"
#include "bake/preview/record.h"
#include "bake/preview/record_tiles.h"
#include "bake/preview/weights.h"
#include "bake/scene/camera_rays.h"
#include "relume/result.h"

#include <glm/vec3.hpp>

#include <functional>
#include <span>

namespace relume {

// Splats records as RecordTiles does. Functions are called from the thread that made it; they fail with errors of the
// rasteriser, after which nothing of the picture counts until the next look().
class SplatDrawer {
 public:
  virtual ~SplatDrawer() = default;
  // What the pixels show from now on. The picture is dark, and there are no records. [Size receivers = pixels of the
  // camera]
  [[nodiscard]] virtual Status look(const CameraRays& camera, std::span<const PixelReceiver> receivers) = 0;
  // The picture of these records alone. Pixels that none reaches keep what they show.
  [[nodiscard]] virtual Status draw(std::span<const Record> records, const Interpolation& options) = 0;
  // The picture of these as well.
  [[nodiscard]] virtual Status add(std::span<const Record> records) = 0;
  // All records in another light: reflected and sky alone have changed, and only they are read. [Size those there are]
  [[nodiscard]] virtual Status relight(std::span<const Record> records) = 0;
  // What the pixels show. [Size pixels]
  [[nodiscard]] virtual Status read(std::span<Splat> picture) = 0;
};

// What a pixel's lobe mirrors, as mirroredLight() has it of RadianceRecords::splat().
struct MirrorSplat {
  glm::vec3 radiance{0.0f};  // [W/m²/sr]
  float weight = 0.0f;       // sum of w_k; 0: no record reaches here
};

// Splat radiance records at the pixels whose receivers have a normal. records: those that `radiance` keeps.
// [Size receivers = surfaces = picture = pixels of the camera]
using DrawMirrors = std::function<Status(const CameraRays& camera, std::span<const PixelReceiver> receivers,
                                         std::span<const MirrorSurface> surfaces, std::span<const Record> records,
                                         const RadianceRecords& radiance, const Interpolation& options,
                                         std::span<MirrorSplat> picture)>;

}  // namespace relume
