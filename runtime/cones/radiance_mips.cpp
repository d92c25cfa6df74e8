// SPDX-License-Identifier: MIT
// See radiance_mips.h.
#include "runtime/cones/radiance_mips.h"

#include "runtime/cones/cone_march.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>

namespace relume {
namespace {

constexpr float kEdgeOn = 0.1f;     // share of its depth that a voxel has for rays along its surface
constexpr std::uint32_t kRows = 8;  // of a chunk

// What a ray sees of something that is partly opaque.
struct Seen {
  glm::vec3 light{0.0f};  // radiance times opacity
  float opacity = 0.0f;
};

Seen seenThrough(const glm::vec4& depth) {
  if (!(depth.w > 0.0f)) return {};
  const float opacity = -std::expm1(-depth.w);
  return {glm::vec3(depth) * (opacity / depth.w), opacity};
}

glm::vec4 depthOf(const Seen& seen) {
  if (!(seen.opacity > 0.0f)) return glm::vec4(0.0f);
  const float depth = std::min(-std::log1p(-std::min(seen.opacity, 0.9999f)), kSolidDepth);
  return {seen.light * (depth / seen.opacity), depth};
}

// The nearer before the farther.
Seen behind(const Seen& near, const Seen& far) {
  return {near.light + (1.0f - near.opacity) * far.light, near.opacity + (1.0f - near.opacity) * far.opacity};
}

// A ray's direction along an axis, of the six: +x, -x, +y, -y, +z, -z.
glm::vec3 axisOf(std::uint32_t direction) {
  glm::vec3 axis(0.0f);
  axis[static_cast<int>(direction / 2)] = direction % 2 == 0 ? 1.0f : -1.0f;
  return axis;
}

float wallDepth(const VoxelVolume& volume, std::uint32_t side) {
  const glm::ivec3 axis = glm::abs(glm::ivec3(volume.axisOf(side / 2)));
  return depthOfWall(std::max({axis.x, axis.y, axis.z}));
}

// What a ray of a direction sees of an occupied voxel; with one direction for all, the mean of its sides by their
// areas.
glm::vec4 ofVoxel(const VoxelVolume& volume, std::span<const float> areas, const glm::ivec3& voxel,
                  const glm::vec3& direction, bool sides) {
  const std::uint32_t side = volume.sideAt(voxel, direction);
  if (side == kNoSide) return {0.0f, 0.0f, 0.0f, kSolidDepth};
  const VoxelRadiance& r = volume.radiance()[side / 2];
  const float depth = wallDepth(volume, side);
  if (sides) return {depth * r.of(side), depth};
  const float a = areas[side & ~1u], b = areas[side | 1u];
  return {depth * glm::mix(r.back(), r.front(), a + b > 0.0f ? a / (a + b) : 0.5f), depth};
}

// What a ray along one of the six directions sees of an occupied voxel. A surface that it runs along covers next to
// nothing of its view, and which of the sides it is on does not say: less by the cosine, and of a surface that has one
// side alone that side.
glm::vec4 ofVoxelAlong(const VoxelVolume& volume, const glm::ivec3& voxel, std::uint32_t direction) {
  const std::uint32_t side = volume.sideAt(voxel, axisOf(direction));
  if (side == kNoSide) return {0.0f, 0.0f, 0.0f, kSolidDepth};
  const VoxelRadiance& r = volume.radiance()[side / 2];
  const glm::ivec3 axis(volume.axisOf(side / 2));
  const float cosine = static_cast<float>(std::abs(axis[static_cast<int>(direction / 2)])) / 127.0f,
              depth = wallDepth(volume, side) * std::max(cosine, kEdgeOn);
  const auto of = [&r](std::uint32_t s) { return r.of(s); };
  const bool isBack = volume.meetsBack(voxel, axisOf(direction));
  return {depth * glm::mix(of(isBack ? side ^ 1u : side), of(side), cosine), depth};
}

// Whether a place is before the opposite side of a voxel rather than before the side that a ray of this direction
// meets.
bool isBehind(const VoxelVolume& volume, const glm::ivec3& voxel, const glm::vec3& direction, const glm::vec3& place) {
  const std::uint32_t side = volume.sideAt(voxel, direction);
  if (side == kNoSide) return false;
  const std::array<SideAt, 2> both = volume.sidesAt(voxel);
  const auto before = [&](const SideAt& at) { return glm::dot(place - at.place(), at.side.normal); };
  return before(both[side % 2]) < before(both[1 - side % 2]);
}

// The 2 x 2 x 2 parts of a voxel, seen along one of six directions: the mean of four columns.
glm::vec4 alongAxis(const std::array<glm::vec4, 8>& part, std::uint32_t direction) {
  const std::uint32_t axis = direction / 2, bit = 1u << axis;
  Seen sum;
  for (std::uint32_t i = 0; i < 8; ++i) {
    if ((i & bit) != 0) continue;
    const Seen low = seenThrough(part[i]), high = seenThrough(part[i | bit]);
    const Seen column = direction % 2 == 0 ? behind(low, high) : behind(high, low);
    sum.light += 0.25f * column.light;
    sum.opacity += 0.25f * column.opacity;
  }
  return depthOf(sum);
}

glm::vec4 meanOf(const std::array<glm::vec4, 8>& part) {
  Seen sum;
  for (const glm::vec4& p : part) {
    const Seen seen = seenThrough(p);
    sum.light += 0.125f * seen.light;
    sum.opacity += 0.125f * seen.opacity;
  }
  return depthOf(sum);
}

// The eight corners around a place between the middles of voxels, and their weights.
struct Corners {
  glm::ivec3 low{0};
  glm::vec3 fraction{0.0f};

