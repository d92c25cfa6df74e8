// SPDX-License-Identifier: MIT
// Which surfel stands for a hit, in a level of which rays meet a part: a tile's surfel is looked for when the first hit
// lies on it. The answers are those of the whole map (surfel_map.h), had the play space seen all of every side.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/surfels/sorted_surfels.h"
#include "bake/surfels/surface_sampler.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <span>
#include <vector>

namespace relume {

// Thread-safe. Takes 8 bytes per side, and 4 for each tile of the sides that are hit.
class SurfelsOnDemand {
 public:
  // The scene must outlive it and stay as it is. surfels: that were placed; position, normal, point.instance and
  // emitter of them are read. spacing [m]: of their densest packing.
  SurfelsOnDemand(const Scene& scene, std::span<const SurfaceSample> surfels, float spacing, Context& context);

  // The surfels of hits; kNone where none is near, or nothing is hit. [Size surfel = hits]
  void at(std::span<const Hit> hits, std::span<std::uint32_t> surfel) const;
  // How many tiles have been looked for.
  std::size_t searches() const { return searches_; }

 private:
  struct Side;
  std::size_t indexOf(const Hit& hit) const {
    return 2 * (std::size_t{scene_.instances[hit.instance].firstTriangle} + hit.triangle) + (hit.back ? 1 : 0);
  }
  const Side& layOut(std::size_t index, const Hit& hit) const;
  std::uint32_t search(const Side& side, std::size_t index, std::uint32_t tile, const Hit& hit) const;

  const Scene& scene_;
  SortedSurfels surfels_;
  mutable std::vector<std::atomic<const Side*>> side_;  // null until hit
  mutable std::mutex growth_;                           // of memory_
  mutable std::pmr::monotonic_buffer_resource memory_;
  mutable std::atomic<std::size_t> searches_{0};
};

}  // namespace relume
