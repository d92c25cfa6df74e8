// SPDX-License-Identifier: MIT
// See look_turns.h.
#include "runtime/shared/look_turns.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr float kBudget = 1.0f / 32.0f;  // of all caches
// What a look by rays takes, in looks by a view.
constexpr float kRayLooks = 8.0f;
constexpr float kMostEachFrame = 4.0f;  // what is nearest has its turn once in a few frames
constexpr float kMostLamps = 2.0f;      // in whose reach a cache is, in the mean

// What parts cover, in steps of half an octave from kMinCovered on.
constexpr std::size_t kSteps = 24;
const std::array<float, kSteps + 1> kCovered = [] {
  std::array<float, kSteps + 1> covered{};
  for (std::size_t i = 0; i <= kSteps; ++i) covered[i] = kMinCovered * std::exp2(0.5f * static_cast<float>(i));
  return covered;
}();

// The same from where lamps may end to where they are near.
constexpr std::size_t kLampSteps = 12;
const std::array<float, kLampSteps + 1> kLampCovered = [] {
  std::array<float, kLampSteps + 1> covered{};
  for (std::size_t i = 0; i <= kLampSteps; ++i)
    covered[i] = kMinCovered * std::exp2(0.5f * (static_cast<float>(i) - static_cast<float>(kLampSteps)));
  return covered;
}();

}  // namespace

LookTurns::LookTurns(const Caches& caches, std::uint32_t lag, std::pmr::memory_resource* memory)
    : lag_(lag),
      bounds_((caches.count() + kBlock - 1) / kBlock, Bounds{}, memory),
      leastPeriod_(bounds_.size(), 0, memory) {
  for (std::uint32_t block = 0; block < bounds_.size(); ++block) {
    const std::uint32_t begin = block * kBlock, end = std::min(caches.count(), begin + kBlock);
    Bounds& bounds = bounds_[block];
    for (std::uint32_t cache = begin; cache < end; ++cache)
      bounds.centre += caches.positionWorld[cache] / static_cast<float>(end - begin);
    for (std::uint32_t cache = begin; cache < end; ++cache)
      bounds.radius = std::max(bounds.radius, glm::distance(bounds.centre, caches.positionWorld[cache]));
    // Rows of the grid may be as long as blocks: the middle of each would lie in one plane.
    const std::uint32_t any = begin + (block * 0x9E3779B9u >> 16) % (end - begin);
    bounds.place = caches.positionWorld[any];
    bounds.normal = caches.normal[any];
  }
}

// The least eachFrame_ with which a frame keeps to its budget, by a look at one cache of each block.
void LookTurns::chooseEachFrame(std::span<const PartSphere> parts) {
  if (lag_ == 1) return;
  std::array<float, kSteps> looks{};
  for (const Bounds& bounds : bounds_) {
    float covered = 0.0f, limit = 0.0f;
    for (const PartSphere& part : parts) {
      const float each = coveredBy(part, bounds.place, bounds.normal);
      if (each == 0.0f) continue;
      limit = covered > 0.0f ? 0.0f : kFarSolidAngle[part.ball > 0.0f];
      covered += each;
    }
    if (covered == 0.0f) continue;
    const auto above = std::upper_bound(kCovered.begin() + 1, kCovered.end() - 1, covered);
    looks[static_cast<std::size_t>(above - kCovered.begin()) - 1] +=
        std::numbers::pi_v<float> * covered < limit ? 1.0f : kRayLooks;
  }
  const float budget = kBudget * static_cast<float>(bounds_.size());
  for (const float each : kCovered) {
    eachFrame_ = each;
    float sum = 0.0f;
    for (std::size_t step = 0; step < kSteps; ++step)
      sum += looks[step] / static_cast<float>(periodOf(kCovered[step + 1]));
    if (sum <= budget || each >= kMostEachFrame) return;
  }
}

// By a look at one cache of each block. It goes on from step to step as the parts move.
void LookTurns::chooseReach(std::span<const PartSphere> parts) {
  static_assert(kLampReach == 1u << (kLampSteps / 2));
  std::array<float, kLampSteps> reached{};
  bool any = false;
  for (const PartSphere& part : parts) {
    if (!part.emits) continue;
    any = true;
    for (const Bounds& bounds : bounds_) {
      if (lampWeight(part, kLampCovered[0], bounds.place, bounds.normal) == 0.0f) continue;
      const glm::vec3 offset = part.centre - bounds.place;
      const float covered = part.radius * part.radius / glm::dot(offset, offset);
      const auto above = std::upper_bound(kLampCovered.begin() + 1, kLampCovered.end() - 1, covered);
      reached[static_cast<std::size_t>(above - kLampCovered.begin()) - 1] += 1.0f;
    }
  }
  leastOfLamps_ = any ? kLampCovered[0] : kMinCovered;
  float left = kMostLamps * static_cast<float>(bounds_.size());
  for (std::size_t step = kLampSteps; step-- > 0; left -= reached[step]) {
    if (reached[step] <= left) continue;
    const float share = left / reached[step];
    leastOfLamps_ = kLampCovered[step + 1] + share * (kLampCovered[step] - kLampCovered[step + 1]);
    return;
  }
}

void LookTurns::begin(std::span<const PartSphere> parts) {
  ++frame_;
  chooseReach(parts);
  chooseEachFrame(parts);
  for (std::uint32_t block = 0; block < bounds_.size(); ++block) {
    const Bounds& bounds = bounds_[block];
    // At most so much is covered of the caches within.
    float covered = 0.0f;
    bool isReached = false;
    for (const PartSphere& part : parts) {
      const float nearest = std::max(glm::distance(part.centre, bounds.centre) - bounds.radius, part.radius),
                  each = part.radius * part.radius / (nearest * nearest);
      if (each > kMinCovered) covered += each;
      isReached = isReached || each > (part.emits ? leastOfLamps_ : kMinCovered);
    }
    leastPeriod_[block] = isReached ? periodOf(covered) : 0;
  }
}

}  // namespace relume
