// SPDX-License-Identifier: MIT
// Small levels for the tests of voxels and live light.
#pragma once

#include "runtime/voxels/voxel_volume.h"
#include "tests/on_threads.h"

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

namespace relume::test {

// A level that owns its arrays.
struct VoxelLevel {
  std::vector<VoxelSurface> surfaces = std::vector<VoxelSurface>(1);
  struct Mesh {
    std::vector<glm::vec3> position;
    std::vector<glm::uvec3> triangle;
    std::vector<std::uint32_t> surface;
  };
  std::vector<Mesh> meshes;
  std::vector<VoxelPart> parts;
  std::vector<VoxelMesh> views;

  VoxelGeometry geometry() {
    views.clear();
    for (const Mesh& mesh : meshes) views.push_back({mesh.position, mesh.triangle, mesh.surface});
    return {surfaces, views, parts};
  }

  // A part of its own. Corners counter-clockwise as seen from the front.
  Mesh& addQuad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d,
                std::uint32_t surface = 0) {
    parts.push_back({static_cast<std::uint32_t>(meshes.size()), glm::mat4x3(1.0f), false});
    meshes.push_back({{a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}, {surface, surface}});
    return meshes.back();
  }

  // A box whose fronts face inward or outward, one part.
  void addBox(const glm::vec3& low, const glm::vec3& high, bool inward, std::uint32_t surface = 0) {
    Mesh mesh;
    for (unsigned i = 0; i < 8; ++i)
      mesh.position.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
    const glm::uvec4 outward[6] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const glm::uvec4& f : outward) {
      mesh.triangle.push_back(inward ? glm::uvec3(f.x, f.z, f.y) : glm::uvec3(f.x, f.y, f.z));
      mesh.triangle.push_back(inward ? glm::uvec3(f.x, f.w, f.z) : glm::uvec3(f.x, f.z, f.w));
    }
    mesh.surface.assign(12, surface);
    parts.push_back({static_cast<std::uint32_t>(meshes.size()), glm::mat4x3(1.0f), false});
    meshes.push_back(std::move(mesh));
  }
};

// A uniformly distributed unit vector.
inline glm::vec3 unit(std::mt19937& random) {
  std::normal_distribution<float> normal;
  return glm::normalize(glm::vec3(normal(random), normal(random), normal(random)) + 1e-6f);
}

}  // namespace relume::test
