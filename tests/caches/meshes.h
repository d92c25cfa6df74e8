// SPDX-License-Identifier: MIT
// Small meshes and scenes with known answers.
#pragma once

#include "bake/caches/caches.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace relume::test {

inline void addTriangle(Mesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  mesh.position.insert(mesh.position.end(), {a, b, c});
  mesh.triangle.emplace_back(first, first + 1, first + 2);
}

// Counter-clockwise around a, b, c, d.
inline void addQuad(Mesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
  addTriangle(mesh, a, b, c);
  addTriangle(mesh, a, c, d);
}

// A box with fronts outside, or inside.
inline void addBox(Mesh& mesh, const glm::vec3& low, const glm::vec3& high, bool inside) {
  const auto corner = [&](int i) {
    return glm::vec3(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
  };
  constexpr int kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : kFaces) {
    if (inside)
      addQuad(mesh, corner(f[3]), corner(f[2]), corner(f[1]), corner(f[0]));
    else
      addQuad(mesh, corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]));
  }
}

// Latitudes and longitudes.
inline Mesh sphere(float radius, int rings, int sectors) {
  Mesh mesh;
  const auto point = [&](int ring, int sector) {
    const float theta = std::numbers::pi_v<float> * static_cast<float>(ring) / static_cast<float>(rings);
    const float phi =
        2.0f * std::numbers::pi_v<float> * static_cast<float>(sector % sectors) / static_cast<float>(sectors);
    const float r = ring == 0 || ring == rings ? 0.0f : radius * std::sin(theta);
    return glm::vec3(r * std::cos(phi), radius * std::cos(theta), -r * std::sin(phi));
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      if (i + 1 < rings) addTriangle(mesh, point(i, j), point(i + 1, j), point(i + 1, j + 1));
      if (i > 0) addTriangle(mesh, point(i, j), point(i + 1, j + 1), point(i, j + 1));
    }
  }
  return mesh;
}

inline std::uint32_t addInstance(Scene& scene, Mesh mesh, const std::string& node,
                                 const glm::mat4& toWorld = glm::mat4(1.0f)) {
  Instance instance;
  instance.node = node;
  instance.nodeIndex = static_cast<std::uint32_t>(scene.instances.size());
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size());
  instance.toWorld = toWorld;
  instance.flipped = glm::determinant(toWorld) < 0.0f;
  instance.firstTriangle = scene.triangleCount();
  scene.meshes.push_back(std::move(mesh));
  scene.instances.push_back(instance);
  return static_cast<std::uint32_t>(scene.instances.size() - 1);
}

}  // namespace relume::test
