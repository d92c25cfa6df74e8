// SPDX-License-Identifier: MIT
// See pack_moving.h.
#include "runtime/passes/pack_moving.h"

#include "runtime/shared/sender_points.h"

#include <bit>

namespace relume::gpu {
namespace {

static_assert(RELUME_VIEW_SIDE == kViewSide && RELUME_VIEWS == kViews && RELUME_VIEW_PATCHES == kViewPatches &&
              RELUME_VIEW_WORDS == 2 + 2 * kViewPatches);

using Words = std::pmr::vector<std::uint32_t>;

void add(Words& words, float v) { words.push_back(std::bit_cast<std::uint32_t>(v)); }
void add(Words& words, const glm::vec3& v) {
  for (int k = 0; k < 3; ++k) add(words, v[k]);
}
void add(Words& words, const glm::ivec3& v) {
  for (int k = 0; k < 3; ++k) words.push_back(static_cast<std::uint32_t>(v[k]));
}

std::uint32_t sizeOf(const Words& words) { return static_cast<std::uint32_t>(words.size()); }

std::uint32_t pointBits(const SenderPoints::Point& point) {
  std::uint32_t bits = point.isSky ? 1u << 24 : 0;
  for (std::size_t k = 0; k < 3; ++k) bits |= std::uint32_t{static_cast<std::uint8_t>(point.normal[k])} << (8 * k);
  return bits;
}

void packShape(const MovingShape& shape, Words& words) {
  const std::uint32_t first = sizeOf(words);
  const auto bricks = static_cast<std::uint32_t>(2 * shape.bits.size());
  const auto boxes = static_cast<std::uint32_t>(shape.patchOf.size());
  add(words, shape.grid.cells);
  add(words, shape.boxes);
  words.push_back(first + RELUME_SHAPE_BITS + bricks);
  words.push_back(first + RELUME_SHAPE_BITS + bricks + boxes);
  words.push_back(static_cast<std::uint32_t>(shape.patch.size()));
  for (const std::uint64_t brick : shape.bits) {
    words.push_back(static_cast<std::uint32_t>(brick));
    words.push_back(static_cast<std::uint32_t>(brick >> 32));
  }
  words.insert(words.end(), shape.patchOf.begin(), shape.patchOf.end());
  for (const ShapePatch& patch : shape.patch) {
    for (const glm::vec3& each : {patch.position, patch.normal, patch.albedo, patch.emission}) add(words, each);
    add(words, patch.area);
  }
  for (const ShapeView& view : shape.view) {
    add(words, view.share);
    add(words, view.depth);
    words.insert(words.end(), view.patch.begin(), view.patch.end());
    for (const float weight : view.weight) add(words, weight);
  }
}

}  // namespace

SenderWords packSenderPoints(const Bake& bake, std::pmr::memory_resource* memory) {
  const SenderPoints senders(bake.hierarchy, bake.surfels, memory);
  SenderWords packed{Words(memory)};
  packed.word.reserve(2 * senders.ranges().size() + 4 * senders.points().size() + std::size_t{6} * bake.caches.count());
  for (const SenderPoints::Range& range : senders.ranges()) {
    packed.word.push_back(range.first);
    packed.word.push_back(range.count);
  }
  packed.points = sizeOf(packed.word);
  for (const SenderPoints::Point& point : senders.points()) {
    add(packed.word, point.place);
    packed.word.push_back(pointBits(point));
  }
  packed.places = sizeOf(packed.word);
  for (std::uint32_t cache = 0; cache < bake.caches.count(); ++cache) {
    add(packed.word, bake.caches.positionWorld[cache]);
    add(packed.word, bake.caches.normal[cache]);
  }
  return packed;
}

void packShapes(const MovingShapes& shapes, Words& words, Words& first) {
  words.clear();
  first.clear();
  for (std::uint32_t i = 0; i < shapes.count(); ++i) {
    first.push_back(sizeOf(words));
    packShape(shapes.shape(i), words);
  }
}

gl::RelumePart packPart(const MovingShape& shape, const ShapePlace& place, std::uint32_t firstWord,
                        std::uint32_t firstPatch) {
  gl::RelumePart part{};
  part.toGridX = place.toGrid[0];
  part.toGridY = place.toGrid[1];
  part.toGridZ = place.toGrid[2];
  part.shape = firstWord;
  part.firstPatch = firstPatch;
  part.centre = place.sphere.centre;
  part.radius = place.sphere.radius;
  part.origin = place.toWorld[3];
  part.ball = place.sphere.ball;
  part.viewShare = place.viewShare(shape);
  part.viewDepth = place.viewDepth(shape);
  part.voxel = shape.grid.voxel;
  part.gridOrigin = shape.grid.originWorld / shape.grid.voxel;
  part.toWorldX = place.toWorld[0];
  part.toWorldY = place.toWorld[1];
  part.toWorldZ = place.toWorld[2];
  return part;
}

}  // namespace relume::gpu
