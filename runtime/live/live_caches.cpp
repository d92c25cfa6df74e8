// SPDX-License-Identifier: MIT
// See live_caches.h.
#include "runtime/live/live_caches.h"

#include "formats/limits.h"
#include "formats/sh.h"
#include "runtime/live/cell_field.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"
#include "runtime/voxels/radiance_along.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <numbers>

namespace relume {
namespace {

constexpr std::uint32_t kBasis = 9, kCoefficients = 3 * kBasis;  // of three bands; of a cell
constexpr std::uint32_t kCellsAtOnce = 16, kSidesAtOnce = 512;   // of a chunk

// Basis functions of a frame's rays, which are the same for all cells. [kBasis each, times 4 pi / rays]
std::vector<float> basisOf(const std::vector<glm::vec3>& direction) {
  std::vector<float> basis(kBasis * direction.size());
  const float weight = 4.0f * std::numbers::pi_v<float> / static_cast<float>(direction.size());
  for (std::size_t i = 0; i < direction.size(); ++i) {
    float* const y = basis.data() + kBasis * i;
    evaluateSh(3, direction[i], {y, kBasis});
    for (std::uint32_t k = 0; k < kBasis; ++k) y[k] *= weight;
  }
  return basis;
}

}  // namespace

void CacheSum::add(const CellStencil& stencil, float share, std::span<const float> from,
                   std::span<const float> brightestOf) {
  for (std::size_t k = 0; k < 8; ++k) {
    const float weight = share * stencil.weight[k];
    if (weight == 0.0f) continue;
    const float* const cache = from.data() + std::size_t{kCoefficients} * stencil.slot[k];
    for (std::uint32_t i = 0; i < kCoefficients; ++i) coefficients[i] += weight * cache[i];
    brightest = std::max(brightest, brightestOf[stencil.slot[k]]);
  }
}

// By the clamped cosine, as much as light of one radiance from all sides at most. Its third band counts nine tenths:
// three bands in full give light from one side a sixteenth too much straight on, and as much from behind.
glm::vec3 CacheSum::irradiance(const glm::vec3& normal) const {
  if (!(brightest > 0.0f)) return glm::vec3(0.0f);
  FieldLobe lobe = clampedLobe(normal);
  for (std::size_t k = 4; k < kBasis; ++k) lobe[k] *= 0.9f;
  glm::vec3 e(0.0f);
  for (std::uint32_t k = 0; k < kBasis; ++k)
    e += lobe[k] * glm::vec3(coefficients[k], coefficients[kBasis + k], coefficients[2 * kBasis + k]);
  return glm::clamp(e, glm::vec3(0.0f), glm::vec3(std::numbers::pi_v<float> * brightest));
}

glm::vec3 readStencil(const CellStencil& stencil, std::span<const float> coefficients, std::span<const float> brightest,
                      const glm::vec3& normal) {
  CacheSum sum;
  sum.add(stencil, 1.0f, coefficients, brightest);
  return sum.irradiance(normal);
}

CellStencil checkedStencil(const CellSet& cells, const glm::vec3& positionWorld, const glm::vec3& normal) {
  if (cells.active.empty() || !isWithin(positionWorld, kMaxCoordinate) || !(glm::dot(normal, normal) < 4.0f)) return {};
  return stencilAt(cells, cells.grid.toGrid(positionWorld), normal);
}

Result<LiveCaches> LiveCaches::create(const LiveOptions& options) {
  if (Status ok = checkLiveOptions(options); !ok) return ok.error();
  return LiveCaches(options);
}

void LiveCaches::reset() {
  std::fill(coefficients_.begin(), coefficients_.end(), 0.0f);
  std::fill(brightest_.begin(), brightest_.end(), 0.0f);
  std::fill(isLit_.begin(), isLit_.end(), std::uint8_t{0});
}

// Take over what has changed of the volume: cells keep their light, those that become active go on from that of the
// cache of `around` whose cell they lie in. Returns whether anything has.
bool LiveCaches::follow(const VoxelVolume& volume, const LiveCaches* around) {
  const bool stood = volume.standingVersion() == standingVersion_;
  if (stood && volume.movingVersion() == movingVersion_) return false;
  ChangedCells found = findChangedCells(volume, cells_);
  CellSet& cells = found.cells;
  std::vector<float> coefficients(std::size_t{kCoefficients} * cells.active.size(), 0.0f),
      brightest(cells.active.size(), 0.0f);
  std::vector<std::uint8_t> isLit(cells.active.size(), 0);
  const auto copy = [&](const LiveCaches& from, std::uint32_t slot, std::size_t to) {
    std::copy_n(from.coefficients_.begin() + std::ptrdiff_t{kCoefficients} * slot, kCoefficients,
                coefficients.begin() + static_cast<std::ptrdiff_t>(kCoefficients * to));
    brightest[to] = from.brightest_[slot];
    isLit[to] = from.isLit_[slot];
  };
  for (std::size_t i = 0; i < cells.active.size(); ++i) {
    const glm::ivec3 cell = cells.grid.cellAt(cells.active[i]);
    if (const std::uint32_t old = slotBefore(cells_, cells, cell); old != kInactive) {
      copy(*this, old, i);
    } else if (around != nullptr) {
      if (const std::uint32_t slot = slotAround(around->cells_, cells, cell); slot != kInactive) copy(*around, slot, i);
    }
  }
  // What sides see is found again, but for those of standing voxels far from what has changed.
  const auto kept = [&](std::uint32_t s, const glm::ivec3& voxel, SeenCaches& seen) {
    const glm::ivec3 cell = voxel >> 2;
    if (!found.changes.seesTheSame(cells.grid, cell, kStencilReach)) return false;
    const std::uint32_t old = cells_.grid.cellIndex(cell + found.changes.by);
    const std::uint32_t number = cells_.standing->first[old] + countBefore(cells_.standing->bits[old], voxel);
    if (2 * std::size_t{number} + 1 >= standing_.size()) return false;
    seen = standing_[2 * std::size_t{number} + s % 2];
    return true;
  };
  std::vector<SeenCaches> standing(volume.standingSides()), moving(volume.sideCount() - volume.standingSides());
  forChunks(volume.parallelFor(), volume.sideCount(), kSidesAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
    volume.forSides(begin, end, [&](const SideAt& at) {
      SeenCaches& seen = at.index < standing.size() ? standing[at.index] : moving[at.index - standing.size()];
      if (at.index < standing.size() && kept(at.index, at.voxel, seen)) return;
      seen = seenCaches(cells, at.place(), at.side.normal);
    });
  });
  cells_ = std::move(cells);
  coefficients_ = std::move(coefficients);
  brightest_ = std::move(brightest);
  isLit_ = std::move(isLit);
  standing_ = std::move(standing);
  moving_ = std::move(moving);
  standingVersion_ = volume.standingVersion();
  movingVersion_ = volume.movingVersion();
  return true;
}

