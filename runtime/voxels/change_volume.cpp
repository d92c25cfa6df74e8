// SPDX-License-Identifier: MIT
// Parts of a volume placed anew, and a volume moved: what of its layers is found again. See voxel_volume.h.
#include "runtime/voxels/voxel_volume.h"

#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"
#include "runtime/voxels/check_geometry.h"
#include "runtime/voxels/packed_mesh.h"

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>

namespace relume {
namespace {

constexpr std::uint32_t kSnapChunk = 8;  // runs

// Of no other volume, so that what is kept of one is not taken for another's.
std::uint64_t newVersion() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

Error changeError(const std::string& what) { return {ErrorCode::usage, "voxels: " + what}; }

}  // namespace

// The triangles of some parts that reach into a box, snapped, in the order of the parts; adds to the counts of `stats`.
template <class Wants>
Status VoxelVolume::snapParts(const VolumeGrid& grid, const std::vector<Part>& parts, const SnapBox& box,
                              const Wants& wants, std::vector<SnappedTriangle>& triangles, VoxelStats& stats) const {
  struct Piece {
    std::uint32_t part = 0, begin = 0, end = 0;
    std::vector<SnappedTriangle> snapped{};
    SnapCounts counts{};
    bool fits = true;
  };
  std::vector<Piece> pieces;
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (!parts[p].present || !wants(p)) continue;
    const auto count = static_cast<std::uint32_t>(geometry_->mesh[parts[p].part.mesh].run.size());
    for (std::uint32_t begin = 0; begin < count; begin += kSnapChunk)
      pieces.push_back({p, begin, std::min(begin + kSnapChunk, count)});
  }
  forChunks(parallelFor_, static_cast<std::uint32_t>(pieces.size()), 1, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t i = first; i < last; ++i) {
      Piece& piece = pieces[i];
      const VoxelPart& part = parts[piece.part].part;
      piece.fits = snapRuns(grid, box, geometry_->mesh[part.mesh], part.toWorld, piece.begin, piece.end, piece.snapped,
                            piece.counts);
    }
  });
  std::size_t total = 0;
  for (const Piece& piece : pieces) {
    total += piece.snapped.size();
    if (!piece.fits || total > kMaxSnapped)
      return changeError("part " + std::to_string(piece.part) + " makes more than " + std::to_string(kMaxSnapped) +
                         " triangles of at most 8 voxels; use fewer cells or a smaller box");
    stats.split += piece.counts.split;
    stats.outside += piece.counts.outside;
    stats.zeroArea += piece.counts.zeroArea;
  }
  triangles.reserve(total);
  for (Piece& piece : pieces) {
    triangles.insert(triangles.end(), piece.snapped.begin(), piece.snapped.end());
    piece.snapped = {};
  }
  stats.triangles += total;
  return done();
}

// Snap, voxelise and fill a layer from all parts that stand, or from all that move.
Status VoxelVolume::fill(const VolumeGrid& grid, bool moves, const std::vector<Part>& parts, VoxelLayer& layer,
                         VoxelStats& stats) const {
  std::vector<SnappedTriangle> triangles;
  stats = {};
  const auto wants = [&](std::uint32_t p) { return parts[p].part.moves == moves; };
  if (Status ok = snapParts(grid, parts, SnapBox::of(grid), wants, triangles, stats); !ok) return ok;
  voxelise(grid, triangles, parallelFor_, layer);
  if (moves && layer.occupied == 0) {
    layer = VoxelLayer();
    return done();
  }
  fillSides(grid, triangles, geometry_->surfaces, budget(), parallelFor_, layer);
  stats.occupied = layer.occupied;
  stats.dropped = layer.occupied - layer.kept;
  return done();
}

namespace {

// Around all voxels that are set, and a voxel more: triangles on the face of a voxel overlap both.
SnapBox boxAround(const VolumeGrid& grid, const std::vector<std::uint64_t>& bits) {
  glm::ivec3 low = grid.cells, high(-1);
  for (std::uint32_t c = 0; c < bits.size(); ++c) {
    if (bits[c] == 0) continue;
    low = glm::min(low, grid.cellAt(c));
    high = glm::max(high, grid.cellAt(c));
  }
  const SnapBox all = SnapBox::of(grid);
  constexpr int kCell = kBrickSide * kVoxelSteps;
  return {glm::max(kCell * low - kVoxelSteps, all.low), glm::min(kCell * (high + 1) + kVoxelSteps, all.high)};
}

}  // namespace

