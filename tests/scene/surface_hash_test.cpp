// SPDX-License-Identifier: MIT
// The hash of a surface: blind to how a mesh is stored, awake to every bit of where it is.
#include "bake/scene/surface_hash.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

// A wavy sheet of n x n squares, whose vertices are shared.
Mesh makeSheet(std::uint32_t n) {
  Mesh mesh;
  for (std::uint32_t z = 0; z <= n; ++z) {
    for (std::uint32_t x = 0; x <= n; ++x) {
      const float u = static_cast<float>(x), v = static_cast<float>(z);
      mesh.position.emplace_back(u, std::sin(u) * std::cos(v), v);
      mesh.normal.push_back(glm::normalize(glm::vec3(-std::cos(u), 1.0f, std::sin(v))));
    }
  }
  for (std::uint32_t z = 0; z < n; ++z) {
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t a = z * (n + 1) + x, below = a + n + 1;
      mesh.triangle.emplace_back(a, below, a + 1);
      mesh.triangle.emplace_back(a + 1, below, below + 1);
    }
  }
  return mesh;
}

// Every corner with a vertex of its own, the last triangle first.
Mesh splitAndReversed(const Mesh& mesh) {
  Mesh out = mesh;
  out.position.clear();
  out.normal.clear();
  out.triangle.clear();
  for (auto t = mesh.triangle.rbegin(); t != mesh.triangle.rend(); ++t) {
    const auto first = static_cast<std::uint32_t>(out.position.size());
    for (const std::uint32_t v : {t->y, t->z, t->x}) {
      out.position.push_back(mesh.position[v]);
      out.normal.push_back(mesh.normal[v]);
    }
    out.triangle.emplace_back(first, first + 1, first + 2);
  }
  return out;
}

TEST(SurfaceHash, isBlindToHowAMeshIsStored) {
  const Mesh mesh = makeSheet(5);
  EXPECT_EQ(hashSurface(splitAndReversed(mesh)), hashSurface(mesh));
  // Two corners of a triangle may be alike.
  Mesh needle = mesh;
  needle.triangle = {{0, 0, 1}};
  for (const glm::uvec3& turned : {glm::uvec3(0, 1, 0), glm::uvec3(1, 0, 0)}) {
    Mesh other = needle;
    other.triangle = {turned};
    EXPECT_EQ(hashSurface(other), hashSurface(needle));
  }
}

TEST(SurfaceHash, noticesTheLastBitOfEveryCorner) {
  const Mesh mesh = makeSheet(5);
  const std::uint64_t hash = hashSurface(mesh);
  const auto next = [](float x) { return std::nextafter(x, std::numeric_limits<float>::max()); };
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      Mesh moved = mesh, turned = mesh;
      moved.position[v][k] = next(moved.position[v][k]);
      turned.normal[v][k] = next(turned.normal[v][k]);
      EXPECT_NE(hashSurface(moved), hash) << v;
      EXPECT_NE(hashSurface(turned), hash) << v;
    }
  }
}

TEST(SurfaceHash, noticesWindingNumberAndMissingNormals) {
  const Mesh mesh = makeSheet(5);
  Mesh flipped = mesh, fewer = mesh, twice = mesh, flat = mesh;
  std::swap(flipped.triangle[7].x, flipped.triangle[7].y);
  fewer.triangle.pop_back();
  twice.triangle.back() = twice.triangle.front();
  flat.normal.clear();
  for (const Mesh* other : {&flipped, &fewer, &twice, &flat}) EXPECT_NE(hashSurface(*other), hashSurface(mesh));
  // Normals that come from the triangles are the importer's, not the file's.
  Mesh repaired = mesh, otherwise = mesh;
  repaired.normalsRepaired = otherwise.normalsRepaired = true;
  otherwise.normal[3] = {0, 1, 0};
  EXPECT_EQ(hashSurface(repaired), hashSurface(otherwise));
  EXPECT_NE(hashSurface(repaired), hashSurface(mesh));
}

}  // namespace
}  // namespace relume
