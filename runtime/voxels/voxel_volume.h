// SPDX-License-Identifier: MIT
// A voxel volume of a level: bits of what stands and of what moves, and for each occupied voxel two lit sides. Caches
// that need no bake gather their light from it (runtime/live/live_caches.h), after CRC (Vardis et al. 2014) Section 5.
//
//   create()  voxelise what stands and what moves
//   move()    a frame: moving parts alone, voxelised where they are now
//   edit()    the editor: standing parts placed elsewhere, taken away or put back; voxels that they neither were nor
//             are in stay as they are
//   findShift() the same volume elsewhere, in whole cells (nested_volumes.h): voxels of cells that it has and had stay
//   lightDirectly()  direct light of punctual lights on each side
//   reflect() radiance of each side from direct light, light of the caches, and emission
//
// Threads: as a Relighter's (relume/relighter.h), with the CPU backend. A call that is refused changes nothing.
#pragma once

#include "relume/lights.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "relume/voxel_geometry.h"
#include "runtime/voxels/march.h"
#include "runtime/voxels/packed_light.h"
#include "runtime/voxels/sparse_light.h"
#include "runtime/voxels/voxel_grid.h"
#include "runtime/voxels/voxel_layer.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

struct PackedGeometry;

inline constexpr std::uint32_t kNoSide = 0xFFFFFFFFu;

struct VoxelOptions {
  glm::vec3 boxMin{0.0f}, boxMax{0.0f};  // [m] where light is wanted; equal = the bounds of the parts' triangles
  float margin = 0.5f;                   // [voxel] [>= 0.5] free around that: fitGrid()
  std::uint32_t cells = 32;              // [8..64] on the longest side; four times as many voxels (CRC: 32)
  std::uint32_t surfaceBudget =
      0;  // [voxels] that keep their sides, of each layer; 0 = a quarter of the volume, 65536 at least
  ParallelFor parallelFor{};  // empty = one thread
  bool roams = false;         // it will be moved, or is a part of the level: VolumeGrid::roams
};

// Where parts are by now: those that stand (edit()) and all that move (move()), of which either may stay as it is.
struct PartPlaces {
  std::optional<std::span<const PartEdit>> edits;
  std::optional<std::span<const glm::mat4x3>> toWorld;
};

// What an occupied voxel sends out; rays see the front against its axis.
class VoxelRadiance {
 public:
  glm::vec3 front() const { return front_.value(); }  // [W/m²/sr]
  glm::vec3 back() const { return back_.value(); }
  // Of the volume's side of that number.
  glm::vec3 of(std::uint32_t side) const { return side % 2 == 0 ? front() : back(); }
  void set(std::uint32_t side, const glm::vec3& radiance) { (side % 2 == 0 ? front_ : back_) = PackedLight(radiance); }
  bool operator==(const VoxelRadiance&) const = default;

 private:
  PackedLight front_, back_;
};
static_assert(sizeof(VoxelRadiance) == 12);

// A side where it is.
struct SideAt {
  std::uint32_t index = 0;  // of the volume's sides
  glm::ivec3 voxel{0};
  VoxelSide side;

  glm::vec3 place() const { return glm::vec3(voxel) + 0.5f + side.place; }  // [voxels]
};

class VoxelVolume {
 public:
  // usage: checkGeometry(), cells out of range, a box that is not finite or inside out, more than 2^25 triangles after
  // splitting (fewer cells, or a smaller box, make fewer); memory: it ran out.
  static Result<VoxelVolume> create(const VoxelGeometry& geometry, const VoxelOptions& options);

  // A volume of the same parts, with those options, over another grid. Errors: as create(). [grid: 1 to kMaxCells
  // cells]
  Result<VoxelVolume> over(const VolumeGrid& grid) const;

  // [Size moving parts, in their order] usage: another number of transforms, one that is not finite; memory.
  [[nodiscard]] Status move(std::span<const glm::mat4x3> toWorld);
  // usage: no such part, one that moves, a transform that is not finite; memory.
  [[nodiscard]] Status edit(std::span<const PartEdit> edits);

