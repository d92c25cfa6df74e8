// SPDX-License-Identifier: MIT
// Where a bake is tried: places that pictures of the level would show, and where the runtime reads their light.
#pragma once

#include "bake/caches/caches.h"
#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

// As arrays, all [Size count()].
struct TestReceivers {
  std::vector<glm::vec3> positionWorld;            // [m]
  std::vector<glm::vec3> normal, geometricNormal;  // unit, toward the viewer; normal: as it shades
  std::vector<std::uint32_t> at;        // light-map point (packUnorm16x2), or kGridReceiver; as Surfels::receiver
  std::vector<std::uint32_t> instance;  // index into Bake::instances
  // Its number among all that were asked for, ascending: what is drawn for a receiver, or among them, goes by numbers,
  // since those of the others stay when one is no longer found. Bakes do not keep it.
  std::vector<std::uint32_t> number;

  std::size_t count() const { return at.size(); }
};

// At most `count`, fewer where too little is seen. Seven of eight are pixels of the cameras that count as play space,
// all of them alike, if the level has any; the others are seen from where walks passed. As in docs/ACCURACY.md, pixels
// at edges, of emitters and of nearly black surfaces do not count. Incomplete when cancelled.
TestReceivers findTestReceivers(const RayTracer& tracer, const PlaySpace& space, const PlacedCaches& caches,
                                std::size_t count, std::uint64_t seed, Context& context);

}  // namespace relume
