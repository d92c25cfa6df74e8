// SPDX-License-Identifier: MIT
// See cell_set.h.
#include "runtime/live/cell_set.h"

#include "formats/sphere_points.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stencil.h"

#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace relume {
namespace {

constexpr std::uint32_t kProbes = 24;        // rays that look for backs
constexpr std::uint32_t kCellsOfChunk = 16;  // of a chunk
constexpr float kHalfCell = 0.5f * static_cast<float>(kBrickSide);
// A cell has no voxel in its middle: along each axis, of the two beside it, the one in which a free cell's cache
// stands.
constexpr int kFreePlace = kBrickSide / 2 - 1;
constexpr float kReadBefore = 1.0f;  // [voxels] before a receiver it reads

// The voxels of a cell by their distance from its middle.
std::array<int, 64> byDistance() {
  std::array<int, 64> order{};
  std::iota(order.begin(), order.end(), 0);
  const auto distance = [](int bit) {
    const glm::vec3 d = glm::vec3(voxelOfBit(bit)) + 0.5f - kHalfCell;
    return glm::dot(d, d);
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return distance(a) < distance(b); });
  return order;
}

// How many of some rays meet the back of a surface.
std::uint32_t backsSeen(const VoxelVolume& volume, const glm::vec3& position) {
  const std::uint64_t* bits = volume.bits().data();
  const float far = 4.0f * static_cast<float>(kBrickSide);
  std::uint32_t backs = 0;
  for (std::uint32_t i = 0; i < kProbes; ++i) {
    const glm::vec3 direction = spherePoint(i, kProbes);
    const MarchHit hit = VoxelMarch(volume.grid(), bits, position, direction).first(far);
    if (!hit.found) continue;
    if (volume.meetsBack(hit.voxel, direction)) ++backs;
  }
  return backs;
}

// brickBit() of the voxel in whose middle the cache of a cell stands; nothing where none is free.
std::optional<std::uint8_t> placeCache(const VoxelVolume& volume, std::uint32_t cell,
                                       const std::array<int, 64>& order) {
  const std::uint64_t taken = volume.bits()[cell];
  if (taken == ~std::uint64_t{0}) return std::nullopt;
  const glm::vec3 corner(kBrickSide * volume.grid().cellAt(cell));
  // Candidates: one in each eighth of the cell, the nearest to the middle that is free.
  std::uint32_t fewest = kProbes + 1;
  std::uint32_t eighths = 0;
  std::uint8_t place = 0;
  for (const int bit : order) {
    if (taken >> bit & 1u) continue;
    const glm::ivec3 v = voxelOfBit(bit);
    const std::uint32_t eighth = static_cast<std::uint32_t>((v.x >> 1) | (v.y >> 1) << 1 | (v.z >> 1) << 2);
    if (eighths >> eighth & 1u) continue;
    eighths |= 1u << eighth;
    const std::uint32_t backs = backsSeen(volume, corner + glm::vec3(v) + 0.5f);
    if (backs >= fewest) continue;
    fewest = backs;
    place = static_cast<std::uint8_t>(bit);
    if (backs == 0) break;
  }
  return place;
}

// Of the planes of voxels, between what faces their two sides.
std::vector<std::int8_t> heightsOf(const VoxelLayer& layer, const VolumeGrid& grid) {
  std::vector<std::int8_t> height(layer.kept);
  forVoxels<CellSides>(layer, grid, 0, layer.kept,
                       [&](std::uint32_t i, const glm::ivec3& /*voxel*/, const std::array<VoxelSide, 2>& sides) {
                         const glm::vec3 axis = glm::vec3(layer.axis[i]) / 127.0f;
                         const auto along = [&](const VoxelSide& side) {
                           return glm::dot(side.place, axis) * static_cast<float>(kVoxelSteps);
                         };
                         height[i] = static_cast<std::int8_t>(
                             std::clamp(std::lrint(0.5f * (along(sides[0]) + along(sides[1]))), -127l, 127l));
                       });
  return height;
}