  // What a call would make of the volume, for several of which all change or none.
  class Change;
  Result<Change> findPlaces(const PartPlaces& places) const;
  // The grid begins so many cells from where it stood first (voxel_grid.h). Its bits and sides are those of a volume
  // created there. Errors: as create().
  Result<Change> findShift(const glm::ivec3& shift) const;
  void take(Change change) noexcept;

  // Irradiance of each side by the setup's lights, with its visibility. usage: as Relighter::check().
  [[nodiscard]] Status lightDirectly(const LightSetup& setup);
  // Radiance of each side: albedo (direct + bounced) / pi + emission. bounced: of a side [W/m²], which threads call
  // side by side; null = nothing is bounced. emissionScale: factor on emission. Throws what `bounced` does.
  using SideIrradiance = std::function<glm::vec3(const SideAt& side)>;
  void reflect(const SideIrradiance& bounced, const glm::vec3& emissionScale);

  // What a side sends out, in place of what reflect() found, as PackedLight holds it. [side < sideCount(), W/m²/sr,
  // finite] Throws nothing; each side by one thread.
  void setRadiance(std::uint32_t side, const glm::vec3& radiance) { joined_.radiance[side / 2].set(side, radiance); }
  glm::vec3 radianceOf(std::uint32_t side) const { return joined_.radiance[side / 2].of(side); }

  const VolumeGrid& grid() const { return grid_; }
  // As NestedVolumes has it; all of a volume alone.
  const VolumeReach& reach() const { return reach_; }
  void setReach(const VolumeReach& reach) { reach_ = reach; }
  // Bits of what stands and of what moves. [Size cells]
  std::span<const std::uint64_t> bits() const { return hasMoving() ? joined_.bits : standing_->bits; }
  // The same of voxels that have sub-voxels, which is where rays may end. [Size cells]
  std::span<const std::uint64_t> rayBits() const { return hasMoving() ? joined_.rayBits : standing_->subVoxels.bits; }
  const VoxelLayer& standing() const { return *standing_; }
  // The same, for who keeps it beyond the volume's next change: layers do not change, but give way to others.
  const std::shared_ptr<const VoxelLayer>& sharedStanding() const { return standing_; }
  // Whether a voxel of what moves is occupied; if none is, moving() has no cells either.
  bool hasMoving() const { return moving_.occupied > 0; }
  const VoxelLayer& moving() const { return moving_; }
  // Sides of standing voxels, then those of moving ones.
  std::uint32_t sideCount() const { return standing_->sideCount() + moving_.sideCount(); }
  std::uint32_t standingSides() const { return standing_->sideCount(); }
  // visit(SideAt) of sides [begin, end), which takes less than one by one.
  template <class Visit>
  void forSides(std::uint32_t begin, std::uint32_t end, const Visit& visit) const {
    forLayers<CellSides>(begin, end, [&](std::uint32_t s, const glm::ivec3& voxel, const VoxelSide& side) {
      visit(SideAt{s, voxel, side});
    });
  }
  // visit(number, voxel, SideSurface) of each.
  template <class Visit>
  void forSurfaces(std::uint32_t begin, std::uint32_t end, const Visit& visit) const {
    forLayers<CellSurfaces>(begin, end, visit);
  }
  SideAt sideOf(std::uint32_t index) const;
  VoxelSide side(std::uint32_t index) const { return sideOf(index).side; }
  glm::ivec3 voxelOfSide(std::uint32_t index) const { return sideOf(index).voxel; }
  // Where light reaches it: in the grid, and in the world.
  glm::vec3 placeOfSide(std::uint32_t index) const { return sideOf(index).place(); }                    // [voxels]
  glm::vec3 positionOfSide(std::uint32_t index) const { return positionOf(sideOf(index)); }             // [m]
  glm::vec3 positionOf(const SideAt& at) const { return grid_.placeInVoxel(at.voxel, at.side.place); }  // [m]
  std::vector<float> areas() const;                      // of all sides [m²]; 0 where no triangle faces it
  glm::vec3 emissionOfSide(std::uint32_t index) const {  // [W/m²/sr]
    return index < standingSides() ? standing_->emissionOf(index) : moving_.emissionOf(index - standingSides());
  }
  glm::vec3 directOf(std::uint32_t side) const { return joined_.direct[side]; }  // [W/m²]

