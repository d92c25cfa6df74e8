// SPDX-License-Identifier: MIT
// See surface_hash.h. The sum of the triangles' hashes is the same in any order.
#include "bake/scene/surface_hash.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>

namespace relume {
namespace {

using Corner = std::array<std::uint32_t, 6>;  // bits of position and normal

Corner cornerOf(const Mesh& mesh, std::uint32_t vertex, bool normals) {
  Corner corner{};
  for (int k = 0; k < 3; ++k) {
    corner[static_cast<std::size_t>(k)] = std::bit_cast<std::uint32_t>(mesh.position[vertex][k]);
    if (normals) corner[static_cast<std::size_t>(3 + k)] = std::bit_cast<std::uint32_t>(mesh.normal[vertex][k]);
  }
  return corner;
}

}  // namespace

std::uint64_t hashSurface(const Mesh& mesh) {
  const bool normals = !mesh.normal.empty() && !mesh.normalsRepaired;
  std::uint64_t sum = normals ? 1 : 0;
  for (const glm::uvec3& t : mesh.triangle) {
    std::array<Corner, 3> corners = {cornerOf(mesh, t.x, normals), cornerOf(mesh, t.y, normals),
                                     cornerOf(mesh, t.z, normals)};
    // Begin at the smallest corner; when two are equal, at the one that makes the whole triangle smallest.
    std::array<Corner, 3> smallest = corners;
    for (int turn = 0; turn < 2; ++turn) {
      std::rotate(corners.begin(), corners.begin() + 1, corners.end());
      smallest = std::min(smallest, corners);
    }
    sum += XXH3_64bits(smallest.data(), sizeof smallest);
  }
  return sum;
}

}  // namespace relume
