// SPDX-License-Identifier: MIT
// Pictures of a room by its closed form, records strewn over it and elsewhere, and both splats of them.
#pragma once

#include "bake/preview/record_tiles.h"
#include "bake/scene/camera_rays.h"
#include "tools/gl_splat/splats_gl.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace relume::test {

// A camera in a box of 8 x 5 x 8 m around (0, 1, 0), with a ball of 1 m in it; a hole in the roof shows nothing.
struct SplatView {
  SplatView(std::uint32_t width, std::uint32_t height, bool orthographic = false);
  Camera camera;
  CameraRays rays;
  std::vector<PixelReceiver> receivers;
};

// On what the pixels show; every fourth elsewhere: behind the camera, around it, beside what it sees. With light from
// surfaces and from the sky whose gradients are as large as itself over a metre.
std::vector<Record> strewn(const SplatView& view, std::size_t count, std::uint64_t seed = 1);
// Other light for them.
void shine(std::span<Record> records, std::uint64_t seed);

// By RecordTiles.
std::vector<Splat> splatByCpu(const SplatView& view, std::span<const Record> records, const Interpolation& options);

struct SplatDifference {
  double rms = 0.0;       // relative, of irradiance, reflected and sky
  double largest = 0.0;   // of a pixel, over the root mean square
  double weight = 0.0;    // largest difference of weights, over their root mean square
  std::size_t lit = 0;    // pixels in both
  std::size_t apart = 0;  // pixels that have a weight in one alone, ties left out
  std::size_t ties = 0;   // likewise, as far as a record reaches or turned as far: its weight is less than 1e-4 / a, or
                          // by Ward's weights, which end in 1 / a, less than 1.0001 / a
};
SplatDifference compareSplats(std::span<const Splat> cpu, std::span<const Splat> gl, const Interpolation& options);

}  // namespace relume::test
