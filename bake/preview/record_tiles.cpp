// SPDX-License-Identifier: MIT
// See record_tiles.h.
#include "bake/preview/record_tiles.h"

#include "bake/base/parallel.h"
#include "bake/preview/screen_box.h"

#include <glm/geometric.hpp>

#include <atomic>

namespace relume {
namespace {

// Calls visit(tile) for the tiles that a box of pixels meets.
template <class Visit>
void visitTiles(const ScreenBox& box, std::uint32_t columns, const Visit& visit) {
  if (box.minX >= box.maxX || box.minY >= box.maxY) return;
  constexpr std::uint32_t kSide = RecordTiles::kSide;
  for (std::uint32_t y = box.minY / kSide; y <= (box.maxY - 1) / kSide; ++y) {
    for (std::uint32_t x = box.minX / kSide; x <= (box.maxX - 1) / kSide; ++x) visit(y * columns + x);
  }
}

}  // namespace

RecordTiles::RecordTiles(const CameraRays& camera, std::span<const Record> records, const Interpolation& options)
    : records_(records), options_(options) {
  const auto width = static_cast<std::uint32_t>(camera.width), height = static_cast<std::uint32_t>(camera.height);
  columns_ = (width + kSide - 1) / kSide;
  const std::uint32_t rows = (height + kSide - 1) / kSide;

  // Count, then fill, record by record.
  std::vector<ScreenBox> boxes;
  boxes.reserve(records.size());
  reach_.reserve(records.size());
  begin_.assign(std::size_t{columns_} * rows + 1, 0);
  for (const Record& record : records) {
    reach_.push_back(reachOf(record, options));
    boxes.push_back(boxOfSphere(camera, record.positionWorld, reach_.back()));
    visitTiles(boxes.back(), columns_, [&](std::uint32_t tile) { begin_[tile + 1] += 1; });
  }
  for (std::size_t tile = 1; tile < begin_.size(); ++tile) begin_[tile] += begin_[tile - 1];
  list_.resize(begin_.back());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t k = 0; k < records.size(); ++k) {
    visitTiles(boxes[k], columns_, [&](std::uint32_t tile) { list_[next[tile]++] = k; });
  }
}

template <class Visit>
void RecordTiles::visit(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver, const Visit& each) const {
  const std::size_t tile = std::size_t{y / kSide} * columns_ + x / kSide;
  for (std::uint32_t i = begin_[tile]; i < begin_[tile + 1]; ++i) {
    const std::uint32_t k = list_[i];
    const Record& record = records_[k];
    const float w = weightOf(record, reach_[k], receiver, options_);
    if (!(w > 0.0f)) continue;
    each(Weighed{k, w, gradientShare(record, reach_[k], options_) * (receiver.positionWorld - record.positionWorld)});
  }
}

RecordTiles::Part RecordTiles::partOf(const Weighed& weighed, const PixelReceiver& receiver) const {
  const Record& record = records_[weighed.record];
  const glm::vec3& normal = options_.gradients ? receiver.litNormal() : record.normal;
  return {weighed.record, weighed.weight, extrapolate(record.reflected, weighed.offset, normal),
          extrapolate(record.sky, weighed.offset, normal)};
}

void RecordTiles::add(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver, Splat& sums) const {
  visit(x, y, receiver, [&](const Weighed& weighed) {
    const Part part = partOf(weighed, receiver);
    sums.reflected += part.weight * part.reflected;
    sums.sky += part.weight * part.sky;
    sums.weight += part.weight;
  });
}

Splat RecordTiles::splat(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver) const {
  Splat sum;
  add(x, y, receiver, sum);
  if (sum.weight > 0.0f) {
    sum.reflected /= sum.weight;
    sum.sky /= sum.weight;
  }
  return sum;
}

void RecordTiles::split(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver,
                        std::vector<Part>& parts) const {
  parts.clear();
  visit(x, y, receiver, [&](const Weighed& weighed) { parts.push_back(partOf(weighed, receiver)); });
}

void RecordTiles::weigh(std::uint32_t x, std::uint32_t y, const PixelReceiver& receiver,
                        std::vector<Weighed>& list) const {
  list.clear();
  visit(x, y, receiver, [&list](const Weighed& weighed) { list.push_back(weighed); });
}

void markCovered(const CameraRays& camera, std::span<const Record> records, const Interpolation& options,
                 std::span<const PixelReceiver> receivers, std::span<std::uint8_t> covered, Context& context) {
  const auto width = static_cast<std::uint32_t>(camera.width);
  parallelChunks(context, "", records.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const float reach = reachOf(records[k], options);
      const ScreenBox box = boxOfSphere(camera, records[k].positionWorld, reach);
      for (std::uint32_t y = box.minY; y < box.maxY; ++y) {
        for (std::uint32_t x = box.minX; x < box.maxX; ++x) {
          const std::size_t pixel = std::size_t{y} * width + x;
          const std::atomic_ref<std::uint8_t> mark(covered[pixel]);
          if (mark.load(std::memory_order_relaxed) != 0) continue;
          const PixelReceiver& r = receivers[pixel];
          if (r.normal == glm::vec3(0.0f)) continue;
          if (weightOf(records[k], reach, r, options) > 0.0f) mark.store(1, std::memory_order_relaxed);
        }
      }
    }
  });
}

}  // namespace relume