// Out of the sub-voxels of another surface, to the side of its plane on which the place is; three times at most.
glm::vec3 stepOut(const CellSet& cells, glm::vec3 place) {
  constexpr float kStep = 0.5f / static_cast<float>(kBrickSide);
  const VoxelLayer& standing = *cells.standing;
  for (int tries = 0; tries < 3; ++tries) {
    const glm::ivec3 v(glm::floor(place)), subVoxel(glm::floor(static_cast<float>(kBrickSide) * place));
    if (!cells.grid.holds(v) || (standing.subVoxels.in(cells.grid, v) >> brickBit(subVoxel) & 1u) == 0) return place;
    const std::array<std::int8_t, 4> plane = cells.planeAt(v);
    const glm::vec3 axis = glm::vec3(plane[0], plane[1], plane[2]) / 127.0f;
    const float above =
        glm::dot(place - (glm::vec3(v) + 0.5f), axis) - static_cast<float>(plane[3]) / static_cast<float>(kVoxelSteps);
    place += axis * (above < 0.0f ? -kStep : kStep);
  }
  return place;
}

// What a volume's layers are, cell by cell. before: null, or what was found of a volume whose cells it shares.
CellSet contentOf(const VoxelVolume& volume, const CellSet* before) {
  CellSet cells;
  const VolumeGrid& grid = cells.grid = volume.grid();
  cells.standingVersion = volume.standingVersion();
  cells.slot.assign(grid.cellCount(), kInactive);
  cells.standing = volume.sharedStanding();
  if (before != nullptr && before->standingVersion == cells.standingVersion) {
    cells.height = before->height;
    cells.standingContent = before->standingContent;
  } else {
    cells.height = heightsOf(volume.standing(), grid);
    cells.standingContent.assign(grid.cellCount(), 0);
    addContent(volume.standing(), volume.parallelFor(), cells.standingContent);
  }
  cells.content = cells.standingContent;
  if (volume.hasMoving()) addContent(volume.moving(), volume.parallelFor(), cells.content);
  return cells;
}

// Caches and where they stand, but for those that stand where `before` has them.
void placeCaches(const VoxelVolume& volume, const CellSet* before, const CellChanges& changes, CellSet& cells) {
  const VolumeGrid& grid = cells.grid;
  const std::span<const std::uint64_t> bits = volume.bits();

  // 1. Dilate what is occupied
  std::vector<std::uint8_t> isActive(grid.cellCount(), 0);
  for (std::uint32_t c = 0; c < bits.size(); ++c) {
    if (bits[c] == 0) continue;
    const glm::ivec3 at = grid.cellAt(c);
    const glm::ivec3 low = glm::max(at - 1, glm::ivec3(0)), high = glm::min(at + 1, grid.cells - 1);
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) isActive[grid.cellIndex({x, y, z})] = 1;
      }
    }
  }
  std::vector<std::uint32_t> wanted;
  for (std::uint32_t c = 0; c < isActive.size(); ++c) {
    if (isActive[c] != 0) wanted.push_back(c);
  }

  // 2. Where their caches stand
  const std::array<int, 64> order = byDistance();
  std::vector<std::optional<std::uint8_t>> place(wanted.size());
  forChunks(volume.parallelFor(), static_cast<std::uint32_t>(wanted.size()), kCellsOfChunk,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t i = begin; i < end; ++i) {
                const glm::ivec3 cell = grid.cellAt(wanted[i]);
                if (before == nullptr || !changes.seesTheSame(grid, cell, kPlaceReach)) {
                  place[i] = placeCache(volume, wanted[i], order);
                  continue;
                }
                const std::uint32_t slot = before->slot[grid.cellIndex(cell + changes.by)];
                if (slot != kInactive) place[i] = before->place[slot];
              }
            });
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!place[i]) continue;
    cells.slot[wanted[i]] = static_cast<std::uint32_t>(cells.active.size());
    cells.active.push_back(wanted[i]);
    cells.place.push_back(*place[i]);
  }
}

}  // namespace

