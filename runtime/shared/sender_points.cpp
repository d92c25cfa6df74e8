// SPDX-License-Identifier: MIT
// See sender_points.h.
#include "runtime/shared/sender_points.h"

#include "formats/sphere_points.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Directions of a sky patch: as many as a node has points, so that a thing before one patch hides a share of it.
constexpr std::uint32_t kSkyDirections = SenderPoints::kMost;

// Direction i of a cap about a unit axis, of `share` of the sphere.
glm::vec3 inCap(const glm::vec3& axis, float share, std::uint32_t i) {
  const glm::vec3 side = glm::normalize(std::abs(axis.x) < 0.7f ? glm::cross(axis, glm::vec3(1, 0, 0))
                                                                : glm::cross(axis, glm::vec3(0, 1, 0)));
  const glm::vec3 up = glm::cross(axis, side);
  // The lattice's points of the whole sphere, moved toward the axis.
  const glm::vec3 p = spherePoint(i, kSkyDirections);
  const float z = 1.0f - share * (1.0f - p.z), radius = std::sqrt(std::max(1.0f - z * z, 0.0f)),
              length = std::sqrt(p.x * p.x + p.y * p.y);
  return z * axis + radius / length * (p.x * side + p.y * up);
}

}  // namespace

SenderPoints::SenderPoints(const Hierarchy& hierarchy, const Surfels& surfels, std::pmr::memory_resource* memory)
    : point_(memory), first_(hierarchy.nodeCount(), Range{}, memory) {
  const std::uint32_t nodes = hierarchy.nodeCount(), senders = surfels.count();
  // Count from the leaves up, place from the root down: children come after their parents.
  for (std::uint32_t n = nodes; n-- > 0;) {
    if (hierarchy.isLeaf(n)) {
      first_[n].count = hierarchy.sender(n) < senders ? 1 : kSkyDirections;
    } else {
      first_[n].count = first_[hierarchy.child[n]].count + first_[hierarchy.child[n] + 1].count;
    }
  }
  point_.resize(nodes > 0 ? first_[0].count : 0);
  for (std::uint32_t n = 0; n < nodes; ++n) {
    const std::uint32_t first = first_[n].first;
    if (!hierarchy.isLeaf(n)) {
      const std::uint32_t child = hierarchy.child[n];
      first_[child].first = first;
      first_[child + 1].first = first + first_[child].count;
      continue;
    }
    const std::uint32_t s = hierarchy.sender(n);
    if (s < senders) {
      point_[first].place = surfels.positionWorld[s];
      for (int k = 0; k < 3; ++k)
        point_[first].normal[static_cast<std::size_t>(k)] =
            static_cast<std::int8_t>(std::lrint(127.0f * surfels.normal[s][k]));
      continue;
    }
    const auto patches = static_cast<float>(hierarchy.skyDirection.size());
    for (std::uint32_t i = 0; i < kSkyDirections; ++i)
      point_[first + i] = {inCap(hierarchy.skyDirection[s - senders], 1.0f / patches, i), {}, true};
  }
}

std::size_t SenderPoints::bytes() const {
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return bytes(point_) + bytes(first_);
}

}  // namespace relume
