// SPDX-License-Identifier: MIT
// Cuts triangles into parts small enough for the voxels of seen_voxels.h, and visits the parts.
#pragma once

#include "bake/base/parallel.h"
#include "bake/visibility/voxel_tree.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace relume {

inline glm::vec3 pointOf(const std::array<glm::vec3, 3>& c, const glm::vec2& b) {
  return c[0] + (c[1] - c[0]) * b.x + (c[2] - c[0]) * b.y;
}

// Normal of the front, from the world-space corners; its length is twice the area.
inline glm::vec3 crossOf(const std::array<glm::vec3, 3>& c) { return glm::cross(c[1] - c[0], c[2] - c[0]); }

inline float areaOf(const std::array<glm::vec3, 3>& c) { return 0.5f * glm::length(crossOf(c)); }

// Scene::instanceOf() for triangles of which most are of the same instance as the one before.
class InstanceFinder {
 public:
  explicit InstanceFinder(const Scene& scene) : scene_(scene) {}
  std::uint32_t of(std::uint32_t triangle) {
    if (triangle < begin_ || triangle >= end_) {
      instance_ = scene_.instanceOf(triangle);
      const Instance& found = scene_.instances[instance_];
      begin_ = found.firstTriangle;
      end_ = begin_ + static_cast<std::uint32_t>(scene_.meshes[found.mesh].triangle.size());
    }
    return instance_;
  }

 private:
  const Scene& scene_;
  std::uint32_t instance_ = 0, begin_ = 0, end_ = 0;  // triangles of the instance
};

// Visit the scene-wide triangles [first, last) of baked instances that are `wanted`, in parallel: visit(instance,
// triangle, corners, area, memo). Triangles without area are left out. memo: a Memo of the visitor's own, made anew for
// each run of triangles that one thread visits.
template <class Memo, class Wanted, class Visit>
void forEachTriangle(const Scene& scene, std::size_t first, std::size_t last, Context& context, const Wanted& wanted,
                     const Visit& visit) {
  // Small chunks: large triangles, which have many parts, often follow one another.
  const std::size_t chunk = std::clamp<std::size_t>((last - first) / 256, 1, 128);
  parallelChunks(context, "", last - first, chunk, [&](std::size_t begin, std::size_t end) {
    InstanceFinder instances(scene);
    Memo memo;
    for (std::size_t t = first + begin; t < first + end; ++t) {
      const std::uint32_t i = instances.of(static_cast<std::uint32_t>(t));
      const Instance& instance = scene.instances[i];
      if (!instance.baked() || !wanted(i)) continue;
      const auto triangle = static_cast<std::uint32_t>(t) - instance.firstTriangle;
      const auto corners = scene.corners(instance, triangle);
      const float area = areaOf(corners);
      if (area > 0.0f && std::isfinite(area)) visit(i, triangle, corners, area, memo);
    }
  });
}

// The same for all baked instances, without a memo.
template <class Visit>
void forEachTriangle(const Scene& scene, std::size_t first, std::size_t last, Context& context, const Visit& visit) {
  struct None {};
  forEachTriangle<None>(
      scene, first, last, context, [](std::uint32_t) { return true; },
      [&](std::uint32_t i, std::uint32_t t, const auto& corners, float area, None&) { visit(i, t, corners, area); });
}

// A triangle cut into n² equal triangles, n along an edge, small enough for the voxels. A square of the barycentric
// plane has two of them: the centre of one is at (1/3, 1/3) of the square, the other's at (2/3, 2/3).
struct TriangleParts {
  static constexpr double kMax = 4194304.0;  // most parts along an edge
  static constexpr std::uint32_t kFew = 64;  // with fewer along an edge, the tree does not pay

  std::uint32_t along = 1;
  double count() const { return static_cast<double>(along) * along; }

  TriangleParts(float area, float voxelSize) {
    const float wanted = std::ceil(2.0f * std::sqrt(area) / voxelSize);
    along = static_cast<std::uint32_t>(std::clamp(static_cast<double>(wanted), 1.0, kMax));
  }

