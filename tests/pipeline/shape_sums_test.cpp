// SPDX-License-Identifier: MIT
// Sums over blocks of vertices: exporters' noise is forgiven, the smallest real change of one vertex is not.
#include "bake/shape_sums.h"
#include "relume/bake/context.h"
#include "tests/long_tests.h"
#include "tests/pipeline/provenance_level.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace relume {
namespace {

using test::withNoise;

// A smooth mesh of many vertices.
Mesh bumpyMesh(int side, float size) {
  Mesh mesh;
  for (int z = 0; z <= side; ++z) {
    for (int x = 0; x <= side; ++x) {
      const float u = size * static_cast<float>(x) / static_cast<float>(side),
                  v = size * static_cast<float>(z) / static_cast<float>(side);
      mesh.position.emplace_back(u, 0.1f * size * std::sin(5.0f * u) * std::cos(3.0f * v), v);
      mesh.normal.push_back(glm::normalize(glm::vec3(-std::cos(5.0f * u), 1.0f, std::sin(3.0f * v))));
    }
  }
  return mesh;
}

TEST(ShapeSums, noiseOfExportersIsForgiven) {
  for (const float size : {0.02f, 0.3f, 1.0f, 4.0f, 60.0f}) {
    const Mesh mesh = bumpyMesh(test::longTests() ? 316 : 100, size);  // 100,489 vertices in the long test
    const std::vector<std::uint32_t> sums = shapeSums(mesh);
    EXPECT_TRUE(sameShape(mesh, sums, 1.0f));
    for (std::uint32_t seed = 0; seed < 20; ++seed)
      EXPECT_TRUE(sameShape(withNoise(mesh, 1e-8, 1e-7, seed), sums, 1.0f)) << size << " m, seed " << seed;
  }
}

// How often a level's status would flip: over all its meshes, for many exports. docs/notes/compare.md has the figure.
TEST(ShapeSums, noiseOfExportersIsForgivenOnLevels) {
  std::vector<std::string> levels = {RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"};
  const std::string sponza = RELUME_SHARED_DIR "/scenes/sponza/sponza.glb";
  if (test::longTests() && std::filesystem::exists(sponza)) levels.push_back(sponza);
  for (const std::string& level : levels) {
    Context context;
    const Result<Scene> scene = importGltf(level, context);
    ASSERT_TRUE(scene) << scene.error().message;
    std::size_t vertices = 0, flipped = 0, exports = 0;
    for (const Mesh& mesh : scene->meshes) {
      if (mesh.normal.empty()) continue;
      vertices += mesh.position.size();
      const std::vector<std::uint32_t> sums = shapeSums(mesh);
      for (std::uint32_t seed = 0; seed < 50; ++seed, ++exports)
        flipped += !sameShape(withNoise(mesh, 1e-8, 1e-7, seed), sums, 1.0f);
    }
    std::printf("%s: %zu vertices, %zu of %zu noisy exports of a mesh noticed\n", level.c_str(), vertices, flipped,
                exports);
    EXPECT_EQ(flipped, 0u) << level;
    EXPECT_GT(vertices, 0u) << level;
  }
}

TEST(ShapeSums, theSmallestChangeOfOneVertexIsNot) {
  const float size = 0.3f;
  const Mesh mesh = bumpyMesh(40, size);
  const std::vector<std::uint32_t> sums = shapeSums(mesh);
  for (std::size_t i = 0; i < mesh.position.size(); i += 7) {
    for (int k = 0; k < 3; ++k) {
      Mesh moved = mesh;
      moved.position[i][k] += 1e-6f;
      EXPECT_FALSE(sameShape(moved, sums, 1.0f)) << i;
      Mesh turned = mesh;
      turned.normal[i][k] += 1e-5f;
      EXPECT_FALSE(sameShape(turned, sums, 1.0f)) << i;
    }
  }
  Mesh swapped = mesh;
  std::swap(swapped.position[3], swapped.position[4]);
  EXPECT_FALSE(sameShape(swapped, sums, 1.0f));
  Mesh shifted = mesh;
  for (glm::vec3& p : shifted.position) p.x += 1e-6f;
  EXPECT_FALSE(sameShape(shifted, sums, 1.0f));
  Mesh shorter = mesh;
  shorter.position.resize(10);
  EXPECT_FALSE(sameShape(shorter, sums, 1.0f));
}

}  // namespace
}  // namespace relume
