// SPDX-License-Identifier: MIT
// See snap_corners.h. Caches do not lie at the centres of their texels: at borders they move toward the surface that is
// there, and shared ones lie elsewhere altogether. With P(u) the bilinear mean of the caches' positions at coordinate
// u, a corner at x takes the u that minimises
//   |P(u) - x|² + kStay texelSize² |u - u_0|²
// near its own u_0, by Gauss-Newton steps. Light that changes linearly in space is then read without error at corners,
// and alike by all charts that meet at one. Corners of triangles larger than texels stay where they are: what the
// triangle reads between them would move.
#include "bake/caches/lightmap/snap_corners.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

namespace relume {
namespace {

constexpr float kStay = 0.05f;
constexpr float kMaxMove = 1.0f;  // [texel]
constexpr int kSteps = 4;
// [texel] Corners of triangles up to the first length move freely, those from the second length on not at all.
constexpr float kFree = 1.5f, kFixed = 4.0f;

class Snapper {
 public:
  Snapper(const SharedCaches& shared, float texelSize, const SnapTexels& texels, const glm::vec2& low,
          const glm::vec2& high)
      : shared_(shared), texels_(texels), low_(low), high_(high), stay_(kStay * texelSize * texelSize) {}

  glm::vec2 snap(const glm::vec2& start, const glm::vec3& x, float maxMove) const {
    glm::vec2 u = start;
    float cost = costOf(u, start, x);
    for (int step = 0; step < kSteps; ++step) {
      // Take differences over half a texel, which smooths the kinks at texel centres.
      constexpr float kH = 0.25f;
      const glm::vec3 p = read(u);
      const glm::vec3 du = (read(u + glm::vec2(kH, 0)) - read(u - glm::vec2(kH, 0))) / (2.0f * kH);
      const glm::vec3 dv = (read(u + glm::vec2(0, kH)) - read(u - glm::vec2(0, kH))) / (2.0f * kH);
      const float a = glm::dot(du, du) + stay_, b = glm::dot(du, dv), c = glm::dot(dv, dv) + stay_;
      const glm::vec2 right(glm::dot(du, x - p) - stay_ * (u.x - start.x),
                            glm::dot(dv, x - p) - stay_ * (u.y - start.y));
      const float determinant = a * c - b * b;
      if (!(determinant > 0.0f)) break;
      const glm::vec2 move = glm::vec2(c * right.x - b * right.y, a * right.y - b * right.x) / determinant;
      bool better = false;
      for (float part = 1.0f; part > 0.2f && !better; part *= 0.5f) {
        const glm::vec2 next = glm::clamp(
            start + glm::clamp(u + part * move - start, glm::vec2(-maxMove), glm::vec2(maxMove)), low_, high_);
        const float nextCost = costOf(next, start, x);
        if (nextCost >= cost) continue;
        u = next;
        cost = nextCost;
        better = true;
      }
      if (!better) break;
    }
    return u;
  }

 private:
  glm::vec3 read(glm::vec2 u) const {
    u = glm::clamp(u, low_, high_);
    const glm::uvec2 base(u);
    const glm::vec2 f = u - glm::vec2(base);
    glm::vec3 mean(0.0f);
    float total = 0.0f;
    for (std::uint32_t k = 0; k < 4; ++k) {
      const float w = (k & 1 ? f.x : 1.0f - f.x) * (k & 2 ? f.y : 1.0f - f.y);
      const std::uint32_t x = std::min(base.x + (k & 1), texels_.atlas.x - 1),
                          y = std::min(base.y + (k >> 1), texels_.atlas.y - 1);
      const std::uint32_t cache = texels_.cache[std::size_t{y} * texels_.atlas.x + x];
      if (cache == kNoCache || !(w > 0.0f)) continue;
      mean += w * shared_.caches[cache].positionWorld;
      total += w;
    }
    return total > 0.0f ? mean / total : mean;
  }

  float costOf(const glm::vec2& u, const glm::vec2& start, const glm::vec3& x) const {
    const glm::vec3 away = read(u) - x;
    return glm::dot(away, away) + stay_ * glm::dot(u - start, u - start);
  }

  const SharedCaches& shared_;
  const SnapTexels& texels_;
  const glm::vec2 low_, high_;
  const float stay_;
};

}  // namespace

void snapCorners(const Scene& scene, const Patch& patch, const Chart& chart, const SharedCaches& shared,
                 float texelSize, const SnapTexels& texels, const glm::vec2& low, const glm::vec2& high,
                 std::span<glm::vec2> corner) {
  const Instance& instance = scene.instances[patch.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const Snapper snapper(shared, texelSize, texels, low, high);

  // Sort the corners by position and coordinate, which puts equal ones next to each other.
  const auto positionOf = [&](std::size_t i) {
    return mesh.position[mesh.triangle[chart.triangle[i / 3]][static_cast<int>(i % 3)]];
  };
  std::vector<std::uint32_t> order(corner.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto key = [&](std::uint32_t i) {
    const glm::vec3 p = positionOf(i);
    return std::tuple(p.x, p.y, p.z, corner[i].x, corner[i].y);
  };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<glm::vec2> moved(corner.begin(), corner.end());
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    float longest = 0.0f;  // [texel] of the triangles around
    for (; end < order.size() && key(order[end]) == key(order[begin]); ++end) {
      const std::size_t first = order[end] / 3 * 3;
      for (std::size_t k = 0; k < 3; ++k)
        longest = std::max(longest, glm::distance(corner[first + k], corner[first + (k + 1) % 3]));
    }
    const float maxMove = kMaxMove * std::clamp((kFixed - longest) / (kFixed - kFree), 0.0f, 1.0f);
    if (!(maxMove > 0.0f)) continue;
    const glm::vec3 x(instance.toWorld * glm::vec4(positionOf(order[begin]), 1.0f));
    const glm::vec2 u = snapper.snap(corner[order[begin]], x, maxMove);
    for (std::size_t i = begin; i < end; ++i) moved[order[i]] = u;
  }
  std::copy(moved.begin(), moved.end(), corner.begin());
}

}  // namespace relume