CellSet findCells(const VoxelVolume& volume) {
  CellSet cells = contentOf(volume, nullptr);
  placeCaches(volume, nullptr, {}, cells);
  return cells;
}

ChangedCells findChangedCells(const VoxelVolume& volume, const CellSet& before) {
  if (!before.grid.sharesCells(volume.grid()) || before.content.empty()) {
    ChangedCells found{findCells(volume), {}};
    found.changes.distance.assign(volume.grid().cellCount(), 0);
    return found;
  }
  ChangedCells found{contentOf(volume, &before), {}};
  found.changes = changesSince(before.grid, before.content, found.cells.grid, found.cells.content);
  placeCaches(volume, &before, found.changes, found.cells);
  return found;
}

namespace {

std::uint32_t slotAt(const CellSet& cells, const glm::ivec3& cell) {
  return cells.grid.holdsCell(cell) ? cells.slot[cells.grid.cellIndex(cell)] : kInactive;
}

}  // namespace

std::uint32_t slotBefore(const CellSet& before, const CellSet& cells, const glm::ivec3& cell) {
  if (!before.grid.sharesCells(cells.grid) || before.slot.empty()) return kInactive;
  return slotAt(before, cell + cells.grid.shift - before.grid.shift);
}

std::uint32_t slotAround(const CellSet& around, const CellSet& cells, const glm::ivec3& cell) {
  return slotAt(around, ((cell + cells.grid.shift) >> 1) - around.grid.shift);
}

namespace {

// Where a receiver reads: the cell of the first of eight caches, these, and its place between them.
struct ReadPlace {
  glm::ivec3 first{0};
  std::array<std::uint32_t, 8> slot{};  // kInactive: there is none
  glm::vec3 share{0.0f};

  glm::vec3 positionOf(const CellSet& cells, std::uint32_t k) const {
    return glm::vec3(cells.voxelIn(first + glm::ivec3(cornerOffset(k)), slot[k])) + 0.5f;
  }
};

// Puts a place between eight caches, whose trilinear map takes the share to it: the inverse of an isoparametric
// hexahedron, by fixed-point iteration. Outside of 0..1 where it is not between them. [at: cells from where the first
// would stand in a free cell]
ReadPlace placeBetween(const CellSet& cells, const glm::ivec3& first, const glm::vec3& at) {
  ReadPlace place{first, {}, at};
  std::array<glm::vec3, 8> aside{};  // of where a free cell's cache stands [cells]
  bool isAny = false;
  for (std::uint32_t k = 0; k < 8; ++k) {
    const std::uint32_t slot = place.slot[k] = slotAt(cells, first + glm::ivec3(cornerOffset(k)));
    if (slot == kInactive) continue;
    aside[k] = glm::vec3(voxelOfBit(cells.place[slot]) - kFreePlace) / static_cast<float>(kBrickSide);
    isAny = isAny || aside[k] != glm::vec3(0.0f);
  }
  for (int i = 0; i < 3 && isAny; ++i) {
    const std::array<float, 8> weight = trilinear(glm::clamp(place.share, 0.0f, 1.0f));
    place.share = at;
    for (std::size_t k = 0; k < 8; ++k) place.share -= weight[k] * aside[k];
  }
  return place;
}

// Nothing where it is out of the grid. Counted from the receiver's own cell, so that rounding is the same in all grids
// that have it.
std::optional<ReadPlace> readPlaceOf(const CellSet& cells, const glm::vec3& position, const glm::vec3& normal) {
  const glm::vec3 cell = glm::floor(position / static_cast<float>(kBrickSide));
  const glm::vec3 read = position - static_cast<float>(kBrickSide) * cell + kReadBefore * normal;
  glm::vec3 at = (read - (static_cast<float>(kFreePlace) + 0.5f)) / static_cast<float>(kBrickSide);
  const glm::vec3 base = glm::floor(at), corner = cell + base;
  const auto holds = [&](const glm::vec3& first) {
    return glm::all(glm::greaterThan(first, glm::vec3(-2.0f))) &&
           glm::all(glm::lessThan(first, glm::vec3(cells.grid.cells)));
  };
  if (!holds(corner)) return std::nullopt;
  at -= base;
  ReadPlace place = placeBetween(cells, glm::ivec3(corner), at);
  // Their hexahedron is not where their cells are: the place may lie in the one beside it.
  const glm::vec3 beside = glm::vec3(glm::greaterThan(place.share, glm::vec3(1.0f))) -
                           glm::vec3(glm::lessThan(place.share, glm::vec3(0.0f)));
  if (beside != glm::vec3(0.0f) && holds(corner + beside))
    place = placeBetween(cells, place.first + glm::ivec3(beside), at - beside);
  place.share = glm::clamp(place.share, 0.0f, 1.0f);
  return place;
}

}  // namespace

