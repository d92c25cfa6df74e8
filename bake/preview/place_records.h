// SPDX-License-Identifier: MIT
// Where records go: wherever the image shows something that those there are do not reach (RCS 4.2, Algorithm 2).
#pragma once

#include "bake/preview/draw_hemispheres.h"
#include "bake/preview/gather.h"
#include "bake/preview/record.h"
#include "bake/preview/weights.h"
#include "bake/scene/camera_rays.h"
#include "relume/bake/context.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace relume {

// linear: the paper's scan, pixel after pixel. waves: coarse to fine grids of pixels, in parallel.
enum class PlacementOrder { linear, waves };

// Every stride-th pixel along both axes, from (x, y) on.
struct PixelWave {
  std::uint32_t stride, x, y;
};
// Coarse to fine grids of pixels, each in the four subsets of an ordered 2 x 2 dither. Together they visit all pixels.
std::vector<PixelWave> pixelWaves();

using Deadline = std::optional<std::chrono::steady_clock::time_point>;

enum class Placement {
  complete,  // every receiver is reached
  full,      // there are `maxRecords`
  late,      // the deadline came first
  cancelled  // the context was cancelled first
};

// Keeps more of records than Record has, from what was gathered for them.
struct RecordKeeper {
  std::function<void(std::size_t records)> resize;  // room for so many, from the calling thread
  // Of record number `index`, gathered at a pixel, whose cells `scratch` has, and which may be limited. From many
  // threads at once.
  std::function<void(std::size_t index, std::size_t pixel, Record& record, const RecordGatherer::Scratch& scratch)>
      keep;
};

struct PlacementOptions {
  Interpolation interpolation;
  PlacementOrder order = PlacementOrder::waves;
  std::uint32_t maxRecords = 200000;
  Deadline deadline;
  const DrawHemispheres* draw = nullptr;  // what looks around in place of rays, from the calling thread; null = rays
  const RecordKeeper* keeper = nullptr;   // null = records are all there is
};

// Append records until every pixel's receiver is reached. The records there are at first stay. Result of the order
// alone, whatever the number of threads; a deadline makes it depend on the clock. Ends early when cancelled.
// [Size receivers = pixels of the camera]
Placement placeRecords(const RecordGatherer& gatherer, const CameraRays& camera,
                       std::span<const PixelReceiver> receivers, const PlacementOptions& options,
                       std::vector<Record>& records, Context& context);

}  // namespace relume
