// SPDX-License-Identifier: MIT
// See place_records.h. Waves: strides of 32, 16, .. 1 pixels, each in the subsets of an ordered 2 x 2 dither, and each
// subset in batches. The records of a batch are gathered side by side, each of its pixel alone; then all reach out at
// once, so that the next batch knows them.
#include "bake/preview/place_records.h"

#include "bake/base/parallel.h"
#include "bake/preview/record_tiles.h"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>

namespace relume {
namespace {

constexpr std::uint32_t kFirstStride = 32;  // [pixel]
constexpr std::size_t kWaveBatch = 64;      // records

class Placer {
 public:
  Placer(const RecordGatherer& gatherer, const CameraRays& camera, std::span<const PixelReceiver> receivers,
         const PlacementOptions& options, std::vector<Record>& records, Context& context)
      : gatherer_(gatherer),
        camera_(camera),
        receivers_(receivers),
        options_(options),
        records_(records),
        context_(context),
        width_(static_cast<std::uint32_t>(camera.width)),
        height_(static_cast<std::uint32_t>(camera.height)),
        covered_(receivers.size(), 0) {
    for (const PixelReceiver& r : receivers) seen_ += r.normal != glm::vec3(0.0f) ? 1 : 0;
    mark(records);
  }

  Placement run() {
    if (options_.order == PlacementOrder::linear) {
      wave(1, 0, 0, 1);
      return outcome_;
    }
    for (const PixelWave& w : pixelWaves()) {
      wave(w.stride, w.x, w.y, kWaveBatch);
      if (outcome_ != Placement::complete) break;
    }
    return outcome_;
  }

 private:
  // Visit every stride-th pixel from (x, y) on.
  void wave(std::uint32_t stride, std::uint32_t x0, std::uint32_t y0, std::size_t batch) {
    for (std::uint32_t y = y0; y < height_; y += stride) {
      for (std::uint32_t x = x0; x < width_; x += stride) {
        const std::size_t pixel = std::size_t{y} * width_ + x;
        if (covered_[pixel] != 0 || receivers_[pixel].normal == glm::vec3(0.0f)) continue;
        batch_.push_back(static_cast<std::uint32_t>(pixel));
        if (batch_.size() == batch && !gatherBatch()) return;
      }
    }
    gatherBatch();
  }

  bool gatherBatch() {
    if (outcome_ == Placement::complete && !batch_.empty()) {
      if (options_.deadline && std::chrono::steady_clock::now() >= *options_.deadline) outcome_ = Placement::late;
      const std::size_t room = options_.maxRecords - std::min<std::size_t>(options_.maxRecords, records_.size());
      if (batch_.size() > room) outcome_ = Placement::full;
      batch_.resize(std::min(batch_.size(), outcome_ == Placement::late ? 0 : room));
    }
    const std::size_t first = records_.size();
    records_.resize(first + batch_.size());
    if (options_.keeper != nullptr) options_.keeper->resize(records_.size());
    if (options_.draw != nullptr) drawBatch();
    parallelChunks(context_, "", batch_.size(), 4, [&](std::size_t begin, std::size_t end) {
      std::unique_ptr<RecordGatherer::Scratch> scratch = borrow();
      for (std::size_t i = begin; i < end && !context_.cancelled(); ++i) {
        records_[first + i] = gatherOne(i, *scratch);
        if (options_.keeper != nullptr) options_.keeper->keep(first + i, batch_[i], records_[first + i], *scratch);
      }
      const std::lock_guard lock(mutex_);
      idle_.push_back(std::move(scratch));
    });
    // Which of them were made before a cancel depends on the threads: none counts.
    if (context_.cancelled()) {
      outcome_ = Placement::cancelled;
      records_.resize(first);
      if (options_.keeper != nullptr) options_.keeper->resize(first);
    }
    mark(std::span<const Record>(records_).subspan(first));
    batch_.clear();
    tell();
    return outcome_ == Placement::complete;
  }

  void drawBatch() {
    poses_.clear();
    for (const std::uint32_t pixel : batch_) poses_.push_back(gatherer_.poseOf(receivers_[pixel]));
    const std::size_t count = batch_.size() * gatherer_.cells().count();
    radiance_.resize(count);
    distance_.resize(count);
    (*options_.draw)(poses_, radiance_, distance_);
  }

  Record gatherOne(std::size_t i, RecordGatherer::Scratch& scratch) const {
    const PixelReceiver& receiver = receivers_[batch_[i]];
    if (options_.draw == nullptr) return gatherer_.gather(receiver, batch_[i], scratch);
    const std::size_t count = gatherer_.cells().count();
    return gatherer_.gatherDrawn(receiver, std::span(radiance_).subspan(i * count, count),
                                 std::span(distance_).subspan(i * count, count), scratch);
  }

  // Memory that another chunk has left, or new.
  std::unique_ptr<RecordGatherer::Scratch> borrow() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<RecordGatherer::Scratch>();
    auto scratch = std::move(idle_.back());
    idle_.pop_back();
    return scratch;
  }

  // Report which share of the image is reached; seldom where it is large, for it is counted.
  void tell() {
    constexpr std::size_t kPixelsPerReport = 1u << 20;
    if (++batches_ % (1 + covered_.size() / kPixelsPerReport) != 0) return;
    const auto count = static_cast<double>(std::count(covered_.begin(), covered_.end(), std::uint8_t{1}));
    context_.progress("records", seen_ > 0 ? count / static_cast<double>(seen_) : 1.0);
  }

  void mark(std::span<const Record> records) {
    markCovered(camera_, records, options_.interpolation, receivers_, covered_, context_);
  }

  const RecordGatherer& gatherer_;
  const CameraRays& camera_;
  std::span<const PixelReceiver> receivers_;
  const PlacementOptions& options_;
  std::vector<Record>& records_;
  Context& context_;
  std::uint32_t width_, height_;
  std::vector<std::uint8_t> covered_;  // [Size receivers]
  std::vector<std::uint32_t> batch_;   // pixels
  std::vector<glm::mat4> poses_;       // [Size batch] of those that are drawn, with their pictures
  std::vector<glm::vec3> radiance_;
  std::vector<float> distance_;
  std::size_t seen_ = 0, batches_ = 0;
  Placement outcome_ = Placement::complete;
  std::mutex mutex_;
  std::vector<std::unique_ptr<RecordGatherer::Scratch>> idle_;
};

}  // namespace

std::vector<PixelWave> pixelWaves() {
  constexpr std::array<std::array<std::uint32_t, 2>, 4> kDither{{{0, 0}, {1, 1}, {1, 0}, {0, 1}}};
  std::vector<PixelWave> waves;
  for (std::uint32_t stride = kFirstStride; stride > 0; stride /= 2) {
    for (const auto& [x, y] : kDither) waves.push_back({2 * stride, x * stride, y * stride});
  }
  return waves;
}

Placement placeRecords(const RecordGatherer& gatherer, const CameraRays& camera,
                       std::span<const PixelReceiver> receivers, const PlacementOptions& options,
                       std::vector<Record>& records, Context& context) {
  return Placer(gatherer, camera, receivers, options, records, context).run();
}

}  // namespace relume
