// SPDX-License-Identifier: MIT
// Findings on meshes whose faults are known.
#include "bake/import/check_mesh.h"

#include "relume/bake/context.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

namespace relume {
namespace {

using Kind = MeshFinding::Kind;

const std::vector<glm::vec3> kCube = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
const std::vector<glm::uvec3> kCubeFaces = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                            {2, 3, 7}, {2, 7, 6}, {1, 2, 6}, {1, 6, 5}, {0, 4, 7}, {0, 7, 3}};

Scene sceneOf(const Mesh& mesh) {
  Scene scene;
  scene.meshes.push_back(mesh);
  Instance instance;
  instance.node = "crate";
  scene.instances.push_back(instance);
  return scene;
}

Mesh cube() {
  Mesh mesh;
  mesh.position = kCube;
  mesh.triangle = kCubeFaces;
  return mesh;
}

std::map<Kind, MeshFinding> check(const Mesh& mesh) {
  Context context;
  std::map<Kind, MeshFinding> out;
  for (const MeshFinding& f : checkMeshes(sceneOf(mesh), context)) out[f.kind] = f;
  return out;
}

TEST(CheckMesh, aClosedCubeHasNothingToFind) { EXPECT_TRUE(check(cube()).empty()); }

TEST(CheckMesh, splitVerticesAreNotBorders) {
  Mesh mesh;
  for (const glm::uvec3& t : kCubeFaces) {
    const auto first = static_cast<std::uint32_t>(mesh.position.size());
    mesh.position.insert(mesh.position.end(), {kCube[t.x], kCube[t.y], kCube[t.z]});
    mesh.triangle.push_back({first, first + 1, first + 2});
  }
  EXPECT_TRUE(check(mesh).empty());
}

TEST(CheckMesh, aMissingFaceLeavesThreeBorderEdges) {
  Mesh mesh = cube();
  mesh.triangle.erase(mesh.triangle.begin() + 4);
  const auto found = check(mesh);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.at(Kind::openBorder).count, 3u);
  EXPECT_EQ(found.at(Kind::openBorder).node, "crate");
}

TEST(CheckMesh, aTurnedFaceIsFoundByItsNeighbours) {
  for (std::uint32_t turned = 0; turned < 12; ++turned) {
    Mesh mesh = cube();
    std::swap(mesh.triangle[turned].y, mesh.triangle[turned].z);
    const auto found = check(mesh);
    ASSERT_EQ(found.size(), 1u) << turned;
    EXPECT_EQ(found.at(Kind::flippedWinding).count, 1u);
    EXPECT_EQ(found.at(Kind::flippedWinding).triangle, turned);
  }
}

TEST(CheckMesh, aFaceAgainstItsNormalsIsFlipped) {
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangle = {{0, 1, 2}};
  mesh.normal.assign(3, {0, 0, -1});
  EXPECT_EQ(check(mesh).at(Kind::flippedWinding).count, 1u);
  mesh.normal.assign(3, {0, 0, 1});
  EXPECT_EQ(check(mesh).count(Kind::flippedWinding), 0u);
}

TEST(CheckMesh, degenerateTrianglesAreThoseWithoutAreaWithinRounding) {
  Mesh mesh = cube();
  mesh.position.insert(
      mesh.position.end(),
      {{0.5f, 0, 0}, {1000, 1000, 1000}, {1001, 1001, 1001}, {1002, 1002, 1002.0001f}, {1e-6f, 0, 0}, {0, 1e-6f, 0}});
  mesh.triangle.insert(mesh.triangle.end(), {{3, 3, 5}, {0, 8, 1}, {9, 10, 11}});
  const auto found = check(mesh);
  EXPECT_EQ(found.at(Kind::degenerateTriangle).count, 3u);
  EXPECT_EQ(found.at(Kind::degenerateTriangle).triangle, 12u);
  // Small is not degenerate.
  Mesh tiny;
  tiny.position = {{0, 0, 0}, {1e-6f, 0, 0}, {0, 1e-6f, 0}};
  tiny.triangle = {{0, 1, 2}};
  EXPECT_EQ(check(tiny).count(Kind::degenerateTriangle), 0u);
}

