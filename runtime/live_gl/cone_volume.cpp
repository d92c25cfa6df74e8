// SPDX-License-Identifier: MIT
// See cone_volume.h.
#include "runtime/live_gl/cone_volume.h"

#include "runtime/cones/rsm_voxels.h"
#include "runtime/live/cell_texels.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/shared/chunks.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <span>
#include <utility>

namespace relume::gl {

void ConeVolume::forget() {
  standingVersion_ = movingVersion_ = 0;
  occupied_.clear();
  firstOccupied_.clear();
}

void ConeVolume::follow(const VoxelVolume& volume) {
  grid_ = volume.grid();
  sizes_.clear();
  for (glm::uvec3 size(grid_.voxels()); std::max({size.x, size.y, size.z}) > 1;)
    sizes_.push_back(size = (size + 1u) / 2u);
  findVoxels(volume);
  listVoxels();
  sideCount_ = volume.sideCount();
  standingVersion_ = volume.standingVersion();
  movingVersion_ = volume.movingVersion();
}

// Which voxels there are.
void ConeVolume::findVoxels(const VoxelVolume& volume) {
  constexpr std::uint32_t kCells = 1024;  // of a chunk
  const VoxelLayer &standing = volume.standing(), &moving = volume.moving();
  const std::span<const std::uint64_t> bits = volume.bits();
  cellTexels_.resize(grid_.cellCount());
  std::uint32_t count = 0;
  for (std::uint32_t c = 0; c < cellTexels_.size(); ++c) {
    cellTexels_[c] = glm::uvec4(wordsOf(bits[c]), count, 0);
    count += static_cast<std::uint32_t>(std::popcount(bits[c]));
  }
  const std::vector<float> areas = volume.areas();
  source_.assign(count, ConeSource{kNoSource, 0.5f});
  sideTexels_.assign(kConeSideTexels * std::size_t{count}, glm::vec4(0.0f));
  forChunks(volume.parallelFor(), static_cast<std::uint32_t>(cellTexels_.size()), kCells,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t c = begin; c < end; ++c) {
                std::uint32_t i = cellTexels_[c].z;
                for (std::uint64_t rest = bits[c]; rest != 0; rest &= rest - 1, ++i) {
                  const glm::ivec3 v = kBrickSide * grid_.cellAt(c) + voxelOfBit(std::countr_zero(rest));
                  const bool moves = volume.hasMoving() && moving.has(grid_, v);
                  const std::uint32_t number = (moves ? moving : standing).numberOf(grid_, v);
                  if (number >= (moves ? moving : standing).kept) continue;
                  const std::uint32_t voxel = moves ? standing.kept + number : number;
                  const SideAt front = volume.sideOf(2 * voxel), back = volume.sideOf(2 * voxel + 1);
                  const float area = areas[2 * voxel] + areas[2 * voxel + 1];
                  source_[i] = {voxel, area > 0.0f ? areas[2 * voxel] / area : 0.5f};
                  glm::vec4* const to = &sideTexels_[kConeSideTexels * std::size_t{i}];
                  to[0] = glm::vec4(front.place(), source_[i].front);
                  to[1] = glm::vec4(front.side.normal, 0.0f);
                  to[2] = glm::vec4(back.place(), 0.0f);
                  to[3] = glm::vec4(back.side.normal, 0.0f);
                }
              }
            });
}