  // Barycentric centre of part k of a row, which has 2 (along - row) - 1 parts.
  glm::vec2 centre(std::uint32_t row, std::uint32_t k) const {
    const float inner = k % 2 == 0 ? 1.0f : 2.0f;
    if (along > 1024u) {  // floats could not tell neighbours apart
      const double third = 1.0 / (3.0 * along);
      return {third * (3.0 * (k / 2) + static_cast<double>(inner)), third * (3.0 * row + static_cast<double>(inner))};
    }
    const float third = 1.0f / (3.0f * static_cast<float>(along));
    return {third * (3.0f * static_cast<float>(k / 2) + inner), third * (3.0f * static_cast<float>(row) + inner)};
  }
};

// A block of squares of a triangle's barycentric plane.
struct PartBlock {
  std::uint32_t column, row, width;  // [squares]
};

// The box around a block. [m]
inline std::array<glm::vec3, 2> boxOf(const std::array<glm::vec3, 3>& corners, std::uint32_t along,
                                      const PartBlock& block) {
  const double each = 1.0 / along;
  glm::vec3 low(INFINITY), high(-INFINITY);
  for (std::uint32_t k = 0; k < 4; ++k) {
    const glm::vec2 b((block.column + (k & 1u) * block.width) * each, (block.row + (k >> 1) * block.width) * each);
    const glm::vec3 p = pointOf(corners, b);
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return {low, high};
}

// Visit blocks at most 8 squares wide, but only those whose box, and every box above, `meets(low, high)` says yes to.
template <class Meets, class Visit>
void forEachBlock(const std::array<glm::vec3, 3>& corners, std::uint32_t along, const Meets& meets,
                  const Visit& visit) {
  constexpr std::uint32_t kBlock = 8;
  std::vector<PartBlock> stack;
  stack.push_back({0, 0, std::bit_ceil(std::max(along, kBlock))});
  while (!stack.empty()) {
    const PartBlock block = stack.back();
    stack.pop_back();
    if (block.column + block.row >= along) continue;
    const auto [low, high] = boxOf(corners, along, block);
    if (!meets(low, high)) continue;
    if (block.width <= kBlock) {
      visit(block);
      continue;
    }
    const std::uint32_t half = block.width / 2;
    for (std::uint32_t k = 0; k < 4; ++k)
      stack.push_back({block.column + (k & 1u) * half, block.row + (k >> 1) * half, half});
  }
}

// Whether a triangle is over 32 times as long as it is wide. Equal parts of it would have that shape, too, and the box
// around each would meet voxels far away.
inline bool isNeedle(const std::array<glm::vec3, 3>& c, float area) {
  const glm::vec3 edge[3] = {c[1] - c[0], c[2] - c[1], c[0] - c[2]};
  float longest = 0.0f;
  for (const glm::vec3& e : edge) longest = std::max(longest, glm::dot(e, e));
  return longest > 64.0f * area;
}

// How far apart two floats of the largest of these coordinates are. [m] Finer parts would fall on one another.
inline float spacingOf(const std::array<glm::vec3, 3>& c) {
  const glm::vec3 most = glm::max(glm::abs(c[0]), glm::max(glm::abs(c[1]), glm::abs(c[2])));
  return std::max({most.x, most.y, most.z}) * std::numeric_limits<float>::epsilon();
}

// A needle's half: a right-angled triangle from its tip to the altitude on its longest edge. The rectangle
// [u0, u1] x [v0, v1] of it is cut out by two lines along the altitude and two through the tip.
struct NeedleHalf {
  glm::dvec3 tip, along, altitude;  // [m] from the tip to the altitude's foot, from there to its other end
  double share;                     // of the needle's area

  glm::dvec3 at(double u, double v) const { return tip + u * (along + v * altitude); }
};

inline std::array<NeedleHalf, 2> halvesOf(const std::array<glm::vec3, 3>& corners) {
  std::size_t k = 0;  // the longest edge goes from corner k to the next
  const auto lengthOf = [&](std::size_t i) { return glm::distance(corners[i], corners[(i + 1) % 3]); };
  for (std::size_t i = 1; i < 3; ++i) k = lengthOf(i) > lengthOf(k) ? i : k;
  const glm::dvec3 from(corners[k]), to(corners[(k + 1) % 3]), top(corners[(k + 2) % 3]), edge = to - from;
  const double t = std::clamp(glm::dot(top - from, edge) / glm::dot(edge, edge), 0.0, 1.0);
  const glm::dvec3 foot = from + t * edge;
  return {{{from, foot - from, top - foot, t}, {to, foot - to, top - foot, 1.0 - t}}};
}

// Asks a voxel tree about boxes of one triangle, and whether the run is cancelled, after which no box meets anything.
class TriangleInTree {
 public:
  TriangleInTree(const VoxelTree& tree, std::uint32_t instance, const glm::vec3& normal, const Context& context)
      : tree_(tree), instance_(instance), normal_(normal), context_(context) {}

  template <class... Box>
  bool meets(const Box&... box) {
    if (++asked_ % 4096 == 0 && context_.cancelled()) cancelled_ = true;
    return !cancelled_ && tree_.meets(instance_, normal_, box...);
  }

 private:
  const VoxelTree& tree_;
  std::uint32_t instance_;
  glm::vec3 normal_;
  const Context& context_;
  std::uint32_t asked_ = 0;
  bool cancelled_ = false;
};

// forEachPart() for a needle. Each half is cut across or along, whichever it is longer, until no part is longer than
// the equal parts of other triangles: unlike those, its parts differ in area.
template <class Visit>
void forEachPartOfNeedle(const std::array<glm::vec3, 3>& corners, float voxelSize, TriangleInTree& tree,
                         const Visit& visit) {
  struct Part {
    double u0, u1, v0, v1;
  };
  const double longest = 0.5 * std::max(voxelSize, 4.0f * spacingOf(corners));
  std::vector<Part> stack;
  for (const NeedleHalf& half : halvesOf(corners)) {
    const double along = glm::length(half.along), across = glm::length(half.altitude);
    stack.push_back({0.0, 1.0, 0.0, 1.0});
    while (!stack.empty()) {
      const Part part = stack.back();
      const auto [u0, u1, v0, v1] = part;
      stack.pop_back();
      glm::dvec3 low(INFINITY), high(-INFINITY);
      for (const glm::dvec3& p : {half.at(u0, v0), half.at(u0, v1), half.at(u1, v0), half.at(u1, v1)}) {
        low = glm::min(low, p);
        high = glm::max(high, p);
      }
      // Centres are rounded to floats once, as the box is.
      const glm::vec3 first(low), last(high);
      const glm::vec3 rounding = std::numeric_limits<float>::epsilon() * glm::max(glm::abs(first), glm::abs(last));
      if (!tree.meets(first, last, rounding)) continue;
      const double length = (u1 - u0) * along, width = (v1 - v0) * u1 * across;
      const double u = 0.5 * (u0 + u1), v = 0.5 * (v0 + v1);
      if (std::max(length, width) <= longest) {
        visit(glm::vec3(half.at(u, v)), half.share * (u1 * u1 - u0 * u0) * (v1 - v0));
      } else if (length > width) {
        stack.push_back({u0, u, v0, v1});
        stack.push_back({u, u1, v0, v1});
      } else {
        stack.push_back({u0, u1, v0, v});
        stack.push_back({u0, u1, v, v1});
      }
    }
  }
}

// Visit the centres of those parts of a triangle that may be in a voxel of the tree, or of all parts when the tree is
// empty: visit(position, weight). Returns the weight of all parts; a part's weight is in proportion to its area. Visits
// only some of them once the run is cancelled.
template <class Visit>
double forEachPart(const std::array<glm::vec3, 3>& corners, float area, float voxelSize, const VoxelTree& tree,
                   std::uint32_t instance, const Context& context, const Visit& visit) {
  const TriangleParts parts(area, voxelSize);
  const std::uint32_t n = parts.along;
  const auto visitRow = [&](std::uint32_t row, std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t k = 2 * begin; k < std::min(2 * end, 2 * (n - row) - 1); ++k)
      visit(pointOf(corners, parts.centre(row, k)), 1.0);
  };
  if (n < TriangleParts::kFew || tree.empty()) {
    for (std::uint32_t row = 0; row < n; ++row) visitRow(row, 0, n);
    return parts.count();
  }
  TriangleInTree inTree(tree, instance, crossOf(corners), context);
  if (isNeedle(corners, area)) {
    forEachPartOfNeedle(corners, voxelSize, inTree, visit);
    return 1.0;
  }
  forEachBlock(
      corners, n, [&](const glm::vec3& low, const glm::vec3& high) { return inTree.meets(low, high); },
      [&](const PartBlock& block) {
        for (std::uint32_t row = block.row; row < std::min(block.row + block.width, n); ++row)
          visitRow(row, block.column, block.column + block.width);
      });
  return parts.count();
}

}  // namespace relume
