// SPDX-License-Identifier: MIT
// See snap_triangles.h.
#include "runtime/voxels/snap_triangles.h"

#include "runtime/voxels/split_edges.h"
#include "runtime/voxels/step_place.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

using Corner = glm::ivec3;

bool isOutside(const SnapBox& box, const std::array<Corner, 3>& t) {
  for (int k = 0; k < 3; ++k) {
    if (std::max({t[0][k], t[1][k], t[2][k]}) < box.low[k] || std::min({t[0][k], t[1][k], t[2][k]}) > box.high[k])
      return true;
  }
  return false;
}

struct SplitSteps {
  bool isLong(const Corner& a, const Corner& b) const {
    const Corner d = glm::abs(b - a);
    if (d.x > kMaxEdge || d.y > kMaxEdge || d.z > kMaxEdge) return true;
    return d.x * d.x + d.y * d.y + d.z * d.z > kMaxEdge * kMaxEdge;
  }
  // The same for both directions of an edge.
  Corner middle(const Corner& a, const Corner& b) const {
    return {(a.x + b.x) >> 1, (a.y + b.y) >> 1, (a.z + b.z) >> 1};
  }
};

}  // namespace

bool isThere(float coverage, std::uint32_t triangle) {
  if (coverage >= 1.0f) return true;
  std::uint32_t hash = triangle * 2654435769u;
  hash ^= hash >> 15;
  hash *= 2246822519u;
  hash ^= hash >> 13;
  return static_cast<float>(hash >> 8) < coverage * 0x1p+24f;
}

bool snapTriangles(const VolumeGrid& grid, const SnapBox& box, const VoxelMesh& mesh,
                   std::span<const VoxelSurface> surfaces, const glm::mat4x3& toWorld, std::uint32_t begin,
                   std::uint32_t end, std::vector<SnappedTriangle>& snapped, SnapCounts& counts) {
  const StepPlace place = StepPlace::of(grid, toWorld);
  std::vector<std::array<Corner, 3>> stack;
  for (std::uint32_t t = begin; t < end; ++t) {
    if (!isThere(surfaces[mesh.surface[t]].coverage, t)) continue;
    const glm::uvec3& index = mesh.triangle[t];
    stack.push_back({place.stepsOf(mesh.position[index.x]),
                     place.stepsOf(mesh.position[place.mirrored ? index.z : index.y]),
                     place.stepsOf(mesh.position[place.mirrored ? index.y : index.z])});
    if (isOutside(box, stack.back())) ++counts.outside;
    bool isFirst = true;
    while (!stack.empty()) {
      const std::array<Corner, 3> now = stack.back();
      stack.pop_back();
      if (isOutside(box, now)) continue;
      if (splitOnce(SplitSteps{}, now, stack)) {
        counts.split += isFirst ? 1 : 0;
        isFirst = false;
        continue;
      }
      const glm::dvec3 n = glm::cross(glm::dvec3(now[1] - now[0]), glm::dvec3(now[2] - now[0]));
      const double length = glm::length(n);
      if (length == 0.0) {
        ++counts.zeroArea;
        continue;
      }
      SnappedTriangle& out = snapped.emplace_back();
      for (std::size_t c = 0; c < 3; ++c) {
        for (int k = 0; k < 3; ++k) out.corner[c][static_cast<std::size_t>(k)] = static_cast<std::int16_t>(now[c][k]);
      }
      for (int k = 0; k < 3; ++k)
        out.normal[static_cast<std::size_t>(k)] = static_cast<std::int8_t>(std::floor(127.0 * n[k] / length + 0.5));
      out.area = static_cast<std::uint32_t>(std::max(length, 1.0));
      out.surface = mesh.surface[t];
      if (snapped.size() > kMaxSnapped) return false;
    }
  }
  return true;
}

}  // namespace relume
