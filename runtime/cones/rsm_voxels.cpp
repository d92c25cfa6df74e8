// SPDX-License-Identifier: MIT
// See rsm_voxels.h.
#include "runtime/cones/rsm_voxels.h"

#include "formats/limits.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <numbers>

namespace relume {
namespace {

constexpr std::uint32_t kRsmSides = 256, kTexels = 4096;  // of a chunk
constexpr float kLittle = 0.5f;                           // [voxel faces] a side with less area looks for a neighbour
constexpr float kLeastArea = 0.0625f;                     // [voxel faces] that flux is spread over at least
constexpr float kSameWay = 0.7f;                          // cosine between sides that face the same way
constexpr double kMostPerFlux = 1e30;  // [1/(m² sr)] of voxels next to no metre wide: no light stays none
constexpr int kFinestUnit = -100;      // exponent: single precision has units and their inverse

Error noMemoryForMaps() {
  return {ErrorCode::memory, "voxels lit by reflective shadow maps: memory ran out; fewer cells take less"};
}

// The voxel whose sides a cone reads: where both layers have it, of what moves. kNoVoxel where it is empty or dropped.
std::uint32_t voxelAt(const VoxelVolume& volume, const glm::ivec3& v) {
  if (!volume.isOccupied(v)) return kNoVoxel;
  const VolumeGrid& grid = volume.grid();
  const bool moves = volume.hasMoving() && volume.moving().has(grid, v);
  const VoxelLayer& layer = moves ? volume.moving() : volume.standing();
  const std::uint32_t number = layer.numberOf(grid, v);
  if (number >= layer.kept) return kNoVoxel;
  return moves ? volume.standing().kept + number : number;
}

// Which side of a voxel a surface with this normal is counted to, as voxel_layer.cpp counts its area. Both are 127
// times a unit vector.
std::uint32_t sideFacing(const VoxelVolume& volume, std::uint32_t voxel, const glm::ivec3& normal) {
  const glm::ivec3 axis(volume.axisOf(voxel));
  return 2 * voxel + (normal.x * axis.x + normal.y * axis.y + normal.z * axis.z >= 0 ? 0 : 1);
}

glm::ivec3 inBytes(const glm::vec3& normal) { return glm::ivec3(glm::floor(127.0f * normal + 0.5f)); }

// [m²] Of a side that no triangle faces, that of the backs of those that face the other one.
float areaOf(std::span<const float> areas, std::uint32_t side) {
  return areas[side] > 0.0f ? areas[side] : areas[side ^ 1u];
}

// The neighbour's side that a side with little area goes to, or that itself where there is none.
std::uint32_t targetOf(const VoxelVolume& volume, std::span<const float> areas, const SideAt& at, float face) {
  const std::uint32_t side = at.index;
  const glm::vec3& from = at.side.normal;
  const glm::ivec3 normal = inBytes(from);
  std::uint32_t best = side;
  float most = 0.0f;
  for (int i = 0; i < 27; ++i) {
    const glm::ivec3 step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (i == 13) continue;
    const std::uint32_t voxel = voxelAt(volume, at.voxel + step);
    if (voxel == kNoVoxel) continue;
    const std::uint32_t other = sideFacing(volume, voxel, normal);
    const float area = areaOf(areas, other);
    if (area < kLittle * face) continue;
    const float cosine = glm::dot(volume.side(other).normal, from);
    if (cosine < kSameWay) continue;
    // The nearest, then the one with most area
    const float worth = cosine * std::min(area, face) / static_cast<float>(glm::dot(glm::vec3(step), glm::vec3(step)));
    if (worth > most) {
      most = worth;
      best = other;
    }
  }
  return best;
}

// Finds the side that a texel's flux is added to.
class Landing {
 public:
  explicit Landing(const VoxelVolume& volume)
      : volume_(volume),
        origin_(volume.grid().originWorld),
        perMetre_(1.0f / volume.grid().voxel),
        end_(volume.grid().voxels()) {}

  // As shaders/cone_rsm.comp; kNoSide where it lies in no voxel. Voxels are thin: a surface that passes through the
  // edge of one may be in the next along the normal's longest axis alone.
  std::uint32_t sideOf(const RsmTexel& texel) const {
    const glm::vec3 place = (texel.positionWorld - origin_) * perMetre_;
    if (!glm::all(glm::greaterThanEqual(place, glm::vec3(-1.0f))) || !glm::all(glm::lessThan(place, end_ + 1.0f)))
      return kNoSide;
    const glm::ivec3 steps(glm::floor(place * float{kVoxelSteps})), normal = inBytes(texel.normal);
    const glm::ivec3 size = glm::abs(normal), here = steps >> kVoxelShift;
    const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    glm::ivec3 beside(0);
    beside[axis] = (steps[axis] & (kVoxelSteps - 1)) < kVoxelSteps / 2 ? -1 : 1;
    for (const glm::ivec3& v : {here, here + beside, here - beside}) {
      const std::uint32_t voxel = voxelAt(volume_, v);
      if (voxel != kNoVoxel) return sideFacing(volume_, voxel, normal);
    }
    return kNoSide;
  }

