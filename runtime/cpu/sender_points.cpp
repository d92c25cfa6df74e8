// SPDX-License-Identifier: MIT
// See sender_points.h.
#include "runtime/cpu/sender_points.h"

#include "formats/pack.h"
#include "formats/sphere_points.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume::cpu {
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

SenderPoints::SenderPoints(const Hierarchy& hierarchy, const Surfels& surfels, bool spheres,
                           std::pmr::memory_resource* memory)
    : point_(memory), first_(hierarchy.nodeCount(), Range{}, memory), sphere_(memory) {
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
      point_[first] = {surfels.positionWorld[s], packOctahedral(surfels.normal[s])};
      continue;
    }
    const auto patches = static_cast<float>(hierarchy.skyDirection.size());
    for (std::uint32_t i = 0; i < kSkyDirections; ++i)
      point_[first + i] = {inCap(hierarchy.skyDirection[s - senders], 1.0f / patches, i), kSkyPoint};
  }
  if (spheres) addSpheres(hierarchy);
}

void SenderPoints::addSpheres(const Hierarchy& hierarchy) {
  constexpr float kEverywhere = std::numeric_limits<float>::infinity();
  sphere_.resize(first_.size());
  for (std::uint32_t n = hierarchy.nodeCount(); n-- > 0;) {
    Sphere& sphere = sphere_[n];
    if (hierarchy.isLeaf(n)) {
      const Point& p = point_[first_[n].first];
      sphere = {p.place, p.normal == kSkyPoint ? kEverywhere : 0.0f};
      continue;
    }
    // Around two spheres, of which one may hold the other.
    const Sphere &a = sphere_[hierarchy.child[n]], &b = sphere_[hierarchy.child[n] + 1];
    const float between = glm::distance(a.centre, b.centre);
    if (a.radius >= between + b.radius || b.radius == kEverywhere) {
      sphere = b.radius == kEverywhere ? b : a;
    } else if (b.radius >= between + a.radius) {
      sphere = b;
    } else {
      sphere.radius = 0.5f * (a.radius + b.radius + between);
      sphere.centre = a.centre + (sphere.radius - a.radius) / between * (b.centre - a.centre);
    }
  }
}

std::size_t SenderPoints::bytes() const {
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return bytes(point_) + bytes(first_) + bytes(sphere_);
}

}  // namespace relume::cpu