  // The first voxel along a ray, t in metres; direction is unit and the origin finite. [maxT > 0, m]
  MarchHit march(const glm::vec3& originWorld, const glm::vec3& direction, float maxT) const;
  // [Size sideCount() / 2] of standing voxels, then of moving ones.
  std::span<const VoxelRadiance> radiance() const { return joined_.radiance; }
  // Of one of them: toward its front, 127 times the unit vector.
  const glm::i8vec3& axisOf(std::uint32_t voxel) const {
    return voxel < standing_->kept ? standing_->axis[voxel] : moving_.axis[voxel - standing_->kept];
  }
  // The side of an occupied voxel that a ray of this direction meets; where both layers have the voxel, of what moves.
  // kNoSide for voxels that were dropped.
  std::uint32_t sideAt(const glm::ivec3& voxel, const glm::vec3& direction) const;

  // Both sides of an occupied voxel that has sides, of what moves as above.
  std::array<SideAt, 2> sidesAt(const glm::ivec3& voxel) const;
  // Whether what a ray of this direction meets of an occupied voxel emits; of what moves as above.
  bool emitsAt(const glm::ivec3& voxel, const glm::vec3& direction) const {
    if (!emits_) return false;
    const VoxelLayer& layer = movesIn(voxel) ? moving_ : *standing_;
    return layer.emitsToward(layer.numberOf(grid_, voxel), direction);
  }
  // Whether what it meets is the back of surfaces.
  bool meetsBack(const glm::ivec3& voxel, const glm::vec3& direction) const;

  // Of voxels anywhere.
  bool isOccupied(const glm::ivec3& voxel) const {
    return grid_.holds(voxel) && (bits()[grid_.cellOf(voxel)] >> brickBit(voxel) & 1u) != 0;
  }
  // brickBit() of the sub-voxels of any voxel of the grid.
  std::uint64_t subVoxelsIn(const glm::ivec3& voxel) const {
    const std::uint64_t standing = standing_->subVoxels.in(grid_, voxel);
    return hasMoving() ? standing | moving_.subVoxels.in(grid_, voxel) : standing;
  }

  // Radiance [W/m²/sr] of the side that a ray of this direction meets, as reflect() left it; black where dropped: of an
  // occupied voxel; and of what a ray met that ends in sub-voxels, black where it came in past all that emits there.
  glm::vec3 radianceAt(const glm::ivec3& voxel, const glm::vec3& direction) const {
    const bool moves = movesIn(voxel);
    return radianceOf(moves, (moves ? moving_ : *standing_).numberOf(grid_, voxel), direction);
  }
  glm::vec3 radianceAt(const MarchHit& hit, const glm::vec3& direction) const {
    const bool moves = hasMoving() && (moving_.subVoxels.in(grid_, hit.voxel) >> hit.subVoxel & 1u) != 0;
    const VoxelLayer& layer = moves ? moving_ : *standing_;
    const std::uint32_t number = layer.numberBehind(grid_, hit.voxel, hit.subVoxel);
    if (emits_ && hit.across >= 0 && layer.isDark(number, hit.across, direction)) return glm::vec3(0.0f);
    return radianceOf(moves, number, direction);
  }

  // Change with every create() and edit(), and with every move(), to what no other volume of the process has or had but
  // for copies.
  std::uint64_t standingVersion() const { return standingVersion_; }
  std::uint64_t movingVersion() const { return movingVersion_; }
  VoxelStats stats() const;
  // Of the last call of each pass.
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
  const ParallelFor& parallelFor() const { return parallelFor_; }
  // From now on, in place of VoxelOptions::parallelFor: for a copy that goes to another thread.
  void useParallelFor(ParallelFor parallelFor) { parallelFor_ = std::move(parallelFor); }

 private:
  struct Part {
    VoxelPart part;
    bool present = true;
  };

