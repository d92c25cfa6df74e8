// SPDX-License-Identifier: MIT
// What moves through a level as shaders read it (RELUME_SLOT_PARTS and those after it in shaders/shared/layout.h): the
// places on senders and of caches once, shapes when they change, parts every frame.
#pragma once

#include "relume/bake_data.h"
#include "relume/moving_shapes.h"
#include "runtime/moving/place_shape.h"
#include "shaders/shared/layout.h"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume::gpu {

// Words of RELUME_SLOT_SENDER_POINTS: first point and number of points of each node, from `points` on four words a
// point, from `places` on position and normal of each cache.
struct SenderWords {
  std::pmr::vector<std::uint32_t> word;
  std::uint32_t points = 0, places = 0;
};
SenderWords packSenderPoints(const Bake& bake, std::pmr::memory_resource* memory);

// Words of all shapes, one after the other. Throws std::bad_alloc, with `words` and `first` in any state.
// first: [Size shapes.count()] first word of each.
void packShapes(const MovingShapes& shapes, std::pmr::vector<std::uint32_t>& words,
                std::pmr::vector<std::uint32_t>& first);

gl::RelumePart packPart(const MovingShape& shape, const ShapePlace& place, std::uint32_t firstWord,
                        std::uint32_t firstPatch);

// Of a shape, at most.
inline constexpr std::uint32_t kMaxShapePatches = [] {
  constexpr std::uint32_t kSide = (kShapeBricks + kPatchBricks - 1) / kPatchBricks;
  return kPatchFacings * kSide * kSide * kSide;
}();

}  // namespace relume::gpu
