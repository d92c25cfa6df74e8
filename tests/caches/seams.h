// SPDX-License-Identifier: MIT
// Seams of the light map: edges of meshes whose two triangles lie on different charts though they look the same way.
// What both sides read there should be the same.
#pragma once

#include "relume/bake/scene.h"
#include "tests/caches/reads.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

namespace relume::test {

// A point of a seam, seen from both triangles of the same instance. Barycentrics in glTF order.
struct SeamPoint {
  std::uint32_t instance = 0;
  std::array<std::uint32_t, 2> triangle{};
  std::array<glm::vec2, 2> barycentric{};
  glm::vec3 positionWorld{0.0f}, normal{0.0f};
  float length = 0.0f;  // [m] of edge that the point stands for
};

// Points along all seams of front sides between triangles whose normals are less than maxAngle apart, where the
// coordinates of the two triangles differ. `step` [m]: distance of points.
inline std::vector<SeamPoint> findSeams(const Scene& scene, const Lightmap& map, float minCosine, float step) {
  struct Side {
    std::uint32_t triangle;
    int corner;  // the edge goes from this corner to the next
  };
  const auto key = [](const glm::vec3& p) { return std::tuple(p.x, p.y, p.z); };
  using Point = decltype(key(glm::vec3()));
  std::vector<SeamPoint> seams;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.mode != BakeMode::fixed) continue;
    const Mesh& mesh = scene.meshes[instance.mesh];
    std::map<std::pair<Point, Point>, std::vector<Side>> edges;
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const Point a = key(mesh.position[mesh.triangle[t][k]]), b = key(mesh.position[mesh.triangle[t][(k + 1) % 3]]);
        if (a != b) edges[{std::min(a, b), std::max(a, b)}].push_back({t, k});
      }
    }
    for (const auto& [ends, sides] : edges) {
      if (sides.size() != 2) continue;
      std::array<glm::vec3, 2> normal;
      std::array<std::array<std::uint32_t, 2>, 2> uv;
      std::array<bool, 2> turned{};
      bool lit = true;
      for (std::size_t s = 0; s < 2; ++s) {
        const std::uint32_t t = sides[s].triangle;
        normal[s] = geometricNormal(scene, {i, t, {0.3f, 0.3f}});
        const std::uint64_t first = map.parts[i].firstCorner + 3ull * t;
        const int a = sides[s].corner, b = (a + 1) % 3;
        turned[s] = key(mesh.position[mesh.triangle[t][a]]) != ends.first;
        uv[s] = {map.cornerUv[first + static_cast<std::uint64_t>(turned[s] ? b : a)],
                 map.cornerUv[first + static_cast<std::uint64_t>(turned[s] ? a : b)]};
        lit = lit && uv[s][0] != kGridLit && uv[s][1] != kGridLit;
      }
      if (!lit || glm::dot(normal[0], normal[1]) < minCosine || uv[0] == uv[1]) continue;
      const auto world = [&](const Point& p) {
        return glm::vec3(instance.toWorld * glm::vec4(std::get<0>(p), std::get<1>(p), std::get<2>(p), 1.0f));
      };
      const glm::vec3 a = world(ends.first), b = world(ends.second);
      const float length = glm::distance(a, b);
      const int count = std::clamp(static_cast<int>(length / step), 1, 64);
      for (int k = 0; k < count; ++k) {
        const float f = (static_cast<float>(k) + 0.5f) / static_cast<float>(count);
        SeamPoint p;
        p.instance = i;
        p.positionWorld = a + (b - a) * f;
        p.normal = glm::normalize(normal[0] + normal[1]);
        p.length = length / static_cast<float>(count);
        for (std::size_t s = 0; s < 2; ++s) {
          const float along = turned[s] ? 1.0f - f : f;
          std::array<float, 3> w{};
          w[static_cast<std::size_t>(sides[s].corner)] = 1.0f - along;
          w[static_cast<std::size_t>((sides[s].corner + 1) % 3)] = along;
          p.triangle[s] = sides[s].triangle;
          p.barycentric[s] = {w[1], w[2]};
        }
        seams.push_back(p);
      }
    }
  }
  return seams;
}

// How far apart the places are from which the two sides of seams take their light, root mean square and 95th percentile
// by length [m]; and the share of seam points that read the same caches.
struct SeamJump {
  double rms = 0.0, p95 = 0.0, same = 0.0, length = 0.0;
};

inline SeamJump measureSeams(const Caches& caches, const std::vector<SeamPoint>& seams) {
  SeamJump jump;
  std::vector<std::pair<float, float>> distances;
  for (const SeamPoint& p : seams) {
    const Read a = readLightmap(caches, p.instance, p.triangle[0], p.barycentric[0], false);
    const Read b = readLightmap(caches, p.instance, p.triangle[1], p.barycentric[1], false);
    const float d = glm::distance(a.position, b.position);
    distances.emplace_back(d, p.length);
    jump.rms += static_cast<double>(d * d * p.length);
    jump.same += d < 1e-4f ? static_cast<double>(p.length) : 0.0;
    jump.length += static_cast<double>(p.length);
  }
  if (distances.empty()) return jump;
  std::sort(distances.begin(), distances.end());
  double below = 0.0;
  for (const auto& [d, length] : distances) {
    below += static_cast<double>(length);
    jump.p95 = static_cast<double>(d);
    if (below > 0.95 * jump.length) break;
  }
  jump.rms = std::sqrt(jump.rms / jump.length);
  jump.same /= jump.length;
  return jump;
}

}  // namespace relume::test