// The layer of what stands once some parts have been edited: as fill() has it, by the voxels alone in which those parts
// were or are. All is filled where they are most of it.
Status VoxelVolume::refill(const std::vector<Part>& parts, std::span<const PartEdit> edits, VoxelLayer& layer,
                           VoxelStats& stats) const {
  std::vector<std::uint8_t> isEdited(parts.size(), 0);
  for (const PartEdit& e : edits) isEdited[e.part] = 1;
  const SnapBox all = SnapBox::of(grid_);
  std::vector<SnappedTriangle> before, after, around;
  VoxelStats was, is, counted;
  const auto wants = [&](std::uint32_t p) { return isEdited[p] != 0; };
  if (Status ok = snapParts(grid_, parts_, all, wants, before, was); !ok) return ok;
  if (Status ok = snapParts(grid_, parts, all, wants, after, is); !ok) return ok;
  // Of a grid that has been moved they are as of when all of it was found last.
  stats = standingStats_;
  stats.triangles += is.triangles - std::min(was.triangles, stats.triangles);
  stats.split += is.split - was.split;
  stats.outside += is.outside - was.outside;
  stats.zeroArea += is.zeroArea - was.zeroArea;
  if (2 * std::max(before.size(), after.size()) > stats.triangles || stats.triangles > kMaxSnapped)
    return fill(grid_, false, parts, layer, stats);
  std::vector<std::uint64_t> dirty(grid_.cellCount(), 0);
  for (const std::vector<SnappedTriangle>* triangles : {&before, &after}) {
    addBits(grid_, *triangles, parallelFor_, dirty);
    const SubVoxels found = findSubVoxels(grid_, *triangles, parallelFor_);
    for (std::size_t c = 0; c < dirty.size(); ++c) dirty[c] |= found.bits[c];
  }
  const auto stands = [&](std::uint32_t p) { return !parts[p].part.moves; };
  if (Status ok = snapParts(grid_, parts, boxAround(grid_, dirty), stands, around, counted); !ok) return ok;
  layer = *standing_;
  if (!patchSides(grid_, dirty, around, geometry_->surfaces, budget(), parallelFor_, layer))
    return fill(grid_, false, parts, layer, stats);
  stats.occupied = layer.occupied;
  stats.dropped = 0;
  return done();
}

// Of two layers, whose sides are dark but for the first `kept`, which have the light that they had.
VoxelVolume::Joined VoxelVolume::join(const VoxelLayer& standing, const VoxelLayer& moving, std::size_t kept) const {
  Joined both;
  const std::size_t sides = standing.sideCount() + moving.sideCount(),
                    same = std::min({kept, joined_.direct.size(), sides});
  both.direct = joined_.direct.before(same);
  both.direct.growTo(sides);
  both.radiance.reserve(sides / 2);
  both.radiance.assign(joined_.radiance.begin(), joined_.radiance.begin() + static_cast<std::ptrdiff_t>(same / 2));
  both.radiance.resize(sides / 2);
  if (moving.occupied == 0) return both;
  const auto joinBits = [](const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b) {
    std::vector<std::uint64_t> all(a);
    for (std::size_t c = 0; c < all.size(); ++c) all[c] |= b[c];
    return all;
  };
  both.bits = joinBits(standing.bits, moving.bits);
  both.rayBits = joinBits(standing.subVoxels.bits, moving.subVoxels.bits);
  return both;
}

Status VoxelVolume::place(std::span<const glm::mat4x3> toWorld, std::vector<Part>& parts) const {
  std::size_t next = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (!parts[p].part.moves) continue;
    if (next < toWorld.size()) {
      if (Status ok = checkTransform(toWorld[next], p); !ok) return ok;
      parts[p].part.toWorld = toWorld[next];
    }
    ++next;
  }
  if (next != toWorld.size())
    return changeError("move() got " + std::to_string(toWorld.size()) + " transforms, expected one for each of " +
                       std::to_string(next) + " parts that move");
  return done();
}

Status VoxelVolume::place(std::span<const PartEdit> edits, std::vector<Part>& parts) const {
  for (const PartEdit& e : edits) {
    if (e.part >= parts.size())
      return changeError("edit() of part " + std::to_string(e.part) + " of " + std::to_string(parts.size()));
    if (parts[e.part].part.moves)
      return changeError("edit() of part " + std::to_string(e.part) + ", which moves: move() places it");
    if (Status ok = checkTransform(e.toWorld, e.part); !ok) return ok;
    parts[e.part].part.toWorld = e.toWorld;
    parts[e.part].present = e.present;
  }
  return done();
}

