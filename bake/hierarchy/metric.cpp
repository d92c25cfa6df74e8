// SPDX-License-Identifier: MIT
// See metric.h.
#include "bake/hierarchy/metric.h"

#include "formats/decimal.h"

#include <glm/common.hpp>

#include <cmath>
#include <string>

namespace relume {

Status checkClusterInput(const Surfels& surfels, std::span<const std::uint32_t> members,
                         const ClusteringOptions& options) {
  constexpr float kMaxWeight = 1e6f;
  const auto inRange = [](float w) { return w >= 0.0f && w <= kMaxWeight; };
  if (!inRange(options.normalWeight) || !inRange(options.balanceWeight) || !inRange(options.outlookWeight)) {
    return Error{ErrorCode::usage, "clustering weights must be in [0, 1e6], found normalWeight " +
                                       decimal(options.normalWeight) + ", balanceWeight " +
                                       decimal(options.balanceWeight) + ", outlookWeight " +
                                       decimal(options.outlookWeight)};
  }
  if (members.empty()) return Error{ErrorCode::failed, "clustering needs at least one surfel"};
  for (const std::uint32_t member : members) {
    if (member >= surfels.count()) {
      return Error{ErrorCode::failed, "clustering: surfel " + std::to_string(member) + " of " +
                                          std::to_string(surfels.count()) + " does not exist"};
    }
  }
  return done();
}

ClusterMetric metricOf(const Surfels& surfels, const ClusteringOptions& options) {
  glm::vec3 low = surfels.positionWorld[0], high = low;
  for (const glm::vec3& p : surfels.positionWorld) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  ClusterMetric metric;
  const float extent = glm::length(high - low);
  metric.origin = 0.5f * (low + high);
  metric.inverseExtent = extent > 0.0f ? 1.0f / extent : 0.0f;
  metric.normalScale = std::sqrt(0.5f * options.normalWeight);
  metric.centroidScale = std::sqrt(options.outlookWeight);
  metric.balanceWeight = options.balanceWeight;
  return metric;
}

ClusterSum leafOf(const Surfels& surfels, std::uint32_t surfel, std::span<const glm::vec3> centroids,
                  const ClusterMetric& metric) {
  const auto toExtent = [&](const glm::vec3& position) { return (position - metric.origin) * metric.inverseExtent; };
  const glm::vec3 normal = surfels.normal[surfel];
  return {toExtent(surfels.positionWorld[surfel]), normal, normal, 1,
          centroids.empty() ? glm::vec3(0.0f) : toExtent(centroids[surfel])};
}

}  // namespace relume
