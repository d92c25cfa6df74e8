// SPDX-License-Identifier: MIT
// See receiver_sight.h.
#include "bake/caches/receiver_sight.h"

#include "bake/base/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kMaxReceivers = 4096;  // most that are kept
// Rays to receivers: to the nearest, who stand in the same air if any does, and to as many of all, for the nearest may
// all be behind one wall.
constexpr std::size_t kSightRays = 32;
constexpr int kReachSteps =
    8;  // from air where few backs are seen to all air that is connected with it, around corners

// Whether a ray reaches one of some receivers. With a normal, only those in front of it count.
bool reachesOne(const Prober& prober, const glm::vec3& from, const glm::vec3& normal,
                std::span<const glm::vec3> receivers) {
  struct Near {
    float distance2 = std::numeric_limits<float>::infinity();  // [m²]
    glm::vec3 at{0.0f};                                        // [m]
  };
  const bool onSurface = normal != glm::vec3(0.0f);
  std::array<Near, kSightRays> nearest;  // by ascending distance
  for (const glm::vec3& receiver : receivers) {
    const glm::vec3 way = receiver - from;
    const float distance2 = glm::dot(way, way);
    if (!(distance2 < nearest.back().distance2) || (onSurface && !(glm::dot(way, normal) > 0.0f))) continue;
    std::size_t k = nearest.size() - 1;
    for (; k > 0 && distance2 < nearest[k - 1].distance2; --k) nearest[k] = nearest[k - 1];
    nearest[k] = {distance2, receiver};
  }
  for (const Near& each : nearest) {
    if (each.distance2 < std::numeric_limits<float>::infinity() && prober.connected(from, each.at)) return true;
  }
  const std::size_t others = std::min(2 * kSightRays, receivers.size());  // half of all are behind a surface
  for (std::size_t i = 0; i < others; ++i) {
    const glm::vec3& receiver = receivers[i * receivers.size() / others];
    if ((!onSurface || glm::dot(receiver - from, normal) > 0.0f) && prober.connected(from, receiver)) return true;
  }
  return false;
}

}  // namespace

ReceiverSight::ReceiverSight(const PlaySpace& playSpace, const Prober& prober, Context& context) : prober_(prober) {
  const std::size_t all = playSpace.receivers.size(), count = std::min(kMaxReceivers, all);
  for (std::size_t i = 0; i < count; ++i) receivers_.push_back(playSpace.receivers[i * all / count]);
  // Cameras, and points that were looked for, are in free space, and so is all that walks from there reach.
  if (!prober.tracer().scene().volumes.empty() && count > 0) keepFree(context);
}

void ReceiverSight::keepFree(Context& context) {
  // Most of a play volume is air: who sees no more backs of one-sided faces than half of all receivers stands in it.
  std::vector<float> backs(receivers_.size());
  parallelChunks(context, "", receivers_.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) backs[i] = prober_.probe(receivers_[i], glm::vec3(0.0f), 0.0f).back;
  });
  std::vector<float> sorted = backs;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::vector<glm::vec3> free, others;
  for (std::size_t i = 0; i < receivers_.size(); ++i) (backs[i] <= *middle ? free : others).push_back(receivers_[i]);

  // So does who has one of them in sight.
  for (int step = 0; step < kReachSteps && !others.empty(); ++step) {
    std::vector<std::uint8_t> reached(others.size(), 0);
    parallelChunks(context, "", others.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        reached[i] = reachesOne(prober_, others[i], glm::vec3(0.0f), free) ? 1 : 0;
    });
    std::vector<glm::vec3> hidden;
    for (std::size_t i = 0; i < others.size(); ++i) (reached[i] != 0 ? free : hidden).push_back(others[i]);
    if (hidden.size() == others.size()) break;
    others = std::move(hidden);
  }
  receivers_ = std::move(free);
}

bool ReceiverSight::sees(const SurfaceSpot& spot) const {
  return receivers_.empty() || reachesOne(prober_, spot.positionWorld, spot.normal, receivers_);
}

}  // namespace relume
