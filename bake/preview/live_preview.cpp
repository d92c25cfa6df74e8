// SPDX-License-Identifier: MIT
// See live_preview.h.
#include "bake/preview/live_preview.h"

#include "bake/base/parallel.h"
#include "bake/preview/adapt_reach.h"
#include "bake/preview/receivers.h"
#include "bake/preview/screen_box.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kBatch = 32;  // records that are gathered side by side
constexpr std::size_t kRowsPerChunk = 4;

LeafRecords::Options recordOptions(const LivePreview::Options& o) { return {o.rays, o.seed, true}; }

}  // namespace

LivePreview::LivePreview(const RayTracer& tracer, HitLeaf leafOf, const Sky& sky, const Options& options)
    : tracer_(tracer),
      options_(options),
      interpolation_{RecordWeight::smooth, options.accuracy},
      records_(tracer, std::move(leafOf), sky, recordOptions(options)),
      waves_(pixelWaves()) {}

void LivePreview::look(const Camera& camera, std::uint32_t width, std::uint32_t height, Context& context) {
  camera_.emplace(camera, width, height);
  receivers_ = findReceivers(tracer_, *camera_, context);
  if (records_.records().size() > options_.maxRecords / 2) dropUnseen();
  const ReceiverMaker make(*camera_);
  for (Record& record : records_.records()) {
    const float footprint = make.at({{}, record.positionWorld, record.normal, record.normal, false}).footprint;
    record.footprint = footprint > 0.0f ? footprint : record.footprint;
  }
  picture_.assign(receivers_.size(), {});
  drawer_ = nextDrawer_;
  letDraw([&](SplatDrawer& drawer) { return drawer.look(*camera_, receivers_); }, context);
  splatAll(context);
  restart();
}

void LivePreview::relight(std::span<const glm::vec3> radiance, Context& context) {
  records_.relight(radiance, context);
  if (!camera_) return;
  // What records reach has not changed.
  if (letDraw([&](SplatDrawer& drawer) { return drawer.relight(records_.records()); }, context)) return;
  splatAll(context);
}

void LivePreview::settle(Context& context) {
  records_.adaptReach(context);
  if (!camera_) return;
  splatAll(context);
  restart();
}

std::uint32_t LivePreview::fill(std::uint32_t most, const Deadline& deadline, Context& context) {
  const std::size_t first = records_.records().size();
  std::vector<std::uint32_t> batch;
  while (camera_ && !isComplete_ && !context.cancelled()) {
    const std::size_t now = records_.records().size(), added = now - first;
    if (added >= most) break;
    if (added > 0 && deadline && std::chrono::steady_clock::now() >= *deadline) break;
    const std::size_t room = options_.maxRecords - std::min<std::size_t>(options_.maxRecords, now);
    findBatch(std::min({kBatch, most - added, room}), batch);
    if (batch.empty()) {
      // The picture is whole, unless records turn out to contradict each other.
      isComplete_ = true;
      splatFrom(first, context);
      if (room > 0) limitReach(context);
      return static_cast<std::uint32_t>(added);
    }
    records_.gather(receivers_, batch, context);
    markCovered(*camera_, std::span<const Record>(records_.records()).subspan(now), interpolation_, receivers_,
                covered_, context);
  }
  splatFrom(first, context);
  return static_cast<std::uint32_t>(records_.records().size() - first);
}

// The next pixels that no record reaches, at most so many.
void LivePreview::findBatch(std::size_t most, std::vector<std::uint32_t>& batch) {
  batch.clear();
  for (; wave_ < waves_.size(); ++wave_) {
    const PixelWave& wave = waves_[wave_];
    for (; wave.y + y_ < height(); y_ += wave.stride) {
      while (wave.x + x_ < width()) {
        if (batch.size() == most) return;
        const std::uint32_t pixel = (wave.y + y_) * width() + wave.x + x_;
        x_ += wave.stride;
        if (covered_[pixel] != 0 || receivers_[pixel].normal == glm::vec3(0.0f)) continue;
        batch.push_back(pixel);
      }
      x_ = 0;
    }
    y_ = 0;
    // The next wave is to know what this one's records reach.
    if (!batch.empty()) {
      ++wave_;
      return;
    }
  }
}

void LivePreview::restart() {
  wave_ = 0;
  x_ = y_ = 0;
  roundsLeft_ = options_.rounds;
  isComplete_ = false;
}

void LivePreview::limitReach(Context& context) {
  if (roundsLeft_ == 0) return;
  roundsLeft_ -= 1;
  std::vector<Record>& records = records_.records();
  {
    const RecordTiles tiles(*camera_, records, interpolation_);
    if (limitReaches(tiles, receivers_, width(), options_.contrast, records, context) == 0) return;
  }
  splatAll(context);
  wave_ = 0;
  x_ = y_ = 0;
  isComplete_ = false;
}

// The records of another view that this one does not see.
void LivePreview::dropUnseen() {
  std::vector<std::uint8_t> marks;
  for (const Record& record : records_.records()) {
    const ScreenBox box = boxOfSphere(*camera_, record.positionWorld, reachOf(record, interpolation_));
    marks.push_back(box.minX < box.maxX && box.minY < box.maxY ? 1 : 0);
  }
  records_.keep(marks);
}

// Whether there is a rasteriser, which then does something. Where it fails all is splatted here, now and from then on.
bool LivePreview::letDraw(const std::function<Status(SplatDrawer&)>& draw, Context& context) {
  if (drawer_ == nullptr) return false;
  const Status drawn = draw(*drawer_);
  if (drawn) return true;
  drawError_ = drawn.error();
  drawer_ = nextDrawer_ = nullptr;
  splatAll(context);
  return true;
}

void LivePreview::splatAll(Context& context) {
  if (drawer_ != nullptr) {
    markAll(context);
    letDraw([&](SplatDrawer& drawer) { return drawer.draw(records_.records(), interpolation_); }, context);
    return;
  }
  sums_.assign(receivers_.size(), {});
  splatFrom(0, context);
  covered_.resize(receivers_.size());
  for (std::size_t i = 0; i < covered_.size(); ++i) covered_[i] = sums_[i].weight > 0.0f ? 1 : 0;
}

void LivePreview::markAll(Context& context) {
  covered_.assign(receivers_.size(), 0);
  markCovered(*camera_, records_.records(), interpolation_, receivers_, covered_, context);
}

// Add the records from `first` on to the picture. Sums are those of all records at once, bit for bit.
void LivePreview::splatFrom(std::size_t first, Context& context) {
  const std::span<const Record> records = std::span<const Record>(records_.records()).subspan(first);
  if (!camera_ || records.empty()) return;
  if (letDraw([&](SplatDrawer& drawer) { return drawer.add(records); }, context)) return;
  const RecordTiles tiles(*camera_, records, interpolation_);
  parallelChunks(context, "", height(), kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * width(); i < end * width(); ++i) {
      if (receivers_[i].normal == glm::vec3(0.0f)) continue;
      Splat& sum = sums_[i];
      tiles.add(static_cast<std::uint32_t>(i % width()), static_cast<std::uint32_t>(i / width()), receivers_[i], sum);
      if (!(sum.weight > 0.0f)) continue;
      picture_[i] = {sum.reflected / sum.weight, sum.sky / sum.weight, sum.weight};
    }
  });
}

}  // namespace relume
