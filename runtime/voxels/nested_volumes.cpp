// SPDX-License-Identifier: MIT
// See nested_volumes.h.
#include "runtime/voxels/nested_volumes.h"

#include "formats/decimal.h"
#include "formats/limits.h"
#include "runtime/voxels/check_geometry.h"
#include "runtime/voxels/radiance_along.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <new>

namespace relume {
namespace {

Error nestedError(const std::string& what) { return {ErrorCode::usage, "voxels: " + what}; }

Status checkEye(const glm::vec3& eyeWorld) {
  if (isWithin(eyeWorld, kMaxCoordinate)) return done();
  return nestedError("the eye has a coordinate beyond " + decimal(kMaxCoordinate) + " m, or one that is not finite");
}

// The grid of a volume that lies in another, of cells half as large: as many along each axis, or all that there are.
VolumeGrid halfOf(const VolumeGrid& outer, std::uint32_t cells) {
  VolumeGrid grid = outer;
  grid.voxel = 0.5f * outer.voxel;
  grid.cells = glm::min(2 * outer.cells, glm::ivec3(static_cast<int>(cells)));
  grid.roams = true;
  return shifted(grid, 2 * outer.shift);
}

constexpr double kNear = 0.75;  // [cells] how far the eye goes from the middle of a volume before that follows

// Where a grid would begin whose middle is the eye. [cells from the corner that stays]
glm::dvec3 aboutEye(const VolumeGrid& grid, const glm::vec3& eyeWorld) {
  return (glm::dvec3(eyeWorld) - glm::dvec3(grid.anchor())) / double{grid.cell()} - 0.5 * glm::dvec3(grid.cells);
}

// The shift of a grid whose middle is nearest to the eye, unless it is near enough where it is.
glm::ivec3 follow(const VolumeGrid& grid, const glm::vec3& eyeWorld, bool isNew) {
  constexpr double kFarthest = 1 << 18;  // [cells] places then keep three bits below a voxel
  const glm::dvec3 wanted = glm::clamp(aboutEye(grid, eyeWorld), -kFarthest, kFarthest);
  glm::ivec3 shift = grid.shift;
  for (int k = 0; k < 3; ++k) {
    if (isNew || std::abs(wanted[k] - shift[k]) > kNear) shift[k] = static_cast<int>(std::floor(wanted[k] + 0.5));
  }
  return shift;
}

// How far within the outermost's face a volume is read from, where its own face would be so far within that if it
// followed the eye without a step: kNear within its own, and past the outermost's once both faces are one. [cells]
double readFrom(double within) {
  constexpr double kOnTheWay = 1.5;  // of a cell that the volume moves
  const double near = within + kNear;
  return near >= 1.0 ? near : std::max(1.0 - kOnTheWay * (1.0 - near), -double{kBlendCells});
}

// Where it begins so that all of it lies in the outermost, whose cells are 2^level as large.
glm::ivec3 keepWithin(const VolumeGrid& outermost, std::size_t level, const glm::ivec3& cells,
                      const glm::ivec3& shift) {
  const int scale = 1 << level;
  const glm::ivec3 low = scale * outermost.shift, high = low + scale * outermost.cells - cells;
  return glm::clamp(shift, low, high);
}

}  // namespace

// From which the faces of the volumes would be if they followed the eye without a step.
void setReach(std::span<VoxelVolume> volumes, const glm::vec3& eyeWorld, bool boxFollowsEye) {
  const VolumeGrid box = volumes.front().grid();
  for (std::size_t level = 0; level < volumes.size(); ++level) {
    const VolumeGrid& grid = volumes[level].grid();
    const glm::dvec3 wanted = aboutEye(grid, eyeWorld);
    VolumeReach reach;
    for (int k = 0; k < 3; ++k) {
      // [cells from the corner that stays]
      const double boxLow = box.shift[k] * (1 << level), boxHigh = boxLow + box.cells[k] * (1 << level),
                   size = grid.cells[k], first = grid.shift[k];
      double low = boxLow, high = boxHigh;
      if (level > 0 && size < boxHigh - boxLow) {
        low += readFrom(std::min(wanted[k], boxHigh - size) - boxLow);
        high -= readFrom(boxHigh - size - std::max(wanted[k], boxLow));
        if (first > boxLow) low = std::max(low, first);
        if (first + size < boxHigh) high = std::min(high, first + size);
      } else if (level == 0 && boxFollowsEye) {
        low = std::max(wanted[k] + kNear, first);
        high = std::min(wanted[k] + size - kNear, first + size);
      } else if (level > 0 || !grid.roams) {
        continue;
      }
      reach.low[k] = static_cast<float>(kBrickSide * (low - first));
      reach.high[k] = static_cast<float>(kBrickSide * (high - first));
    }
    volumes[level].setReach(reach);
  }
}

NestedVolumes::NestedVolumes(VoxelVolume only) : voxeliseMs_(only.passTimes()[0].ms) {
  volumes_.push_back(std::move(only));
  setReach(volumes_, glm::vec3(0.0f), false);
}

Result<NestedVolumes> NestedVolumes::create(const VoxelGeometry& geometry, const NestedOptions& options) {
  if (options.cascades < 1 || options.cascades > kMaxCascades)
    return nestedError(std::to_string(options.cascades) + " cascades, expected 1 to " + std::to_string(kMaxCascades));
  if (options.eyeWorld) {
    if (Status ok = checkEye(*options.eyeWorld); !ok) return ok.error();
  }
  try {
    VoxelOptions box = options.outermost;
    box.roams = options.outermost.roams || options.boxFollowsEye;
    Result<VoxelVolume> first = VoxelVolume::create(geometry, box);
    if (!first) return first.error();
    NestedVolumes nested(std::move(*first));
    nested.boxFollowsEye_ = options.boxFollowsEye;
    if (options.boxFollowsEye && options.eyeWorld) {
      if (Result<bool> moved = nested.centre(*options.eyeWorld); !moved) return moved.error();
    }
    const VolumeGrid outermost = nested.outermost().grid();
    const glm::vec3 eye = options.eyeWorld.value_or(outermost.toWorld(0.5f * glm::vec3(outermost.voxels())));
    for (std::uint32_t level = 1; level < options.cascades; ++level) {
      VolumeGrid grid = halfOf(nested.volumes_.back().grid(), options.outermost.cells);
      const glm::ivec3 wanted = follow(grid, eye, true);
      Result<VoxelVolume> inner =
          nested.outermost().over(shifted(grid, keepWithin(outermost, level, grid.cells, wanted)));
      if (!inner) return inner.error();
      nested.voxeliseMs_ += inner->passTimes()[0].ms;
      nested.volumes_.push_back(std::move(*inner));
    }
    setReach(nested.volumes_, eye, options.boxFollowsEye);
    return nested;
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

namespace {

// Changes of all volumes, taken once all are found.
template <class Find>
Status changeAll(std::vector<VoxelVolume>& volumes, double& ms, const Find& find) {
  try {
    std::vector<VoxelVolume::Change> changes;
    changes.reserve(volumes.size());
    for (const VoxelVolume& volume : volumes) {
      Result<VoxelVolume::Change> change = find(volume);
      if (!change) return change.error();
      changes.push_back(std::move(*change));
    }
    ms = 0.0;
    for (std::size_t level = 0; level < volumes.size(); ++level) {
      ms += changes[level].ms();
      volumes[level].take(std::move(changes[level]));
    }
    return done();
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

}  // namespace

Status NestedVolumes::place(const PartPlaces& places) {
  double moveMs = 0.0;  // which the volumes have
  Status ok = changeAll(volumes_, places.edits ? voxeliseMs_ : moveMs,
                        [&](const VoxelVolume& volume) { return volume.findPlaces(places); });
  if (ok) isLit_.clear();
  return ok;
}

Status NestedVolumes::lightDirectly(const LightSetup& setup) {
  isLit_.clear();
  return lightChanged(setup);
}

Status NestedVolumes::lightChanged(const LightSetup& setup) {
  try {
    isLit_.resize(volumes_.size(), 0);
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
  directMs_ = 0.0;
  for (std::size_t level = 0; level < volumes_.size(); ++level) {
    if (isLit_[level] != 0) continue;
    if (Status ok = volumes_[level].lightDirectly(setup); !ok) return ok;
    isLit_[level] = 1;
    directMs_ += volumes_[level].passTimes()[2].ms;
  }
  return done();
}

Result<bool> NestedVolumes::centre(const glm::vec3& eyeWorld) {
  if (Status ok = checkEye(eyeWorld); !ok) return ok.error();
  try {
    std::vector<std::pair<std::size_t, VoxelVolume::Change>> changes;
    changes.reserve(volumes_.size());
    VolumeGrid box = outermost().grid();
    for (std::size_t level = boxFollowsEye_ ? 0 : 1; level < volumes_.size(); ++level) {
      const VolumeGrid& grid = volumes_[level].grid();
      glm::ivec3 shift = follow(grid, eyeWorld, false);
      if (level == 0) {
        box = shifted(grid, shift);
      } else {
        shift = keepWithin(box, level, grid.cells, shift);
      }
      if (shift == grid.shift) continue;
      Result<VoxelVolume::Change> change = volumes_[level].findShift(shift);
      if (!change) return change.error();
      changes.emplace_back(level, std::move(*change));
    }
    if (!changes.empty()) voxeliseMs_ = 0.0;
    for (auto& [level, change] : changes) {
      voxeliseMs_ += change.ms();
      volumes_[level].take(std::move(change));
      if (level < isLit_.size()) isLit_[level] = 0;
    }
    setReach(volumes_, eyeWorld, boxFollowsEye_);
    return !changes.empty();
  } catch (const std::bad_alloc&) {
    return noMemoryForVoxels();
  }
}

glm::vec3 NestedVolumes::radianceAlong(const glm::vec3& originWorld, const glm::vec3& direction) const {
  std::size_t level = volumes_.size() - 1;
  while (level > 0 && !volumes_[level].grid().holdsPlace(originWorld)) --level;
  return relume::radianceAlong(volumes_[level], all().first(level), volumes_[level].grid().toGrid(originWorld),
                               direction, glm::vec3(0.0f));
}

VoxelStats NestedVolumes::stats() const {
  VoxelStats sum = outermost().stats();
  for (std::size_t level = 1; level < volumes_.size(); ++level) {
    const VoxelStats inner = volumes_[level].stats();
    sum.occupied += inner.occupied;
    sum.dropped += inner.dropped;
  }
  return sum;
}

std::vector<PassTime> NestedVolumes::passTimes() const {
  std::vector<PassTime> sum = outermost().passTimes();
  for (std::size_t level = 1; level < volumes_.size(); ++level) {
    const std::vector<PassTime> inner = volumes_[level].passTimes();
    for (std::size_t i = 1; i < sum.size(); ++i) sum[i].ms += inner[i].ms;
  }
  sum[0].ms = voxeliseMs_;
  sum[2].ms = directMs_;
  return sum;
}

std::vector<std::pair<std::string, std::size_t>> NestedVolumes::bufferSizes() const {
  auto sum = outermost().bufferSizes();
  for (std::size_t level = 1; level < volumes_.size(); ++level) {
    const auto inner = volumes_[level].bufferSizes();
    for (std::size_t i = 0; i < sum.size(); ++i) {
      if (sum[i].first != "voxel geometry") sum[i].second += inner[i].second;  // which all share
    }
  }
  return sum;
}

}  // namespace relume