  // What both layers make together.
  struct Joined {
    SparseLight direct;                            // of sides, standing ones, then moving ones
    std::vector<VoxelRadiance> radiance;           // of voxels that are kept, in the same order
    std::vector<std::uint64_t> bits{}, rayBits{};  // [Size cells; 0 where nothing moves]
  };

  VoxelVolume() = default;
  // Whether something that moves is in this voxel of the grid.
  bool movesIn(const glm::ivec3& voxel) const { return hasMoving() && moving_.has(grid_, voxel); }
  // Of a layer's voxel.
  glm::vec3 radianceOf(bool moves, std::uint32_t number, const glm::vec3& direction) const {
    const VoxelLayer& layer = moves ? moving_ : *standing_;
    if (number >= layer.kept) return glm::vec3(0.0f);
    return joined_.radiance[moves ? standing_->kept + number : number].of(isFront(layer.axis[number], direction) ? 0
                                                                                                                 : 1);
  }
  template <class Read, class Visit>
  void forLayers(std::uint32_t begin, std::uint32_t end, const Visit& visit) const {
    std::uint32_t first = 0;  // of the layer's voxels
    for (const VoxelLayer* layer : {standing_.get(), &moving_}) {
      const std::uint32_t low = std::max(begin, 2 * first), high = std::min(end, 2 * (first + layer->kept));
      if (low < high) {
        forVoxels<Read>(*layer, grid_, low / 2 - first, (high + 1) / 2 - first,
                        [&](std::uint32_t number, const glm::ivec3& voxel, const auto& both) {
                          const std::uint32_t front = 2 * (first + number);
                          if (front >= low) visit(front, voxel, both[0]);
                          if (front + 1 < high) visit(front + 1, voxel, both[1]);
                        });
      }
      first += layer->kept;
    }
  }
  template <class Wants>
  Status snapParts(const VolumeGrid& grid, const std::vector<Part>& parts, const SnapBox& box, const Wants& wants,
                   std::vector<SnappedTriangle>& triangles, VoxelStats& stats) const;
  Status fill(const VolumeGrid& grid, bool moves, const std::vector<Part>& parts, VoxelLayer& layer,
              VoxelStats& stats) const;
  Status refill(const std::vector<Part>& parts, std::span<const PartEdit> edits, VoxelLayer& layer,
                VoxelStats& stats) const;
  Status place(std::span<const glm::mat4x3> toWorld, std::vector<Part>& parts) const;
  Status place(std::span<const PartEdit> edits, std::vector<Part>& parts) const;
  Status fillAll();
  Status fillMoved(const VolumeGrid& from, const VolumeGrid& to, VoxelLayer& layer, VoxelStats& stats) const;
  // [voxels] of each layer that keep their sides.
  std::uint32_t budget() const;
  Joined join(const VoxelLayer& standing, const VoxelLayer& moving, std::size_t kept) const;

  VolumeGrid grid_;
  VolumeReach reach_;
  std::shared_ptr<const PackedGeometry> geometry_;  // which copies share
  std::vector<Part> parts_;
  std::uint32_t surfaceBudget_ = 0;  // as VoxelOptions has it
  ParallelFor parallelFor_;
  std::shared_ptr<const VoxelLayer> standing_;  // which copies share
  VoxelLayer moving_;
  VoxelStats standingStats_, movingStats_;
  Joined joined_;
  std::uint64_t standingVersion_ = 0, movingVersion_ = 0;
  bool emits_ = false;  // reflect() had emission
  double voxeliseMs_ = 0.0, moveMs_ = 0.0, directMs_ = 0.0, reflectMs_ = 0.0;
};

// Of the volume as it was when it was found: it may not have changed since.
class VoxelVolume::Change {
 public:
  double ms() const { return ms_; }  // that it took to find

 private:
  friend class VoxelVolume;
  std::optional<std::vector<Part>> parts;
  std::optional<VolumeGrid> grid;
  std::shared_ptr<VoxelLayer> standing;
  std::optional<VoxelLayer> moving;
  VoxelStats standingStats, movingStats;
  Joined joined;
  double ms_ = 0.0;
};

}  // namespace relume
