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
#include "runtime/voxels/packed_mesh.h"
#include "runtime/voxels/snap_triangles.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory_resource>
#include <new>
#include <numbers>
#include <optional>

namespace relume {
namespace {

constexpr std::uint32_t kSides = 64;                  // 4 x 64 places: as many as VisibilityBatch takes
constexpr std::uint32_t kSidesAtOnce = 512 * kSides;  // whose light is held before what is dark of it goes
constexpr float kLift = 0.05f;                        // [voxel] of places off their surface, which is rounded

Error voxelsError(const std::string& what) { return {ErrorCode::usage, "voxels: " + what}; }

glm::vec3 placed(const glm::mat4x3& toWorld, const glm::vec3& p) {
  return toWorld[0] * p.x + toWorld[1] * p.y + toWorld[2] * p.z + toWorld[3];
}

// The bounds of all parts where they stand; nothing without triangles.
struct Bounds {
  glm::vec3 min{0.0f}, max{0.0f};
  bool empty = true;
};

Bounds boundsOf(const VoxelGeometry& geometry) {
  Bounds bounds;
  for (const VoxelPart& part : geometry.parts) {
    forCorners(geometry.meshes[part.mesh], [&](const glm::vec3& p) {
      const glm::vec3 world = glm::clamp(placed(part.toWorld, p), -kMaxCoordinate, kMaxCoordinate);
      bounds.min = bounds.empty ? world : glm::min(bounds.min, world);
      bounds.max = bounds.empty ? world : glm::max(bounds.max, world);
      bounds.empty = false;
    });
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
    volume.grid_ = fitGrid(box.min, box.max, options.cells, options.margin);
    volume.grid_.roams = options.roams;
    volume.geometry_ = std::make_shared<const PackedGeometry>(packGeometry(geometry, options.parallelFor));
    for (const VoxelPart& part : geometry.parts) volume.parts_.push_back({part, true});
    volume.surfaceBudget_ = options.surfaceBudget;
    volume.parallelFor_ = options.parallelFor;
    if (Status ok = volume.fillAll(); !ok) return ok.error();
    return volume;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

Result<VoxelVolume> VoxelVolume::over(const VolumeGrid& grid) const {
  try {
    VoxelVolume volume;
    volume.grid_ = grid;
    volume.geometry_ = geometry_;
    volume.parts_ = parts_;
    volume.surfaceBudget_ = surfaceBudget_;
    volume.parallelFor_ = parallelFor_;
    if (Status ok = volume.fillAll(); !ok) return ok.error();
    return volume;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

namespace {

// Direct light of some sides, shadows by one call for many points or one for each.
class DirectLight {
 public:
  DirectLight(const VoxelVolume& volume, const LightSetup& setup, std::span<const Light> lights)
      : volume_(volume), setup_(setup), lights_(lights) {}

  // Of sides from `begin` on. [Size irradiance: at most kSides]
  void light(std::uint32_t begin, std::span<PackedLight> irradiance) const {
    const auto count = static_cast<std::uint32_t>(irradiance.size());
    std::array<glm::vec3, kSides> sum{};
    std::array<glm::vec3, 4 * kSides> position, normal, arriving;
    std::array<std::uint32_t, 4 * kSides> slot;
    std::array<float, 4 * kSides> visible;
    std::array<SideSamples, kSides> samples;
    std::array<glm::vec3, kSides> middle;
    volume_.forSurfaces(begin, begin + count,
                        [&](std::uint32_t s, const glm::ivec3& voxel, const SideSurface& surface) {
                          samples[s - begin] = surface.samples;
                          middle[s - begin] = glm::vec3(voxel) + 0.5f;
                        });
    for (std::uint32_t k = 0; k < lights_.size(); ++k) {
      std::uint32_t lit = 0;
      for (std::uint32_t i = 0; i < count; ++i) {
        for (const SideSample& s : samples[i]) {
          if (s.count() == 0) break;
          const glm::vec3 n = glm::normalize(glm::vec3(s.normal()));
          const glm::vec3 at =
              volume_.grid().toWorld(middle[i] + glm::vec3(s.place()) / float{kVoxelSteps} + kLift * n);
          // Of a disc of its share of the voxel's face
          const float area = 0.25f * static_cast<float>(s.count()),
                      radius = volume_.grid().voxel * std::sqrt(area / std::numbers::pi_v<float>);
          const glm::vec3 e = directIrradiance(lights_[k], at, n, radius);
          if (e == glm::vec3(0.0f)) continue;
          position[lit] = at;
          normal[lit] = n;
          arriving[lit] = 0.25f * static_cast<float>(s.count()) * e;
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
    for (std::uint32_t i = 0; i < count; ++i) irradiance[i] = PackedLight(sum[i]);
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
    std::pmr::vector<Light> lights(std::pmr::new_delete_resource());
    normaliseLights(setup.lights, lights);
    const DirectLight direct(*this, setup, lights);
    SparseLight found;
    std::vector<PackedLight> room(std::min(kSidesAtOnce, sideCount()));
    while (found.size() < sideCount()) {
      const auto first = static_cast<std::uint32_t>(found.size());
      const std::span next(room.data(), std::min(kSidesAtOnce, sideCount() - first));
      forChunks(parallelFor_, static_cast<std::uint32_t>(next.size()), kSides,
                [&](std::uint32_t begin, std::uint32_t end) {
                  direct.light(first + begin, next.subspan(begin, end - begin));
                });
      found.append(next);
    }
    found.shrinkToFit();
    joined_.direct = std::move(found);
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
  directMs_ = watch.lap();
  return done();
}

namespace {

// What sides of a layer emit, one after the other.
class EmissionReader {
 public:
  EmissionReader(const VoxelLayer& layer, std::uint32_t side)
      : next_(layer.emissionFrom(side)), end_(layer.emission.end()) {}
  const SideEmission* of(std::uint32_t side) {  // null: nothing
    return next_ != end_ && next_->side == side ? &*next_++ : nullptr;
  }

 private:
  std::vector<SideEmission>::const_iterator next_, end_;
};

}  // namespace

void VoxelVolume::reflect(const SideIrradiance& bounced, const glm::vec3& emissionScale) {
  Stopwatch watch;
  emits_ = emissionScale != glm::vec3(0.0f);
  forChunks(parallelFor_, sideCount(), 8 * kSides, [&](std::uint32_t first, std::uint32_t last) {
    const std::uint32_t moving = std::clamp(standingSides(), first, last);
    EmissionReader standing(*standing_, first), moves(moving_, moving - standingSides());
    forSides(first, last, [&](const SideAt& at) {
      const std::uint32_t i = at.index;
      const glm::vec3 irradiance = bounced ? directOf(i) + bounced(at) : directOf(i);
      glm::vec3 radiance = std::numbers::inv_pi_v<float> * at.side.albedo * irradiance;
      const SideEmission* const emits = i < moving ? standing.of(i) : moves.of(i - standingSides());
      if (emits != nullptr) radiance += emissionScale * emits->emission;
      setRadiance(i, radiance);
    });
  });
  reflectMs_ = watch.lap();
}

MarchHit VoxelVolume::march(const glm::vec3& originWorld, const glm::vec3& direction, float maxT) const {
  MarchHit hit = VoxelMarch(grid_, bits().data(), grid_.toGrid(originWorld), direction).first(maxT / grid_.voxel);
  hit.t *= grid_.voxel;
  return hit;
}

std::uint32_t VoxelVolume::sideAt(const glm::ivec3& voxel, const glm::vec3& direction) const {
  const bool moves = movesIn(voxel);
  const VoxelLayer& layer = moves ? moving_ : *standing_;
  const std::uint32_t number = layer.numberOf(grid_, voxel);
  if (number >= layer.kept) return kNoSide;
  const std::uint32_t at = moves ? standing_->kept + number : number;
  return 2 * at + (isFront(layer.axis[number], direction) ? 0 : 1);
}

bool VoxelVolume::meetsBack(const glm::ivec3& voxel, const glm::vec3& direction) const {
  const std::uint32_t side = sideAt(voxel, direction);
  if (side == kNoSide) return false;
  const VoxelLayer& layer = movesIn(voxel) ? moving_ : *standing_;
  const std::uint32_t cell = grid_.cellOf(voxel);
  return !CellSides::isFaced(layer.sides, cell, countBefore(layer.bits[cell], voxel), side % 2);
}

std::array<SideAt, 2> VoxelVolume::sidesAt(const glm::ivec3& voxel) const {
  const bool moves = movesIn(voxel);
  const VoxelLayer& layer = moves ? moving_ : *standing_;
  const std::uint32_t cell = grid_.cellOf(voxel),
                      front = 2 * layer.numberOf(grid_, voxel) + (moves ? standingSides() : 0);
  CellSides sides(layer.sides, cell, layer.keptOf(cell));
  sides.skip(countBefore(layer.bits[cell], voxel));
  const std::array<VoxelSide, 2> side = sides.next();
  return {SideAt{front, voxel, side[0]}, SideAt{front + 1, voxel, side[1]}};
}

SideAt VoxelVolume::sideOf(std::uint32_t index) const {
  const bool moves = index >= standingSides();
  const VoxelLayer& layer = moves ? moving_ : *standing_;
  const VoxelCursor at(layer, grid_, (moves ? index - standingSides() : index) / 2);
  CellSides sides(layer.sides, at.cell(), layer.keptOf(at.cell()));
  sides.skip(at.inCell());
  return {index, at.voxel(), sides.next()[index % 2]};
}

std::vector<float> VoxelVolume::areas() const {
  std::vector<float> areas(sideCount());
  forChunks(parallelFor_, sideCount(), 8 * kSides, [&](std::uint32_t first, std::uint32_t last) {
    forSurfaces(first, last, [&](std::uint32_t s, const glm::ivec3& /*voxel*/, const SideSurface& surface) {
      areas[s] = surface.area;
    });
  });
  return areas;
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
  const auto sidesOf = [&](const VoxelLayer& layer) {
    return bytes(layer.axis) + layer.sides.bytes() + bytes(layer.emission) + bytes(layer.emitters);
  };
  std::size_t geometry = geometry_->surfaces.bytes() + bytes(parts_);
  for (const PackedMesh& mesh : geometry_->mesh) geometry += mesh.bytes();
  return {{"bricks", bytes(joined_.bits) + bytes(standing_->bits) + bytes(standing_->first) + bytes(moving_.bits) +
                         bytes(moving_.first)},
          {"sub-voxels", bytes(joined_.rayBits) + standing_->subVoxels.bytes() + moving_.subVoxels.bytes()},
          {"voxel sides", sidesOf(*standing_) + sidesOf(moving_)},
          {"voxel light", joined_.direct.bytes() + bytes(joined_.radiance)},
          {"voxel geometry", geometry}};
}

}  // namespace relume