  explicit Corners(const glm::vec3& place) {
    const glm::vec3 p = place - 0.5f, floor = glm::floor(p);
    low = glm::ivec3(floor);
    fraction = p - floor;
  }
  glm::ivec3 at(int i) const { return low + glm::ivec3(i & 1, i >> 1 & 1, i >> 2); }
  float weight(int i) const {
    return ((i & 1) != 0 ? fraction.x : 1.0f - fraction.x) * ((i & 2) != 0 ? fraction.y : 1.0f - fraction.y) *
           ((i & 4) != 0 ? fraction.z : 1.0f - fraction.z);
  }
};

std::size_t indexIn(const glm::ivec3& size, const glm::ivec3& v) {
  return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(v.y)) *
             static_cast<std::size_t>(size.x) +
         static_cast<std::size_t>(v.x);
}

bool isInside(const glm::ivec3& size, const glm::ivec3& v) {
  return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < size.x && v.y < size.y && v.z < size.z;
}

}  // namespace

// What to read of a voxel for a direction: three of six, by the squares of its components.
struct RadianceMips::View {
  std::array<std::uint32_t, 3> index{};
  std::array<float, 3> weight{};
  std::uint32_t count = 1;

  View(Directions directions, const glm::vec3& direction) {
    weight[0] = 1.0f;
    if (directions == Directions::one) return;
    count = 3;
    for (std::uint32_t a = 0; a < 3; ++a) {
      const float d = direction[static_cast<int>(a)];
      index[a] = 2 * a + (d < 0.0f ? 1 : 0);
      weight[a] = d * d;
    }
  }
};

Status RadianceMips::update(const VoxelVolume& volume) {
  Stopwatch watch;
  const std::uint32_t per = perVoxel();
  try {
    // Sizes
    std::vector<glm::ivec3> sizes;
    for (glm::ivec3 size = volume.grid().voxels(); std::max({size.x, size.y, size.z}) > 1;)
      sizes.push_back(size = (size + 1) / 2);
    areas_ = per > 1 ? std::vector<float>() : volume.areas();
    levels_.resize(sizes.size());
    for (std::size_t l = 0; l < sizes.size(); ++l) {
      levels_[l].size = sizes[l];
      levels_[l].voxel.resize(indexIn(sizes[l], {0, 0, sizes[l].z}) * per);
    }
  } catch (const std::bad_alloc&) {
    levels_.clear();
    return Error{ErrorCode::memory, "cones: memory ran out; fewer cells take less"};
  }

  // Each level from the one below
  const VolumeGrid& grid = volume.grid();
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    Level& level = levels_[l];
    const auto rows = static_cast<std::uint32_t>(level.size.y * level.size.z);
    forChunks(volume.parallelFor(), rows, kRows, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t row = begin; row < end; ++row) {
        glm::ivec3 v(0, static_cast<int>(row) % level.size.y, static_cast<int>(row) / level.size.y);
        for (; v.x < level.size.x; ++v.x) {
          glm::vec4* const to = level.voxel.data() + indexIn(level.size, v) * per;
          std::fill_n(to, per, glm::vec4(0.0f));
          if (l == 0 && volume.bits()[grid.cellIndex(v / 2)] == 0) continue;
          for (std::uint32_t d = 0; d < per; ++d) {
            std::array<glm::vec4, 8> part{};
            bool empty = true;
            for (int i = 0; i < 8; ++i) {
              const glm::ivec3 child = 2 * v + glm::ivec3(i & 1, i >> 1 & 1, i >> 2);
              auto& p = part[static_cast<std::size_t>(i)];
              if (l > 0) {
                const Level& below = levels_[l - 1];
                if (isInside(below.size, child)) p = below.voxel[indexIn(below.size, child) * per + d];
              } else if (volume.bits()[grid.cellOf(child)] >> brickBit(child) & 1u) {
                p = per > 1 ? ofVoxelAlong(volume, child, d) : ofVoxel(volume, areas_, child, axisOf(d), false);
              }
              empty = empty && p.w == 0.0f;
            }
            if (empty) {
              if (l == 0) break;
              continue;
            }
            to[d] = per == 1 ? meanOf(part) : alongAxis(part, d);
          }
        }
      }
    });
  }
  ms_ = watch.lap();
  return done();
}