 private:
  const VoxelVolume& volume_;
  glm::vec3 origin_;
  float perMetre_;
  glm::vec3 end_;
};

// As shaders/cone_rsm_light.comp: the upper 24 bits, so that nothing is rounded.
float cut(std::uint64_t sum) {
  const int below = std::max(static_cast<int>(std::bit_width(sum)) - std::numeric_limits<float>::digits, 0);
  return std::ldexp(static_cast<float>(sum >> below), below);
}

void add(std::uint64_t& to, std::uint64_t units) {
  if (units > 0) std::atomic_ref(to).fetch_add(units, std::memory_order_relaxed);
}

}  // namespace

float rsmUnit(float largestFlux) {
  if (!(largestFlux > 0.0f)) return 1.0f;
  return std::ldexp(1.0f, std::max(std::ilogb(largestFlux) - 30, kFinestUnit));
}

float largestFlux(std::span<const RsmImage> images) {
  float largest = 0.0f;
  for (const RsmImage& image : images) {
    for (const RsmTexel& t : image.texel) {
      if (t.area > 0.0f) largest = std::max({largest, t.flux.x, t.flux.y, t.flux.z});
    }
  }
  return largest;
}

Status checkEmissionScale(const glm::vec3& emissionScale) {
  if (isRadiance(emissionScale)) return done();
  return Error{ErrorCode::usage,
               "voxels lit by reflective shadow maps: emissionScale has a channel outside of 0 to 1e9"};
}

RsmTargets findRsmTargets(const VoxelVolume& volume) {
  RsmTargets targets;
  const std::uint32_t sides = volume.sideCount();
  const float face = volume.grid().voxel * volume.grid().voxel;
  targets.side.resize(sides);
  targets.perFlux.assign(sides, 0.0f);
  const std::vector<float> areas = volume.areas();
  std::vector<std::uint8_t> isRead(sides, 0);
  forChunks(volume.parallelFor(), sides, kRsmSides, [&](std::uint32_t begin, std::uint32_t end) {
    volume.forSides(begin, end, [&](const SideAt& at) {
      const std::uint32_t s = at.index;
      isRead[s] = voxelAt(volume, at.voxel) == s / 2 ? 1 : 0;
      targets.side[s] = isRead[s] != 0 && areaOf(areas, s) < kLittle * face ? targetOf(volume, areas, at, face) : s;
    });
  });
  std::vector<double> area(sides, 0.0);
  for (std::uint32_t s = 0; s < sides; ++s) area[targets.side[s]] += static_cast<double>(areaOf(areas, s));
  for (std::uint32_t s = 0; s < sides; ++s) {
    if (isRead[s] == 0) continue;
    const double spread = std::max(area[targets.side[s]], static_cast<double>(kLeastArea * face));
    targets.perFlux[s] = static_cast<float>(std::min(std::numbers::inv_pi / spread, kMostPerFlux));
  }
  return targets;
}

Status RsmVoxels::light(VoxelVolume& volume, std::span<const RsmImage> images, const glm::vec3& emissionScale) {
  if (Status ok = checkEmissionScale(emissionScale); !ok) return ok;
  if (Status ok = checkRsm(images); !ok) return ok;
  try {
    Stopwatch watch;
    const std::uint32_t sides = volume.sideCount();
    if (!follows_ || standingVersion_ != volume.standingVersion() || movingVersion_ != volume.movingVersion()) {
      targets_ = findRsmTargets(volume);
      standingVersion_ = volume.standingVersion();
      movingVersion_ = volume.movingVersion();
      follows_ = true;
    }
    targetsMs_ = watch.lap();

    // 1. Flux of the texels, by side
    unit_ = rsmUnit(largestFlux(images));
    sums_.assign(3 * std::size_t{sides}, 0);
    const Landing landing(volume);
    const float perWatt = 1.0f / unit_;
    std::array<std::uint64_t, 2> total{};  // of all texels, and of those that lie in voxels
    for (const RsmImage& image : images) {
      forChunks(volume.parallelFor(), static_cast<std::uint32_t>(image.texel.size()), kTexels,
                [&](std::uint32_t begin, std::uint32_t end) {
                  std::array<std::uint64_t, 2> sum{};
                  for (std::uint32_t t = begin; t < end; ++t) {
                    const RsmTexel& texel = image.texel[t];
                    if (!(texel.area > 0.0f) || texel.flux == glm::vec3(0.0f)) continue;
                    const std::uint32_t side = landing.sideOf(texel);
                    for (int k = 0; k < 3; ++k) {
                      const auto units = static_cast<std::uint32_t>(texel.flux[k] * perWatt);
                      sum[0] += units;
                      if (side == kNoSide) continue;
                      sum[1] += units;
                      add(sums_[3 * std::size_t{targets_.side[side]} + static_cast<std::size_t>(k)], units);
                    }
                  }
                  add(total[0], sum[0]);
                  add(total[1], sum[1]);
                });
    }
    arrived_ = total[0] > 0 ? static_cast<float>(static_cast<double>(total[1]) / static_cast<double>(total[0])) : 1.0f;

    // 2. Radiance
    forChunks(volume.parallelFor(), sides, kRsmSides, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t s = begin; s < end; ++s) {
        const std::uint64_t* const sum = &sums_[3 * std::size_t{targets_.side[s]}];
        const glm::vec3 flux = glm::vec3(cut(sum[0]), cut(sum[1]), cut(sum[2])) * unit_;
        volume.setRadiance(
            s, glm::min(flux * targets_.perFlux[s] + volume.emissionOfSide(s) * emissionScale, kMaxRadiance));
      }
    });
    injectMs_ = watch.lap();
  } catch (const std::bad_alloc&) {
    follows_ = false;
    return noMemoryForMaps();
  }
  return done();
}

std::size_t RsmVoxels::sizeBytes() const {
  return sums_.size() * sizeof(sums_[0]) + targets_.side.size() * sizeof(targets_.side[0]) +
         targets_.perFlux.size() * sizeof(targets_.perFlux[0]);
}

}  // namespace relume
