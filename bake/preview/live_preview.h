// SPDX-License-Identifier: MIT
// A view by records that is never finished at once: each frame adds a few records, a light that moves relights those
// there are (leaf_records.h), and a camera that moves keeps them (RCS 5, Fig. 10).
//
// In: a camera, frame by frame, and the leaves' radiance. Out: irradiance at the pixels that records reach by now.
#pragma once

#include "bake/preview/draw_splats.h"
#include "bake/preview/leaf_records.h"
#include "bake/preview/place_records.h"
#include "bake/preview/record_tiles.h"
#include "bake/preview/weights.h"
#include "bake/scene/camera_rays.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace relume {

// Functions are called from one thread at a time, and run on the context's.
class LivePreview {
 public:
  struct Options {
    float accuracy = 0.25f;            // [0.02..2] a of RCS
    std::uint32_t rays = 1024;         // [16..LeafRecords::kMaxRays] a record casts
    std::uint32_t maxRecords = 20000;  // [>= 1] then those out of view are dropped, or no more are made
    float contrast = 0.1f;             // as PreviewOptions::contrast
    int rounds = 2;                    // [>= 0] as PreviewOptions::rounds, once the picture is whole
    std::uint64_t seed = 1;
  };
  // `tracer` is kept by reference: its geometry is seen and is what light travels among.
  LivePreview(const RayTracer& tracer, HitLeaf leafOf, const Sky& sky, const Options& options);

  // Splat by a rasteriser from the next look() on, whose picture picture() does not have; null, as at first: here. It
  // is kept by reference, and no longer used once it fails: this splats on in its place.
  void drawBy(SplatDrawer* drawer) { nextDrawer_ = drawer; }
  // Whether one does.
  bool isDrawn() const { return drawer_ != nullptr; }
  // Of what it failed, once.
  std::optional<Error> takeDrawError() { return std::exchange(drawError_, std::nullopt); }

  // Show another view; records stay. [1..16384]² pixels
  void look(const Camera& camera, std::uint32_t width, std::uint32_t height, Context& context);
  // Relight all records, and the picture. radiance [W/m²/sr] of the leaves. [Size leaves] How far records reach does
  // not change, so that no pixel loses its light.
  void relight(std::span<const glm::vec3> radiance, Context& context);
  // Once the light stands still: let records reach as far as it allows. Pixels that lose theirs keep what they show
  // until fill() has reached them.
  void settle(Context& context);
  // Add up to `most` records, as long as it is before the deadline; at least a batch of them where any is missing.
  // Returns how many were added. The same at any number of threads, but for what the deadline makes of it.
  std::uint32_t fill(std::uint32_t most, const Deadline& deadline, Context& context);
  // Whether there is nothing to add.
  bool isComplete() const { return isComplete_; }

  std::uint32_t width() const { return camera_ ? static_cast<std::uint32_t>(camera_->width) : 0; }
  std::uint32_t height() const { return camera_ ? static_cast<std::uint32_t>(camera_->height) : 0; }
  // What the pixels' centres show, row 0 on top. [Size width * height]
  std::span<const PixelReceiver> receivers() const { return receivers_; }
  // Their irradiance, reflected and straight from the sky; weight 0 where no record has reached yet, and everywhere
  // while a rasteriser splats. [Size likewise]
  std::span<const Splat> picture() const { return picture_; }
  const LeafRecords& records() const { return records_; }

 private:
  void findBatch(std::size_t most, std::vector<std::uint32_t>& batch);
  void restart();
  void limitReach(Context& context);
  void dropUnseen();
  void splatAll(Context& context);
  void splatFrom(std::size_t first, Context& context);
  void markAll(Context& context);
  bool letDraw(const std::function<Status(SplatDrawer&)>& draw, Context& context);

  const RayTracer& tracer_;
  Options options_;
  Interpolation interpolation_;
  LeafRecords records_;
  std::optional<CameraRays> camera_;
  std::vector<PixelReceiver> receivers_;
  std::vector<Splat> sums_;            // not yet divided [Size pixels]
  std::vector<Splat> picture_;         // [Size pixels]
  std::vector<std::uint8_t> covered_;  // by a record [Size pixels]
  std::vector<PixelWave> waves_;
  std::size_t wave_ = 0;         // that is being walked
  std::uint32_t x_ = 0, y_ = 0;  // and where
  int roundsLeft_ = 0;
  bool isComplete_ = false;
  SplatDrawer *drawer_ = nullptr, *nextDrawer_ = nullptr;
  std::optional<Error> drawError_;
};

}  // namespace relume
