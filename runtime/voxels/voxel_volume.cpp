// SPDX-License-Identifier: MIT
// See voxel_volume.h.
#include "runtime/voxels/voxel_volume.h"

#include "formats/decimal.h"
#include "formats/limits.h"
#include "runtime/check_setup.h"
#include "runtime/direct_light.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"
#include "runtime/voxels/check_geometry.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory_resource>
#include <new>
#include <numbers>
#include <optional>

namespace relume {
namespace {

constexpr std::uint32_t kSnapChunk = 4096, kSides = 64;  // 4 x 64 places: as many as VisibilityBatch takes
constexpr float kLift = 0.05f;                           // [voxel] of places off their surface, which is rounded

// Of no other volume, so that what is kept of one is not taken for another's.
std::uint64_t newVersion() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

Error voxelsError(const std::string& what) { return {ErrorCode::usage, "voxels: " + what}; }
Error noMemoryForVoxels() { return {ErrorCode::memory, "voxels: memory ran out; fewer cells take less"}; }

glm::vec3 placed(const glm::mat4x3& toWorld, const glm::vec3& p) {
  return toWorld[0] * p.x + toWorld[1] * p.y + toWorld[2] * p.z + toWorld[3];
}

// The bounds of all parts where they stand; nothing without vertices.
struct Bounds {
  glm::vec3 min{0.0f}, max{0.0f};
  bool empty = true;
};

Bounds boundsOf(const VoxelGeometry& geometry) {
  Bounds bounds;
  for (const VoxelPart& part : geometry.parts) {
    for (const glm::vec3& p : geometry.meshes[part.mesh].position) {
      const glm::vec3 world = glm::clamp(placed(part.toWorld, p), -kMaxCoordinate, kMaxCoordinate);
      bounds.min = bounds.empty ? world : glm::min(bounds.min, world);
      bounds.max = bounds.empty ? world : glm::max(bounds.max, world);
      bounds.empty = false;
    }
  }
  return bounds;
}

Status checkOptions(const VoxelOptions& options) {
  if (options.cells < kMinCells || options.cells > kMaxCells)
    return voxelsError(std::to_string(options.cells) + " cells, expected " + std::to_string(kMinCells) + " to " +
                       std::to_string(kMaxCells));
  if (!isWithin(options.boxMin, kMaxCoordinate) || !isWithin(options.boxMax, kMaxCoordinate))
    return voxelsError("the box has a coordinate beyond " + decimal(kMaxCoordinate) + " m, or one that is not finite");
  for (int k = 0; k < 3; ++k) {
    if (options.boxMin[k] > options.boxMax[k])
      return voxelsError("the box begins at " + decimal(options.boxMin[k]) + " m and ends before that, at " +
                         decimal(options.boxMax[k]) + " m, along axis " + std::to_string(k));
  }
  return done();
}

}  // namespace

Result<VoxelVolume> VoxelVolume::create(const VoxelGeometry& geometry, const VoxelOptions& options) {
  if (Status ok = checkOptions(options); !ok) return ok.error();
  if (Status ok = checkGeometry(geometry); !ok) return ok.error();
  try {
    VoxelVolume volume;
    Bounds box{options.boxMin, options.boxMax, false};
    if (options.boxMin == options.boxMax) box = boundsOf(geometry);
    volume.grid_ = fitGrid(box.min, box.max, options.cells);
    volume.surfaces_.assign(geometry.surfaces.begin(), geometry.surfaces.end());
    std::vector<Mesh> meshes;
    for (const VoxelMesh& mesh : geometry.meshes) {
      meshes.push_back({{mesh.position.begin(), mesh.position.end()},
                        {mesh.triangle.begin(), mesh.triangle.end()},
                        {mesh.surface.begin(), mesh.surface.end()}});
    }
    volume.meshes_ = std::make_shared<const std::vector<Mesh>>(std::move(meshes));
    for (const VoxelPart& part : geometry.parts) volume.parts_.push_back({part, true});
    const std::size_t voxels = 64 * volume.grid_.cellCount();
    volume.budget_ = options.surfaceBudget > 0 ? options.surfaceBudget
                                               : static_cast<std::uint32_t>(std::max<std::size_t>(voxels / 4, 65536));
    volume.parallelFor_ = options.parallelFor;
    Stopwatch watch;
    for (const bool moves : {false, true}) {
      Status ok = volume.fill(moves, volume.parts_, moves ? volume.moving_ : volume.standing_,
                              moves ? volume.movingStats_ : volume.standingStats_);
      if (!ok) return ok.error();
    }
    volume.standingVersion_ = newVersion();
    volume.movingVersion_ = newVersion();
    volume.bits_.resize(volume.grid_.cellCount());
    volume.join(volume.sideLight(volume.standing_, volume.moving_, 0));
    volume.voxeliseMs_ = watch.lap();
    return volume;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

// The triangles of some parts that reach into a box, snapped, in the order of the parts; adds to the counts of `stats`.
template <class Wants>
Status VoxelVolume::snapParts(const std::vector<Part>& parts, const SnapBox& box, const Wants& wants,
                              std::vector<SnappedTriangle>& triangles, VoxelStats& stats) const {
  struct Piece {
    std::uint32_t part = 0, begin = 0, end = 0;
    std::vector<SnappedTriangle> snapped{};
    SnapCounts counts{};
    bool fits = true;
  };
  std::vector<Piece> pieces;
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (!parts[p].present || !wants(p)) continue;
    const auto count = static_cast<std::uint32_t>((*meshes_)[parts[p].part.mesh].triangle.size());
    for (std::uint32_t begin = 0; begin < count; begin += kSnapChunk)
      pieces.push_back({p, begin, std::min(begin + kSnapChunk, count)});
  }
  forChunks(parallelFor_, static_cast<std::uint32_t>(pieces.size()), 1, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t i = first; i < last; ++i) {
      Piece& piece = pieces[i];
      const Part& part = parts[piece.part];
      const Mesh& mesh = (*meshes_)[part.part.mesh];
      piece.fits = snapTriangles(grid_, box, {mesh.position, mesh.triangle, mesh.surface}, surfaces_, part.part.toWorld,
                                 piece.begin, piece.end, piece.snapped, piece.counts);
    }
  });
  std::size_t total = 0;
  for (const Piece& piece : pieces) {
    total += piece.snapped.size();
    if (!piece.fits || total > kMaxSnapped)
      return voxelsError("part " + std::to_string(piece.part) + " makes more than " + std::to_string(kMaxSnapped) +
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
Status VoxelVolume::fill(bool moves, const std::vector<Part>& parts, VoxelLayer& layer, VoxelStats& stats) const {
  std::vector<SnappedTriangle> triangles;
  stats = {};
  const auto wants = [&](std::uint32_t p) { return parts[p].part.moves == moves; };
  if (Status ok = snapParts(parts, SnapBox::of(grid_), wants, triangles, stats); !ok) return ok;
  voxelise(grid_, triangles, parallelFor_, layer);
  fillSides(grid_, triangles, surfaces_, budget_, parallelFor_, layer);
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
  if (Status ok = snapParts(parts_, all, wants, before, was); !ok) return ok;
  if (Status ok = snapParts(parts, all, wants, after, is); !ok) return ok;
  stats = standingStats_;
  stats.triangles += is.triangles - was.triangles;
  stats.split += is.split - was.split;
  stats.outside += is.outside - was.outside;
  stats.zeroArea += is.zeroArea - was.zeroArea;
  if (2 * std::max(before.size(), after.size()) > stats.triangles || stats.triangles > kMaxSnapped)
    return fill(false, parts, layer, stats);
  std::vector<std::uint64_t> dirty(grid_.cellCount(), 0);
  addBits(grid_, before, parallelFor_, dirty);
  addBits(grid_, after, parallelFor_, dirty);
  const auto stands = [&](std::uint32_t p) { return !parts[p].part.moves; };
  if (Status ok = snapParts(parts, boxAround(grid_, dirty), stands, around, counted); !ok) return ok;
  layer = standing_;
  if (!patchSides(grid_, dirty, around, surfaces_, budget_, parallelFor_, layer))
    return fill(false, parts, layer, stats);
  stats.occupied = layer.occupied;
  stats.dropped = 0;
  return done();
}

// What both layers make together. `light` has the light of the sides, which may be fewer than before.
void VoxelVolume::join(SideLight light) noexcept {
  direct_ = std::move(light.direct);
  radiance_ = std::move(light.radiance);
  for (std::size_t c = 0; c < bits_.size(); ++c) bits_[c] = standing_.bits[c] | moving_.bits[c];
}

// Dark sides for two layers, of which the first `kept` have the light that they had.
VoxelVolume::SideLight VoxelVolume::sideLight(const VoxelLayer& standing, const VoxelLayer& moving,
                                              std::size_t kept) const {
  SideLight light;
  const std::size_t sides = standing.side.size() + moving.side.size(), same = std::min({kept, direct_.size(), sides});
  light.direct.assign(direct_.begin(), direct_.begin() + static_cast<std::ptrdiff_t>(same));
  light.radiance.assign(radiance_.begin(), radiance_.begin() + static_cast<std::ptrdiff_t>(same / 2));
  light.direct.resize(sides, glm::vec3(0.0f));
  light.radiance.resize(sides / 2);
  for (std::size_t v = same / 2; v < sides / 2; ++v) {
    const glm::vec3& axis = v < standing.kept ? standing.axis[v] : moving.axis[v - standing.kept];
    for (int k = 0; k < 3; ++k)
      light.radiance[v].axis[static_cast<std::size_t>(k)] =
          static_cast<std::int8_t>(std::floor(127.0f * axis[k] + 0.5f));
  }
  return light;
}

// Parts that stand or move, where they are now: all that move, or of those that stand what has been edited.
Status VoxelVolume::place(bool moves, std::vector<Part> parts, std::span<const PartEdit> edits) {
  VoxelLayer layer;
  VoxelStats stats;
  if (Status ok = moves ? fill(true, parts, layer, stats) : refill(parts, edits, layer, stats); !ok) return ok;
  SideLight light = moves ? sideLight(standing_, layer, standingSides()) : sideLight(layer, moving_, 0);
  parts_ = std::move(parts);
  (moves ? moving_ : standing_) = std::move(layer);
  (moves ? movingStats_ : standingStats_) = stats;
  join(std::move(light));
  (moves ? movingVersion_ : standingVersion_) = newVersion();
  return done();
}

Status VoxelVolume::move(std::span<const glm::mat4x3> toWorld) {
  Stopwatch watch;
  try {
    std::vector<Part> parts = parts_;
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
      return voxelsError("move() got " + std::to_string(toWorld.size()) + " transforms, expected one for each of " +
                         std::to_string(next) + " parts that move");
    if (Status ok = place(true, std::move(parts), {}); !ok) return ok;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
  moveMs_ = watch.lap();
  return done();
}

Status VoxelVolume::edit(std::span<const PartEdit> edits) {
  for (const PartEdit& e : edits) {
    if (e.part >= parts_.size())
      return voxelsError("edit() of part " + std::to_string(e.part) + " of " + std::to_string(parts_.size()));
    if (parts_[e.part].part.moves)
      return voxelsError("edit() of part " + std::to_string(e.part) + ", which moves: move() places it");
    if (Status ok = checkTransform(e.toWorld, e.part); !ok) return ok;
  }
  Stopwatch watch;
  try {
    std::vector<Part> parts = parts_;
    for (const PartEdit& e : edits) {
      parts[e.part].part.toWorld = e.toWorld;
      parts[e.part].present = e.present;
    }
    if (Status ok = place(false, std::move(parts), edits); !ok) return ok;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
  voxeliseMs_ = watch.lap();
  return done();
}

namespace {

// Direct light of some sides, shadows by one call for many points or one for each.
class DirectLight {
 public:
  DirectLight(const VoxelVolume& volume, const LightSetup& setup, std::span<const Light> lights)
      : volume_(volume), setup_(setup), lights_(lights) {}

  void light(std::uint32_t begin, std::uint32_t end, std::span<glm::vec3> irradiance) const {
    const std::uint32_t count = end - begin;
    std::array<glm::vec3, kSides> sum{};
    std::array<glm::vec3, 4 * kSides> position, normal, arriving;
    std::array<std::uint32_t, 4 * kSides> slot;
    std::array<float, 4 * kSides> visible;
    for (std::uint32_t k = 0; k < lights_.size(); ++k) {
      std::uint32_t lit = 0;
      for (std::uint32_t i = 0; i < count; ++i) {
        const glm::vec3 middle = glm::vec3(volume_.voxelOfSide(begin + i)) + 0.5f;
        for (const SideSample& s : volume_.side(begin + i).sample) {
          if (s.count == 0) break;
          const glm::vec3 n = glm::normalize(glm::vec3(s.normal[0], s.normal[1], s.normal[2]));
          const glm::vec3 place(s.place[0], s.place[1], s.place[2]);
          const glm::vec3 at = volume_.grid().toWorld(middle + place / float{kVoxelSteps} + kLift * n);
          const glm::vec3 e = directIrradiance(lights_[k], at, n);
          if (e == glm::vec3(0.0f)) continue;
          position[lit] = at;
          normal[lit] = n;
          arriving[lit] = 0.25f * static_cast<float>(s.count) * e;
          slot[lit++] = i;
        }
      }
      if (lit == 0) continue;
      std::fill_n(visible.begin(), lit, setup_.visibilityBatch ? 0.0f : 1.0f);
      if (setup_.visibilityBatch) {
        setup_.visibilityBatch(k, {position.data(), lit}, {normal.data(), lit}, {visible.data(), lit});
      } else if (setup_.visibility) {
        for (std::uint32_t i = 0; i < lit; ++i) visible[i] = setup_.visibility(k, position[i], normal[i]);
      }
      // A number of the host's that is not finite would never leave the bounces.
      for (std::uint32_t i = 0; i < lit; ++i) {
        if (visible[i] > 0.0f) sum[slot[i]] += arriving[i] * std::min(visible[i], 1.0f);
      }
    }
    std::copy_n(sum.begin(), count, irradiance.begin() + begin);
  }

 private:
  const VoxelVolume& volume_;
  const LightSetup& setup_;
  std::span<const Light> lights_;
};

}  // namespace

Status VoxelVolume::lightDirectly(const LightSetup& setup) {
  LightSetup punctual;
  punctual.lights = setup.lights;
  if (Status ok = checkSetup(punctual, 0, 0); !ok) return ok;
  Stopwatch watch;
  try {
    std::pmr::vector<Light> lights;
    normaliseLights(setup.lights, lights);
    const DirectLight direct(*this, setup, lights);
    forChunks(parallelFor_, sideCount(), kSides,
              [&](std::uint32_t first, std::uint32_t last) { direct.light(first, last, direct_); });
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
  directMs_ = watch.lap();
  return done();
}

void VoxelVolume::reflect(std::span<const glm::vec3> bounced, const glm::vec3& emissionScale) {
  Stopwatch watch;
  forChunks(parallelFor_, sideCount() / 2, 32 * kSides, [&](std::uint32_t first, std::uint32_t last) {
    const auto radiance = [&](std::uint32_t i) {
      const VoxelSide& s = side(i);
      const glm::vec3 irradiance = bounced.empty() ? direct_[i] : direct_[i] + bounced[i];
      return std::numbers::inv_pi_v<float> * s.albedo * irradiance + emissionScale * s.emission;
    };
    for (std::uint32_t v = first; v < last; ++v) {
      radiance_[v].front = radiance(2 * v);
      radiance_[v].back = radiance(2 * v + 1);
    }
  });
  reflectMs_ = watch.lap();
}

MarchHit VoxelVolume::march(const glm::vec3& originWorld, const glm::vec3& direction, float maxT) const {
  MarchHit hit = VoxelMarch(grid_, bits_.data(), grid_.toGrid(originWorld), direction).first(maxT / grid_.voxel);
  hit.t *= grid_.voxel;
  return hit;
}

std::uint32_t VoxelVolume::sideAt(const glm::ivec3& voxel, const glm::vec3& direction) const {
  const bool moves = moving_.has(grid_, voxel);
  const VoxelLayer& layer = moves ? moving_ : standing_;
  const std::uint32_t number = layer.numberOf(grid_, voxel);
  if (number >= layer.kept) return kNoSide;
  const std::uint32_t at = moves ? standing_.kept + number : number;
  return 2 * at + (radiance_[at].isFront(direction) ? 0 : 1);
}

VoxelStats VoxelVolume::stats() const {
  VoxelStats sum = standingStats_;
  sum.occupied += movingStats_.occupied;
  sum.dropped += movingStats_.dropped;
  sum.triangles += movingStats_.triangles;
  sum.split += movingStats_.split;
  sum.outside += movingStats_.outside;
  sum.zeroArea += movingStats_.zeroArea;
  return sum;
}

std::vector<PassTime> VoxelVolume::passTimes() const {
  return {{"voxelise", voxeliseMs_}, {"move", moveMs_}, {"direct", directMs_}, {"reflect", reflectMs_}};
}

std::vector<std::pair<std::string, std::size_t>> VoxelVolume::bufferSizes() const {
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::size_t geometry = bytes(surfaces_) + bytes(parts_);
  for (const Mesh& mesh : *meshes_) geometry += bytes(mesh.position) + bytes(mesh.triangle) + bytes(mesh.surface);
  return {{"bricks",
           bytes(bits_) + bytes(standing_.bits) + bytes(standing_.first) + bytes(moving_.bits) + bytes(moving_.first)},
          {"voxel sides", bytes(standing_.axis) + bytes(standing_.side) + bytes(moving_.axis) + bytes(moving_.side)},
          {"voxel light", bytes(direct_) + bytes(radiance_)},
          {"voxel geometry", geometry}};
}

}  // namespace relume
