// SPDX-License-Identifier: MIT
// Places on the senders of links: for each node of the hierarchy a few of the surfels or sky directions below it, so
// that what stands between a cache and a node is found by rays to them, whatever a link stores.
#pragma once

#include "formats/pack.h"
#include "relume/hierarchy.h"
#include "relume/surfels.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::cpu {

class SenderPoints {
 public:
  struct Point {
    glm::vec3 place{0.0f};     // [m] of a surfel; of the sky a unit direction
    std::uint32_t normal = 0;  // packOctahedral(), or kSkyPoint
  };
  static constexpr std::uint32_t kSkyPoint = kNoDirection;
  static constexpr std::uint32_t kMost = 8;  // of a node

  // Around what a node sends from; infinite for nodes with sky.
  struct Sphere {
    glm::vec3 centre{0.0f};
    float radius = 0.0f;
  };

  // spheres: whether sphere() will be asked for. memory: keeps all of this.
  SenderPoints(const Hierarchy& hierarchy, const Surfels& surfels, bool spheres, std::pmr::memory_resource* memory);
  SenderPoints(const SenderPoints&) = delete;
  SenderPoints& operator=(const SenderPoints&) = delete;

  // How many points of a node there are, 1..kMost, and one of them.
  std::uint32_t count(std::uint32_t node) const {
    const std::uint32_t all = first_[node].count;
    return all < kMost ? all : kMost;
  }
  const Point& point(std::uint32_t node, std::uint32_t i) const {
    const Range& range = first_[node];
    const std::uint32_t n = count(node);
    return point_[range.first + static_cast<std::uint32_t>((2 * std::uint64_t{i} + 1) * range.count / (2 * n))];
  }
  const Sphere& sphere(std::uint32_t node) const { return sphere_[node]; }
  std::size_t bytes() const;

 private:
  struct Range {
    std::uint32_t first = 0, count = 0;  // in point_
  };
  void addSpheres(const Hierarchy& hierarchy);

  std::pmr::vector<Point> point_;    // those of a node's children one after the other
  std::pmr::vector<Range> first_;    // [Size nodes]
  std::pmr::vector<Sphere> sphere_;  // [Size nodes, or 0]
};

}  // namespace relume::cpu
