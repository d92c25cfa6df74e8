// SPDX-License-Identifier: MIT
// One round of sample elimination (eliminate.h): of the points it is given, removes again and again the most crowded
// one until a wanted number is left.
//
// Removals that are far apart commute, so the round goes in steps down the crowding: in each, the
// regions of space remove on their own what is above the step, regions of one colour of a 2x2x2 pattern at a time. Two
// of one colour are farther apart than any two neighbours, so the result does not depend on the threads. The last few
// points come off one by one.
#pragma once

#include "bake/surfels/neighbours.h"
#include "bake/surfels/surface_sampler.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class PointGrid;

class EliminationRound {
 public:
  // points: indices among the candidates. count: how many should stay. spacing [m]: of the densest packing of those.
  EliminationRound(std::span<const SurfaceSample> candidates, std::span<const std::uint32_t> points,
                   std::uint32_t count, float spacing, Context& context);

  // Remove until `count` are left. `removed` gets the others in their order, as indices among the candidates; what is
  // left is returned, ascending. Empty when cancelled.
  std::vector<std::uint32_t> run(std::vector<std::uint32_t>& removed, Context& context);

 private:
  // What the removal of a point reads and changes of its neighbours, in half a cache line.
  struct alignas(32) Point {
    glm::vec3 positionWorld{0.0f};
    float weight = 0.0f;  // crowding by its neighbours
    float reach = 0.0f;   // [m] D
    std::uint32_t cell = 0;
    std::uint32_t next = 0;  // in its bucket of the queue
    bool gone = false;
  };
  // A cell of space that should keep its share of the points.
  struct Cell {
    std::uint32_t left = 0;        // points that are not removed yet
    std::uint32_t quota = 0;       // points that should stay
    std::uint32_t nextUpdate = 0;  // when so many are left, the penalty is set anew
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
  // Eight cells, two along each axis.
  struct Region {
    std::uint32_t colour = 0;
    std::vector<std::uint32_t> left;  // points
    std::vector<Removal> removed;     // in this step
  };
  class Queue;

  void sortIntoCells(std::span<const SurfaceNode> node, std::uint32_t count, float cellSize);
  void findNeighbours(std::span<const SurfaceNode> node, const PointGrid& grid, Context& context);
  float excess(const Point& point) const { return point.weight + cells_[point.cell].penalty; }
  void remove(std::uint32_t point);
  float chooseStep(std::size_t max, Context& context) const;
  void reduceRegion(Region& region, float step);
  bool stepDown(float step, std::vector<std::uint32_t>& removed, Context& context);

  std::vector<std::uint32_t> source_;  // index of each point among the candidates
  std::vector<Point> points_;          // sorted by region, then cell
  std::vector<std::uint32_t> rank_;    // of each point of the grid's order: its index in points_
  std::vector<std::size_t> neighbourBegin_;
  std::vector<std::uint32_t> neighbour_;
  std::vector<Cell> cells_;
  std::vector<Region> regions_;
  std::uint32_t count_ = 0;
  std::size_t left_ = 0;
  float limit_ = 0.0f;  // distances below limit * D crowd no more than at it
};

}  // namespace relume