// Of each level the voxels that hold one of the level below, with those that did before: what they hold is zero then.
void ConeVolume::listVoxels() {
  constexpr std::uint8_t kNow = 1, kBefore = 2;
  const auto countOf = [](const glm::uvec3& size) { return size.x * size.y * size.z; };
  const std::vector<std::uint32_t> before = std::move(occupied_), firstBefore = std::move(firstOccupied_);
  std::vector<std::uint8_t> is(countOf(sizes_[0]), 0);
  for (std::uint32_t c = 0; c < cellTexels_.size(); ++c) {
    const glm::uvec3 low = 2u * glm::uvec3(grid_.cellAt(c));
    for (std::uint64_t rest = cellTexels_[c].x | std::uint64_t{cellTexels_[c].y} << 32; rest != 0; rest &= rest - 1) {
      const glm::uvec3 v = low + glm::uvec3(voxelOfBit(std::countr_zero(rest)) / 2);
      is[(v.z * sizes_[0].y + v.y) * sizes_[0].x + v.x] = kNow;
    }
  }
  occupied_.clear();
  firstOccupied_.assign(1, 0);
  listed_.clear();
  firstListed_.assign(1, 0);
  for (std::size_t l = 0; l < sizes_.size(); ++l) {
    const glm::uvec3 size = sizes_[l], above = (size + 1u) / 2u;
    for (std::uint32_t i = firstBefore.empty() ? 0 : firstBefore[l]; !firstBefore.empty() && i < firstBefore[l + 1];
         ++i)
      is[((before[i] >> 20) * size.y + (before[i] >> 10 & 1023u)) * size.x + (before[i] & 1023u)] |= kBefore;
    std::vector<std::uint8_t> next(countOf(above), 0);
    for (std::uint32_t i = 0; i < is.size(); ++i) {
      if (is[i] == 0) continue;
      const glm::uvec3 v(i % size.x, i / size.x % size.y, i / (size.x * size.y));
      const std::uint32_t word = v.x | v.y << 10 | v.z << 20;
      listed_.push_back(word);
      if ((is[i] & kNow) == 0) continue;
      occupied_.push_back(word);
      next[((v.z / 2) * above.y + v.y / 2) * above.x + v.x / 2] = kNow;
    }
    firstOccupied_.push_back(static_cast<std::uint32_t>(occupied_.size()));
    firstListed_.push_back(static_cast<std::uint32_t>(listed_.size()));
    is = std::move(next);
  }
}

std::vector<glm::vec4> ConeVolume::radianceTexels(const VoxelVolume& volume,
                                                  RadianceMips::Directions directions) const {
  std::vector<glm::vec4> texels;
  texels.reserve(2 * source_.size());
  for (const ConeSource& source : source_) {
    VoxelRadiance r;
    glm::ivec3 toward(0);
    if (source.voxel != kNoSource) {
      r = volume.radiance()[source.voxel];
      toward = glm::ivec3(volume.axisOf(source.voxel));
    }
    glm::vec3 front = r.front(), back = r.back();
    if (directions == RadianceMips::Directions::one) front = back = glm::mix(back, front, source.front);
    const int longest = std::max({std::abs(toward.x), std::abs(toward.y), std::abs(toward.z)});
    const float depth = source.voxel == kNoSource ? kSolidDepth : depthOfWall(longest);
    const float axis = source.voxel == kNoSource ? 0.0f : static_cast<float>(packAxis(toward));
    texels.emplace_back(front, axis);
    texels.emplace_back(back, depth);
  }
  return texels;
}

std::vector<RelumeRsmVoxel> ConeVolume::rsmVoxels(const VoxelVolume& volume) const {
  const RsmTargets targets = findRsmTargets(volume);
  std::vector<RelumeRsmVoxel> voxels(source_.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const std::uint32_t from = source_[i].voxel;
    RelumeRsmVoxel& to = voxels[i];
    to = {0, kRelumeNone, kRelumeNone, source_[i].front, glm::vec4(0.0f), glm::vec4(0.0f)};
    if (from == kNoSource) continue;
    to.axis = packAxis(glm::ivec3(volume.axisOf(from)));
    to.front = targets.side[2 * std::size_t{from}];
    to.back = targets.side[2 * std::size_t{from} + 1];
    to.frontLight = glm::vec4(volume.emissionOfSide(2 * from), targets.perFlux[2 * std::size_t{from}]);
    to.backLight = glm::vec4(volume.emissionOfSide(2 * from + 1), targets.perFlux[2 * std::size_t{from} + 1]);
  }
  return voxels;
}

}  // namespace relume::gl
