// SPDX-License-Identifier: MIT
// One round of sample elimination (eliminate.h): removes the most crowded of the given points again and again, until
// the wanted number is left.
//
// Removals far apart commute, so that regions of space can work in parallel. The round lowers a limit of crowding step
// by step. At each step, every region removes its points above the limit, the regions of one colour of a 2x2x2 pattern
// at a time. Two regions of one colour are farther apart than any two neighbours, so that the result does not depend on
// the threads. The last few points are removed one by one.
#pragma once

#include "bake/surfels/neighbours.h"
#include "bake/surfels/surface_sampler.h"
#include "relume/bake/context.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace relume {

class PointGrid;

class EliminationRound {
 public:
  // points: indices among the candidates. count: how many are to stay. spacing [m]: of the densest packing of so many.
  EliminationRound(std::span<const SurfaceSample> candidates, std::span<const std::uint32_t> points,
                   std::uint32_t count, float spacing, Context& context);

  // Remove points until `count` are left, and return those, ascending; empty when cancelled. `removed` gets the others
  // in the order of their removal. All are indices among the candidates.
  std::vector<std::uint32_t> run(std::vector<std::uint32_t>& removed, Context& context);

 private:
  // All that the removal of a point reads or changes in its neighbours, in half a cache line.
  struct alignas(32) Point {
    glm::vec3 positionWorld{0.0f};
    float weight = 0.0f;  // crowding by its neighbours
    float reach = 0.0f;   // [m] D
    std::uint32_t quota = 0;
    std::uint32_t next = 0;  // in its bucket of the queue
    bool gone = false;
  };
  // The points in a cube of space, which is to keep its share of all.
  struct Quota {
    std::uint32_t left = 0;        // points that are not removed yet
    std::uint32_t wanted = 0;      // points that should stay
    std::uint32_t nextUpdate = 0;  // the penalty is set anew when so many are left
    float penalty = 0.0f;          // added to the crowding of its points
    void update();
    void remove() {
      if (--left <= nextUpdate) update();
    }
  };
  struct Removal {
    float excess = 0.0f;
    std::uint32_t point = 0;
  };
  // Eight quotas' cubes, two along each axis.
  struct Region {
    std::vector<std::uint32_t> left;  // points
    std::vector<Removal> removed;     // in this step
  };
  class Queue;

  void sortByQuota(std::span<const SurfaceNode> node, float cubeSize, Context& context);
  void findNeighbours(std::span<const SurfaceNode> node, const PointGrid& grid, Context& context);
  float excess(const Point& point) const { return point.weight + quotas_[point.quota].penalty; }
  void remove(std::uint32_t point);
  float chooseStep(std::size_t max, Context& context) const;
  void reduceRegion(Region& region, float step);
  bool stepDown(float step, std::vector<std::uint32_t>& removed, Context& context);

  std::vector<std::uint32_t> source_;  // index of each point among the candidates
  std::vector<Point> points_;          // sorted by region, then quota
  std::vector<std::uint32_t> rank_;    // of each point of the grid's order: its index in points_
  std::vector<std::size_t> neighbourBegin_;
  std::unique_ptr<std::uint32_t[]> neighbour_;  // [Size neighbourBegin_.back()]
  std::vector<Quota> quotas_;
  std::vector<Region> regions_;
  std::array<std::vector<std::uint32_t>, 8> ofColour_;  // regions
  std::uint32_t count_ = 0;
  std::size_t left_ = 0;
  float limit_ = 0.0f;  // distances below limit_ * D crowd no more than limit_ * D itself
  double share_ = 1.0;  // of the points that stay
};

}  // namespace relume