Result<VoxelVolume::Change> VoxelVolume::findPlaces(const PartPlaces& places) const {
  Stopwatch watch;
  try {
    Change change;
    std::vector<Part>& parts = change.parts.emplace(parts_);
    if (places.edits) {
      if (Status ok = place(*places.edits, parts); !ok) return ok.error();
    }
    if (places.toWorld) {
      if (Status ok = place(*places.toWorld, parts); !ok) return ok.error();
    }
    if (places.edits) {
      change.standing = std::make_shared<VoxelLayer>();
      Status ok = refill(parts, *places.edits, *change.standing, change.standingStats);
      if (!ok) return ok.error();
    }
    if (places.toWorld) {
      Status ok = fill(grid_, true, parts, change.moving.emplace(), change.movingStats);
      if (!ok) return ok.error();
    }
    change.joined = join(change.standing ? *change.standing : *standing_, change.moving ? *change.moving : moving_,
                         places.edits ? 0 : standingSides());
    change.ms_ = watch.lap();
    return change;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

// What stands, in a grid that has moved along one axis: found anew in the cells that it has uncovered alone.
Status VoxelVolume::fillMoved(const VolumeGrid& from, const VolumeGrid& to, VoxelLayer& layer,
                              VoxelStats& stats) const {
  if (layer.occupied > layer.kept) return fill(to, false, parts_, layer, stats);
  const glm::ivec3 by = to.shift - from.shift;
  VoxelLayer moved = moveLayer(layer, to, by);
  std::vector<std::uint64_t> uncovered(to.cellCount(), 0);
  for (std::uint32_t c = 0; c < uncovered.size(); ++c) {
    if (!to.holdsCell(to.cellAt(c) + by)) uncovered[c] = ~std::uint64_t{0};
  }
  std::vector<SnappedTriangle> around;
  VoxelStats counted;
  const auto stands = [&](std::uint32_t p) { return !parts_[p].part.moves; };
  if (Status ok = snapParts(to, parts_, boxAround(to, uncovered), stands, around, counted); !ok) return ok;
  if (!patchSides(to, uncovered, around, geometry_->surfaces, budget(), parallelFor_, moved))
    return fill(to, false, parts_, layer, stats);
  layer = std::move(moved);
  stats.occupied = layer.occupied;
  stats.dropped = 0;
  return done();
}

Result<VoxelVolume::Change> VoxelVolume::findShift(const glm::ivec3& shift) const {
  Stopwatch watch;
  try {
    Change change;
    change.grid = shifted(grid_, shift);
    change.standing = std::make_shared<VoxelLayer>();
    VoxelLayer &standing = *change.standing, &moving = change.moving.emplace();
    change.standingStats = standingStats_;
    const glm::ivec3 by = glm::abs(shift - grid_.shift);
    // Uncovered cells are most of it, or the rest is beyond the budget.
    const bool isAfar = glm::any(glm::greaterThan(2 * by, grid_.cells)) || !grid_.roams;
    if (isAfar) {
      if (Status ok = fill(*change.grid, false, parts_, standing, change.standingStats); !ok) return ok.error();
    } else {
      standing = *standing_;
      VolumeGrid from = grid_;
      for (int axis = 0; axis < 3; ++axis) {
        if (by[axis] == 0) continue;
        glm::ivec3 next = from.shift;
        next[axis] = shift[axis];
        const VolumeGrid to = shifted(from, next);
        if (Status ok = fillMoved(from, to, standing, change.standingStats); !ok) return ok.error();
        from = to;
      }
    }
    if (Status ok = fill(*change.grid, true, parts_, moving, change.movingStats); !ok) return ok.error();
    change.joined = join(standing, moving, 0);
    change.ms_ = watch.lap();
    return change;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

void VoxelVolume::take(Change change) noexcept {
  if (change.parts) parts_ = std::move(*change.parts);
  if (change.grid) grid_ = *change.grid;
  if (change.standing) {
    standing_ = std::move(change.standing);
    standingStats_ = change.standingStats;
    standingVersion_ = newVersion();
    voxeliseMs_ = change.ms_;
  }
  if (change.moving) {
    moving_ = std::move(*change.moving);
    movingStats_ = change.movingStats;
    movingVersion_ = newVersion();
    if (!change.standing) moveMs_ = change.ms_;
  }
  joined_ = std::move(change.joined);
}

std::uint32_t VoxelVolume::budget() const {
  constexpr std::size_t kLeast = 65536;
  return surfaceBudget_ > 0 ? surfaceBudget_ : static_cast<std::uint32_t>(std::max(64 * grid_.cellCount() / 4, kLeast));
}

Status VoxelVolume::fillAll() {
  Stopwatch watch;
  auto standing = std::make_shared<VoxelLayer>();
  if (Status ok = fill(grid_, false, parts_, *standing, standingStats_); !ok) return ok;
  if (Status ok = fill(grid_, true, parts_, moving_, movingStats_); !ok) return ok;
  standing_ = std::move(standing);
  standingVersion_ = newVersion();
  movingVersion_ = newVersion();
  joined_ = join(*standing_, moving_, 0);
  voxeliseMs_ = watch.lap();
  return done();
}

Status VoxelVolume::move(std::span<const glm::mat4x3> toWorld) {
  Result<Change> change = findPlaces({.edits = {}, .toWorld = toWorld});
  if (!change) return change.error();
  take(std::move(*change));
  return done();
}

Status VoxelVolume::edit(std::span<const PartEdit> edits) {
  Result<Change> change = findPlaces({.edits = edits, .toWorld = {}});
  if (!change) return change.error();
  take(std::move(*change));
  return done();
}

}  // namespace relume
