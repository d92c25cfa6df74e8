// SPDX-License-Identifier: MIT
// From records to pixels: sub-pixels with their own albedo and direct light, and indirect light of the pixel's centre
// or, where a pixel shows more than one surface, of their own.
#pragma once

#include "bake/preview/preview.h"
#include "bake/preview/record_tiles.h"
#include "bake/preview/shade_mirrors.h"
#include "bake/reference/emitters.h"

#include <span>

namespace relume {

struct ShadeInput {
  const PreviewScene& scene;
  const PreviewOptions& options;
  const CameraRays& camera;
  const RecordTiles& tiles;
  std::span<const PixelReceiver> receivers;  // [Size pixels]
  std::span<const Splat> centers;            // [Size pixels] indirect light there
  const EmittingTriangles* emitters;         // null = emitting surfaces are off
  const MirrorInput* mirrors;                // null = all of a surface's base colour is diffuse
};

// Fill the layers of a frame of the right size. Incomplete when cancelled.
void shadeFrame(const ShadeInput& input, PreviewFrame& frame, Context& context);

}  // namespace relume
