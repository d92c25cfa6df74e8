// SPDX-License-Identifier: MIT
// How much what receivers read has changed: see compare_receivers.h.
#include "tools/compare/compare_receivers.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

glm::dvec3 read(const Reading& reading, const Relighter& relighter) {
  return reading.onMap ? relighter.irradianceOnLightmap(reading.uv, reading.normal, reading.planeNormal)
                       : relighter.irradianceInGrid(reading.positionWorld, reading.normal);
}

struct Sums {
  double squaresA = 0.0, squares = 0.0;
  std::uint32_t count = 0;

  void add(const glm::dvec3& a, const glm::dvec3& b) {
    squaresA += glm::dot(a, a);
    squares += glm::dot(b - a, b - a);
    ++count;
  }
  double change(double floor) const {
    if (count == 0 || squares == 0.0) return 0.0;
    return bounded(std::sqrt(squares / count) / (std::sqrt(squaresA / count) + floor));
  }
};

}  // namespace

ReceiverLighting compareReceivers(const Receivers& receivers, const std::vector<bool>& ignored, const Relighter& a,
                                  const Relighter& b) {
  std::vector<Sums> sums(receivers.groups.size());
  Sums surfaces, air;
  double meanA = 0.0, meanB = 0.0;
  std::size_t counted = 0;
  for (const Receiver& receiver : receivers.list) {
    if (ignored[receiver.group]) continue;
    const glm::dvec3 before = read(receiver.a, a), now = read(receiver.b, b);
    sums[receiver.group].add(before, now);
    (receiver.group == Receivers::kAir ? air : surfaces).add(before, now);
    ++counted;
    meanA += glm::length(before);
    meanB += glm::length(now);
  }
  const double floor = 0.05 * std::max(meanA, meanB) / static_cast<double>(std::max<std::size_t>(counted, 1));
  ReceiverLighting result{surfaces.change(floor), air.change(floor), {}};
  for (std::uint32_t g = 0; g < sums.size(); ++g) result.groups.push_back({g, sums[g].count, sums[g].change(floor)});
  return result;
}

}  // namespace relume