TEST(CheckMesh, valuesThatWouldStopCgalAreCountedAsDegenerate) {
  Mesh mesh = cube();
  mesh.position.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  mesh.position.push_back({0, std::numeric_limits<float>::infinity(), 0});
  mesh.triangle.insert(mesh.triangle.end(), {{0, 1, 8}, {0, 1, 9}, {0, 1, 4000000000u}});
  EXPECT_EQ(check(mesh).at(Kind::degenerateTriangle).count, 3u);
}

TEST(CheckMesh, duplicatesAreFoundInAnyOrderAndLeaveNoTrace) {
  Mesh mesh = cube();
  mesh.triangle.insert(mesh.triangle.end(), {{2, 1, 0}, {1, 0, 2}});  // the first face, turned once and reversed once
  const auto found = check(mesh);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.at(Kind::duplicateTriangle).count, 2u);
  EXPECT_EQ(found.at(Kind::duplicateTriangle).triangle, 12u);
}

TEST(CheckMesh, threeFacesOnAnEdgeAreNotAManifold) {
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
  mesh.triangle = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
  const auto found = check(mesh);
  EXPECT_EQ(found.at(Kind::nonManifoldEdge).count, 1u);
  EXPECT_EQ(found.at(Kind::nonManifoldEdge).triangle, 0u);
  EXPECT_EQ(found.at(Kind::openBorder).count, 6u);
}

// A band of quads, closed after a half turn: no winding suits it, and the report ends all the same.
TEST(CheckMesh, aMoebiusStripIsToldOnce) {
  constexpr std::uint32_t kQuads = 12;
  Mesh mesh;
  for (std::uint32_t i = 0; i < kQuads; ++i) {
    const float around = 6.2831853f * static_cast<float>(i) / kQuads, turn = 0.5f * around;
    const glm::vec3 out(std::cos(around), 0.0f, std::sin(around));
    for (const float side : {-0.3f, 0.3f})
      mesh.position.push_back(out * (1.0f + side * std::cos(turn)) + glm::vec3(0, side * std::sin(turn), 0));
  }
  for (std::uint32_t i = 0; i < kQuads; ++i) {
    const bool last = i + 1 == kQuads;
    const std::uint32_t a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    mesh.triangle.push_back({a, b, d});
    mesh.triangle.push_back({a, d, c});
  }
  const auto found = check(mesh);
  EXPECT_EQ(found.at(Kind::openBorder).count, 2 * kQuads);
  EXPECT_EQ(found.count(Kind::nonManifoldEdge), 0u);
}

TEST(CheckMesh, anEmptyMeshIsFine) { EXPECT_TRUE(check(Mesh{}).empty()); }

TEST(RepairMesh, collapsesEqualTrianglesOnlyAndKeepsNumbering) {
  Mesh mesh = cube();
  mesh.triangle.insert(mesh.triangle.begin() + 1, {2, 1, 0});  // the first face, turned
  mesh.triangle.push_back({0, 1, 2});                          // and reversed: it may emit to the other side
  Scene scene = sceneOf(mesh);
  Context context;
  const std::vector<MeshFinding> repaired = repairMeshes(scene, context);
  ASSERT_EQ(repaired.size(), 1u);
  EXPECT_EQ(repaired[0].kind, Kind::repaired);
  EXPECT_EQ(repaired[0].count, 1u);
  EXPECT_EQ(repaired[0].triangle, 1u);
  EXPECT_EQ(scene.meshes[0].triangle.size(), 14u);
  EXPECT_EQ(scene.meshes[0].triangle[1], glm::uvec3(2));
  EXPECT_TRUE(repairMeshes(scene, context).empty());
}

TEST(RepairMesh, leavesMasksThatShowDifferentParts) {
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.uv[0] = {{0, 0}, {1, 0}, {0, 1}, {0, 0}, {1, 0}, {0.5f, 1}};
  mesh.triangle = {{0, 1, 2}, {4, 5, 3}};
  mesh.material = 0;
  Scene scene = sceneOf(mesh);
  scene.materials.resize(1);
  scene.materials[0].alphaMode = AlphaMode::mask;
  Context context;
  EXPECT_TRUE(repairMeshes(scene, context).empty());
  scene.meshes[0].uv[0][5] = {0, 1};
  EXPECT_EQ(repairMeshes(scene, context).size(), 1u);
}

}  // namespace
}  // namespace relume
