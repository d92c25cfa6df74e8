// SPDX-License-Identifier: MIT
// Radiance records splatted in OpenGL 4.3 (RCS 4.1, Eqs. (5), (9)): what the lobe of each pixel's centre mirrors. Light
// is in a storage buffer, hemispherical harmonics of up to order 10, and each record is drawn as SplatsGl draws its
// own.
//
// As mirroredLight() has it of RadianceRecords::splat(). No call but create() makes an OpenGL object, and what calls
// bind and set is put back. The context that was current in create() is current in every other call, and when it dies.
#pragma once

#include "bake/preview/draw_splats.h"
#include "relume/relighter.h"
#include "relume/result.h"

#include <memory>
#include <span>

namespace relume {

class MirrorSplatsGl {
 public:
  // Of records of an order [1..kMaxHshOrder]. usage: getProcAddress is empty, another order; unsupported: no
  // OpenGL 4.3, or no storage buffers in its fragment shaders; failed: a shader's log.
  static Result<std::unique_ptr<MirrorSplatsGl>> create(const GetProcAddress& getProcAddress, int order);
  MirrorSplatsGl(const MirrorSplatsGl&) = delete;
  MirrorSplatsGl& operator=(const MirrorSplatsGl&) = delete;
  ~MirrorSplatsGl();

  // DrawMirrors. usage: sizes that are not those of the camera, records that are not those of `radiance`, another
  // order; unsupported: a picture or more records than this OpenGL takes; memory: of the GPU.
  [[nodiscard]] Status draw(const CameraRays& camera, std::span<const PixelReceiver> receivers,
                            std::span<const MirrorSurface> surfaces, std::span<const Record> records,
                            const RadianceRecords& radiance, const Interpolation& options,
                            std::span<MirrorSplat> picture);

 private:
  struct State;
  explicit MirrorSplatsGl(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