Status LiveCaches::gather(const VoxelVolume& volume, const LiveFrame& frame, std::span<const VoxelVolume> beyond) {
  Stopwatch watch;
  try {
    const LiveRays rays = liveRays(options_.raysPerCell, frame);
    const std::vector<float> basis = basisOf(rays.direction);
    forChunks(volume.parallelFor(), activeCells(), kCellsAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t c = begin; c < end; ++c) {
        std::array<float, kCoefficients> sum{};
        float brightest = 0.0f;
        const glm::vec3 position = cells_.positionOf(c);
        for (std::uint32_t i = 0; i < rays.direction.size(); ++i) {
          const glm::vec3 radiance = radianceAlong(volume, beyond, position, rays.direction[i], rays.sky[i]);
          if (radiance == glm::vec3(0.0f)) continue;
          brightest = std::max({brightest, radiance.x, radiance.y, radiance.z});
          const float* const y = basis.data() + std::size_t{kBasis} * i;
          for (std::uint32_t k = 0; k < kBasis; ++k) {
            sum[k] += radiance.x * y[k];
            sum[kBasis + k] += radiance.y * y[k];
            sum[2 * kBasis + k] += radiance.z * y[k];
          }
        }
        const float keep = isLit_[c] != 0 ? frame.keep : 0.0f;
        float* const to = coefficients_.data() + std::size_t{kCoefficients} * c;
        for (std::uint32_t k = 0; k < kCoefficients; ++k) to[k] = keep * to[k] + (1.0f - keep) * sum[k];
        brightest_[c] = keep * brightest_[c] + (1.0f - keep) * brightest;
        isLit_[c] = 1;
      }
    });
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  gatherMs_ = watch.lap();
  return done();
}

Status LiveCaches::reflect(VoxelVolume& volume, const LiveFrame& frame, const LiveCaches* around) {
  if (Status ok = checkLiveFrame(frame); !ok) return ok;
  try {
    Stopwatch watch;
    const bool hasChanged = follow(volume, around);
    cellsMs_ = watch.lap();
    // Sides that are new have no radiance to freeze.
    if (!frame.freezeVoxels || hasChanged) {
      VoxelVolume::SideIrradiance bounced;
      if (frame.bounceScale > 0.0f)
        bounced = [&](const SideAt& at) {
          const SeenCaches seen =
              at.index < standing_.size() ? standing_[at.index] : moving_[at.index - standing_.size()];
          const CellStencil stencil = stencilOf(cells_, at.place(), at.side.normal, seen);
          return frame.bounceScale * readStencil(stencil, coefficients_, brightest_, at.side.normal);
        };
      volume.reflect(bounced, frame.emissionScale);
    }
    bounceMs_ = watch.lap();
  } catch (const std::bad_alloc&) {
    return noMemoryForLiveLight();
  }
  return done();
}

Status LiveCaches::update(VoxelVolume& volume, const LiveFrame& frame) {
  if (Status ok = reflect(volume, frame, nullptr); !ok) return ok;
  return gather(volume, frame, {});
}

CellStencil LiveCaches::stencil(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  return checkedStencil(cells_, positionWorld, normal);
}

glm::vec3 LiveCaches::irradianceBy(const CellStencil& stencil, const glm::vec3& normal) const {
  return readStencil(stencil, coefficients_, brightest_, normal);
}

glm::vec3 LiveCaches::irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  return irradianceBy(stencil(positionWorld, normal), normal);
}

std::vector<PassTime> LiveCaches::passTimes() const {
  return {{"cells", cellsMs_}, {"bounce", bounceMs_}, {"gather", gatherMs_}};
}

std::vector<std::pair<std::string, std::size_t>> LiveCaches::bufferSizes() const {
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return {{"cells", bytes(cells_.active) + bytes(cells_.slot) + bytes(cells_.place) + bytes(cells_.height) +
                        bytes(cells_.standingContent) + bytes(cells_.content)},
          {"cell light", bytes(coefficients_) + bytes(brightest_) + bytes(isLit_)},
          {"caches seen", bytes(standing_) + bytes(moving_)}};
}

}  // namespace relume