glm::vec4 RadianceMips::readVoxels(const VoxelVolume& volume, const glm::vec3& place, const glm::vec3& direction,
                                   const glm::vec3* before) const {
  const Corners corners(place);
  const VolumeGrid& grid = volume.grid();
  glm::vec4 sum(0.0f);
  // Most places lie within one brick, and most bricks are empty.
  const glm::ivec3 last = corners.low + 1;
  const bool within = grid.holds(corners.low) && grid.holds(last);
  if (within && corners.low.x >> 2 == last.x >> 2 && corners.low.y >> 2 == last.y >> 2 &&
      corners.low.z >> 2 == last.z >> 2 && volume.bits()[grid.cellOf(last)] == 0)
    return sum;
  for (int i = 0; i < 8; ++i) {
    const glm::ivec3 v = corners.at(i);
    if (!within && !grid.holds(v)) continue;
    if ((volume.bits()[grid.cellOf(v)] >> brickBit(v) & 1u) == 0) continue;
    if (before != nullptr && isBehind(volume, v, direction, *before)) continue;
    sum += corners.weight(i) * ofVoxel(volume, areas_, v, direction, perVoxel() > 1);
  }
  return sum;
}

glm::vec4 RadianceMips::readLevel(const Level& level, const glm::vec3& place, const View& view) const {
  const Corners corners(place);
  glm::vec4 sum(0.0f);
  for (int i = 0; i < 8; ++i) {
    const glm::ivec3 v = corners.at(i);
    if (!isInside(level.size, v)) continue;
    const glm::vec4* const from = level.voxel.data() + indexIn(level.size, v) * perVoxel();
    const float weight = corners.weight(i);
    for (std::uint32_t k = 0; k < view.count; ++k) sum += weight * view.weight[k] * from[view.index[k]];
  }
  return sum;
}

glm::vec4 RadianceMips::readAt(const VoxelVolume& volume, float level, const glm::vec3& place,
                               const glm::vec3& direction, const View& view, const glm::vec3* before) const {
  const float clamped = std::clamp(level, 0.0f, static_cast<float>(levels_.size()));
  const auto below = static_cast<std::size_t>(clamped);
  const float above = clamped - static_cast<float>(below);
  const auto at = [&](std::size_t l) {
    return l == 0 ? readVoxels(volume, place, direction, before)
                  : readLevel(levels_[l - 1], place / static_cast<float>(1u << l), view);
  };
  return above > 0.0f ? glm::mix(at(below), at(below + 1), above) : at(below);
}

glm::vec4 RadianceMips::read(const VoxelVolume& volume, float level, const glm::vec3& place, const glm::vec3& direction,
                             const glm::vec3* before) const {
  return readAt(volume, level, place, direction, View(directions_, direction), before);
}

ConeLight RadianceMips::trace(const VoxelVolume& volume, const Cone& cone) const {
  if (!isValidCone(cone)) return {};
  const VolumeGrid& grid = volume.grid();
  // Lengths are in voxels from here on.
  const float cosine = glm::dot(cone.direction, cone.normal);
  const glm::vec3 origin = grid.toGrid(cone.originWorld);
  float t = 0.0f, end = std::numeric_limits<float>::infinity();
  clipToGrid(grid, origin, cone.direction, t, end);
  const float widest = static_cast<float>(1u << levels_.size());
  const View view(directions_, cone.direction);

  ConeLight light;
  while (t < end && light.clear > kConeSpent) {
    const float width = std::clamp(t * std::min(cone.spread, cosine / kConePlane), 1.0f, widest);
    const float step = std::min(kConeStep * width, end - t), middle = t + 0.5f * step;
    t += kConeStep * width;
    // Until the cone is clear of the voxels of its own surface it slides along that.
    const glm::vec3 place =
        origin + middle * cone.direction + std::max(0.0f, kConeClear - middle * cosine) * cone.normal;
    const glm::vec4 depth = readAt(volume, width > 1.0f ? std::log2(width) : 0.0f, place, cone.direction, view,
                                   middle < kConeNear ? &origin : nullptr);
    if (!(depth.w > 0.0f)) continue;
    const float blocked = light.clear * -std::expm1(-depth.w * step / width);
    light.radiance += (blocked / depth.w) * glm::vec3(depth);
    light.occlusion += blocked / (1.0f + cone.falloff * middle * grid.voxel);
    light.clear -= blocked;
  }
  return endedCone(light);
}

std::size_t RadianceMips::sizeBytes() const {
  std::size_t bytes = areas_.size() * sizeof(float);
  for (const Level& level : levels_) bytes += level.voxel.size() * sizeof(glm::vec4);
  return bytes;
}

}  // namespace relume
