// SPDX-License-Identifier: MIT
// See snap_triangles.h.
#include "runtime/voxels/snap_triangles.h"

#include "runtime/voxels/split_edges.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

using Corner = glm::ivec3;

// Of a triangle. A sliver of many grids' length has as many layers of pieces as it has lengths, each thinner than a
// step, and next to none with an area: what is beyond is left out. A triangle that fills a grid has some three
// thousand.
constexpr std::uint32_t kMaxPiecesLookedAt = 1u << 17;

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

TriangleSnapper::TriangleSnapper(const VolumeGrid& grid, const SnapBox& box, const glm::mat4x3& toWorld)
    : place_(StepPlace::of(grid, toWorld)), box_(box) {}

bool TriangleSnapper::isOutside(const std::array<Corner, 3>& t) const {
  for (int k = 0; k < 3; ++k) {
    if (std::max({t[0][k], t[1][k], t[2][k]}) < box_.low[k] || std::min({t[0][k], t[1][k], t[2][k]}) > box_.high[k])
      return true;
  }
  return false;
}

bool TriangleSnapper::add(const std::array<Corner, 3>& corners, std::uint32_t surface,
                          std::vector<SnappedTriangle>& snapped, SnapCounts& counts) {
  if (isOutside(corners)) {
    ++counts.outside;
    return true;
  }
  stack_.assign(1, corners);
  if (place_.mirrored) std::swap(stack_.back()[1], stack_.back()[2]);
  bool isFirst = true;
  for (std::uint32_t looked = 0; !stack_.empty() && looked < kMaxPiecesLookedAt; ++looked) {
    const std::array<Corner, 3> now = stack_.back();
    stack_.pop_back();
    if (isOutside(now)) continue;
    if (splitOnce(SplitSteps{}, now, stack_)) {
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
    out.surface = surface;
    if (snapped.size() > kMaxSnapped) return false;
  }
  return true;
}

bool snapTriangles(const VolumeGrid& grid, const SnapBox& box, const VoxelMesh& mesh, const glm::mat4x3& toWorld,
                   std::vector<SnappedTriangle>& snapped, SnapCounts& counts) {
  TriangleSnapper snapper(grid, box, toWorld);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const glm::uvec3& index = mesh.triangle[t];
    if (!snapper.add({snapper.stepsOf(mesh.position[index.x]), snapper.stepsOf(mesh.position[index.y]),
                      snapper.stepsOf(mesh.position[index.z])},
                     mesh.surface[t], snapped, counts))
      return false;
  }
  return true;
}

}  // namespace relume