SeenCaches seenCaches(const CellSet& cells, const glm::vec3& position, const glm::vec3& normal) {
  const std::optional<ReadPlace> place = readPlaceOf(cells, position, normal);
  if (!place) return 0;
  // Out of the sub-voxels that the receiver's own surface overlaps, which reach half as far from its plane: it may be
  // bent.
  const glm::vec3 size = glm::abs(normal);
  const float lift = 0.25f * (std::max({size.x, size.y, size.z}) + size.x + size.y + size.z) + 0.025f;
  const SubVoxels& subVoxels = cells.standing->subVoxels;
  const auto subVoxelsOf = [&](const glm::ivec3& v) { return subVoxels.in(cells.grid, v); };
  const glm::vec3 eye = stepOut(cells, position + lift * normal);
  std::uint32_t seen = 0;
  for (std::uint32_t k = 0; k < 8; ++k) {
    if (place->slot[k] == kInactive) continue;
    const glm::vec3 cache = place->positionOf(cells, k);
    if (glm::dot(cache - position, normal) <= 0.0f) continue;
    const glm::vec3 toward = cache - eye;
    const bool hidden = glm::length(toward) > 1e-3f &&
                        VoxelMarch(cells.grid, subVoxels.bits.data(), eye, toward).first(1.0f, subVoxelsOf).found;
    if (!hidden) seen |= 1u << k;
  }
  return static_cast<SeenCaches>(seen);
}

CellStencil stencilOf(const CellSet& cells, const glm::vec3& position, const glm::vec3& normal, SeenCaches seen) {
  CellStencil stencil;
  const std::optional<ReadPlace> place = readPlaceOf(cells, position, normal);
  if (!place) return stencil;
  float sum = 0.0f;
  const std::array<float, 8> weight = trilinear(place->share);
  const auto read = [&](std::uint32_t k, float scale) {
    stencil.slot[k] = place->slot[k];
    sum += stencil.weight[k] = scale * std::max(weight[k], 1e-4f);
  };
  for (std::uint32_t k = 0; k < 8; ++k) {
    if ((seen >> k & 1u) != 0 && place->slot[k] != kInactive) read(k, 1.0f);
  }
  if (!(sum > 1e-3f)) {
    stencil = {};
    sum = 0.0f;
    for (std::uint32_t k = 0; k < 8; ++k) {
      if (place->slot[k] == kInactive) continue;
      read(k, glm::dot(place->positionOf(cells, k) - position, normal) > 0.0f ? 1.0f : 1e-3f);
    }
  }
  for (float& share : stencil.weight) share = sum > 0.0f ? share / sum : 0.0f;
  return stencil;
}

CellStencil stencilAt(const CellSet& cells, const glm::vec3& position, const glm::vec3& normal) {
  return stencilOf(cells, position, normal, seenCaches(cells, position, normal));
}

}  // namespace relume
