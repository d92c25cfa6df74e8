// SPDX-License-Identifier: MIT
// See adapt_reach.h.
#include "bake/preview/adapt_reach.h"

#include "bake/base/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace relume {
namespace {

constexpr float kLeastShare = 0.05f;   // of a pixel's weights: what counts for less may differ
constexpr float kDark = 0.1f;          // of the mean light: what is darker need not agree better
constexpr float kNoiseAllowed = 2.5f;  // of a record by noise that are not held against it
constexpr std::size_t kPixelsPerChunk = 4096;

float sumOf(const glm::vec3& c) { return c.x + c.y + c.z; }

// The mean light of all pixels that have any, summed in an order of its own.
float meanLight(const RecordTiles& tiles, std::span<const PixelReceiver> receivers, std::uint32_t width,
                Context& context) {
  std::vector<float> light(receivers.size(), 0.0f);
  parallelChunks(context, "", receivers.size(), kPixelsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (receivers[i].normal == glm::vec3(0.0f)) continue;
      const Splat splat =
          tiles.splat(static_cast<std::uint32_t>(i % width), static_cast<std::uint32_t>(i / width), receivers[i]);
      light[i] = sumOf(splat.reflected + splat.sky);
    }
  });
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < light.size(); ++i) {
    sum += light[i];
    count += receivers[i].normal != glm::vec3(0.0f) ? 1.0 : 0.0;
  }
  return count > 0.0 ? static_cast<float>(sum / count) : 0.0f;
}

void lower(float& value, float to) {
  const std::atomic_ref<float> shared(value);
  float now = shared.load(std::memory_order_relaxed);
  while (to < now && !shared.compare_exchange_weak(now, to, std::memory_order_relaxed)) {
  }
}

}  // namespace

std::uint32_t limitReaches(const RecordTiles& tiles, std::span<const PixelReceiver> receivers, std::uint32_t width,
                           float contrast, std::vector<Record>& records, Context& context) {
  const float dark = kDark * meanLight(tiles, receivers, width, context);
  std::vector<float> limit;
  for (const Record& record : records) limit.push_back(record.limit);
  parallelChunks(context, "", receivers.size(), kPixelsPerChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<RecordTiles::Part> parts;
    for (std::size_t i = begin; i < end; ++i) {
      const PixelReceiver& receiver = receivers[i];
      if (receiver.normal == glm::vec3(0.0f)) continue;
      tiles.split(static_cast<std::uint32_t>(i % width), static_cast<std::uint32_t>(i / width), receiver, parts);
      float weights = 0.0f;
      for (const RecordTiles::Part& part : parts) weights += part.weight;
      std::erase_if(parts, [&](const RecordTiles::Part& part) { return part.weight < kLeastShare * weights; });
      if (parts.size() < 2) continue;

      glm::vec3 least(INFINITY), most(0.0f);
      for (RecordTiles::Part& part : parts) {
        part.reflected += part.sky;
        least = glm::min(least, part.reflected);
        most = glm::max(most, part.reflected);
      }
      // What the rays' randomness explains is no contradiction; three channels as luminance.
      float noise = 0.0f;
      for (const RecordTiles::Part& part : parts) noise = std::max(noise, records[part.record].noise);
      const float allowed = contrast * std::max(0.5f * sumOf(least + most), dark) + kNoiseAllowed * 3.0f * noise;
      if (sumOf(most - least) <= allowed) continue;
      for (const RecordTiles::Part& part : parts) {
        if (std::max(sumOf(most - part.reflected), sumOf(part.reflected - least)) <= allowed) continue;
        const float away = glm::distance(receiver.positionWorld, records[part.record].positionWorld);
        lower(limit[part.record], 0.999f * away);
      }
    }
  });
  std::uint32_t limited = 0;
  for (std::size_t k = 0; k < records.size(); ++k) {
    limited += limit[k] < records[k].limit ? 1 : 0;
    records[k].limit = limit[k];
  }
  return limited;
}

}  // namespace relume
