// SPDX-License-Identifier: MIT
// What the tests of voxels in OpenGL share: a context with voxels in it, grids, and a level in which parts move.
#pragma once

#include "runtime/live_gl/voxels_gl.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/voxels/boxes.h"

#include <glm/geometric.hpp>

#include <bit>
#include <cstdint>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace relume::test {

class VoxelsOnGl : public GlTest {
 protected:
  static VoxelsGl made(const VoxelGeometry& geometry, const VolumeGrid& grid,
                       std::optional<gpu::GroupThreads> groups = {}) {
    auto voxels = VoxelsGl::create(geometry, grid, {EglContext::getProcAddress, groups});
    EXPECT_TRUE(voxels) << voxels.error().message;
    return std::move(*voxels);
  }
};

using Bits = std::vector<std::uint64_t>;

inline std::size_t countOf(const Bits& bits) {
  std::size_t sum = 0;
  for (const std::uint64_t brick : bits) sum += static_cast<std::size_t>(std::popcount(brick));
  return sum;
}

inline glm::mat4x3 someTurn(std::mt19937& random, float scale, const glm::vec3& to) {
  const glm::vec3 a = unit(random), b = glm::normalize(glm::cross(a, unit(random)));
  return {scale * a, scale * b, scale * glm::cross(a, b), to};
}

inline VolumeGrid gridOf(int cells, float voxel, const glm::vec3& origin = glm::vec3(0.0f)) {
  VolumeGrid grid;
  grid.cells = glm::ivec3(cells);
  grid.voxel = voxel;
  grid.originWorld = origin;
  return grid;
}

// A part of triangles with corners around random places, of up to so many metres.
inline void addTriangles(VoxelLevel& level, std::mt19937& random, std::uint32_t count, float extent, float size,
                         bool moves = false) {
  VoxelLevel::Mesh mesh;
  std::uniform_real_distribution<float> place(-0.05f * extent, 1.05f * extent), off(-size, size);
  for (std::uint32_t t = 0; t < count; ++t) {
    const glm::vec3 at(place(random), place(random), place(random));
    for (int c = 0; c < 3; ++c) mesh.position.push_back(at + glm::vec3(off(random), off(random), off(random)));
    // Along axes, and on corners of voxels, where rounding decides.
    if (t % 5 == 0) mesh.position.back().y = mesh.position[mesh.position.size() - 2].y = at.y;
    if (t % 7 == 0) mesh.position.back() = glm::floor(mesh.position.back());
    mesh.triangle.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    mesh.surface.push_back(t % static_cast<std::uint32_t>(level.surfaces.size()));
  }
  level.parts.push_back({static_cast<std::uint32_t>(level.meshes.size()), glm::mat4x3(1.0f), moves});
  level.meshes.push_back(std::move(mesh));
}

// A room in which two parts move, of many triangles and of a few large ones.
inline VoxelLevel movingLevel() {
  VoxelLevel level;
  std::mt19937 random(8);
  level.addBox({0, 0, 0}, {16, 16, 16}, true);
  level.addBox({2, 2, 2}, {5, 9, 5}, false);
  addTriangles(level, random, 800, 1.0f, 0.3f, true);
  level.addBox({-2, -0.1f, -3}, {2, 0.1f, 3}, false);
  level.parts.back().moves = true;
  return level;
}

}  // namespace relume::test
