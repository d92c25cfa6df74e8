// SPDX-License-Identifier: MIT
// Which two-sided surfaces enclose matter, on meshes with known answers.
#include "bake/import/find_solids.h"

#include "relume/bake/context.h"
#include "tests/caches/meshes.h"
#include "tests/cancel_after.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;
using test::addQuad;

Material twoSided() {
  Material material;
  material.doubleSided = true;
  return material;
}

Mesh boxMesh(const glm::vec3& low, const glm::vec3& high, bool inside = false) {
  Mesh mesh;
  mesh.material = 0;
  addBox(mesh, low, high, inside);
  return mesh;
}

// A level of one two-sided mesh that a camera sees from outside.
Scene levelOf(Mesh mesh, const glm::mat4& toWorld = glm::mat4(1.0f)) {
  Scene scene;
  scene.materials.push_back(twoSided());
  mesh.material = 0;
  addInstance(scene, std::move(mesh), "piece", toWorld);
  Camera camera;
  camera.toWorld = glm::translate(glm::mat4(1.0f), glm::vec3(50, 0, 0));
  scene.cameras.push_back(camera);
  return scene;
}

// How many triangles are solid.
std::size_t solids(Scene& scene) {
  Context context;
  findSolids(scene, context);
  EXPECT_TRUE(scene.solid.empty() || scene.solid.size() == scene.triangleCount());
  return static_cast<std::size_t>(std::count(scene.solid.begin(), scene.solid.end(), 1));
}

std::size_t solidsOf(Mesh mesh) {
  Scene scene = levelOf(std::move(mesh));
  return solids(scene);
}

const glm::vec3 kLow(0.0f), kHigh(1, 2, 3);

TEST(FindSolids, closedPiecesThatFaceOutwardAreSolid) {
  Scene box = levelOf(boxMesh(kLow, kHigh));
  EXPECT_TRUE(box.bothSides(box.instances[0], 3));
  EXPECT_EQ(solids(box), 12u);
  EXPECT_FALSE(box.bothSides(box.instances[0], 3));
  EXPECT_EQ(solidsOf(test::sphere(0.3f, 12, 24)), 2u * 24 * 11);
  Scene mirrored = levelOf(boxMesh(kLow, kHigh), glm::scale(glm::mat4(1.0f), glm::vec3(-1, 1, 1)));
  EXPECT_EQ(solids(mirrored), 12u);
}

TEST(FindSolids, whatOneSidedMaterialsHaveIsLeftAlone) {
  Scene box = levelOf(boxMesh(kLow, kHigh));
  box.materials[0].doubleSided = false;
  EXPECT_EQ(solids(box), 0u);
  EXPECT_TRUE(box.solid.empty());
  EXPECT_FALSE(box.bothSides(box.instances[0], 3));
}

TEST(FindSolids, roomsAndSheetsStayTwoSided) {
  EXPECT_EQ(solidsOf(boxMesh(kLow, kHigh, true)), 0u) << "faces inward";
  Mesh open = boxMesh(kLow, kHigh);
  open.triangle.pop_back();
  EXPECT_EQ(solidsOf(open), 0u) << "a triangle is missing";
  Mesh turned = boxMesh(kLow, kHigh);
  std::swap(turned.triangle[5].y, turned.triangle[5].z);
  EXPECT_EQ(solidsOf(turned), 0u) << "a triangle is turned over";
  Mesh leaf;
  addQuad(leaf, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  EXPECT_EQ(solidsOf(leaf), 0u) << "a sheet";
  addQuad(leaf, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}, {0, 0, 0});
  EXPECT_EQ(solidsOf(leaf), 0u) << "a sheet of two layers encloses nothing";
}

TEST(FindSolids, aThinSlabIsSolid) { EXPECT_EQ(solidsOf(boxMesh({0, 0, 0}, {4, 0.001f, 4})), 12u); }

TEST(FindSolids, eachConnectedPieceStandsForItself) {
  Mesh mesh = boxMesh(kLow, kHigh);
  addQuad(mesh, {5, 0, 0}, {6, 0, 0}, {6, 1, 0}, {5, 1, 0});
  addBox(mesh, {7, 0, 0}, {8, 1, 1}, true);
  addBox(mesh, {0.5f, 0.5f, 0.5f}, {1.5f, 1.5f, 1.5f}, false);  // runs into the first
  Scene scene = levelOf(mesh);
  EXPECT_EQ(solids(scene), 24u);
  for (std::uint32_t t = 0; t < scene.triangleCount(); ++t) EXPECT_EQ(scene.solid[t] != 0, t < 12 || t >= 26) << t;
}

TEST(FindSolids, piecesThatShareEdgesAreSolid) {
  Mesh mesh = boxMesh(kLow, kHigh);
  addBox(mesh, {1, 0, 0}, {2, 2, 3}, false);
  EXPECT_EQ(solidsOf(mesh), 24u);
}

TEST(FindSolids, copiesOfTrianglesDoNotOpenAPiece) {
  Mesh mesh = boxMesh(kLow, kHigh);
  mesh.triangle.push_back(mesh.triangle[4]);
  EXPECT_EQ(solidsOf(mesh), 12u);
}

TEST(FindSolids, primitivesOfOneNodeCloseAPieceTogether) {
  Scene scene = levelOf(boxMesh(kLow, kHigh));
  scene.materials.push_back(twoSided());
  Mesh lid = scene.meshes[0];
  lid.material = 1;
  lid.triangle.assign(scene.meshes[0].triangle.begin(), scene.meshes[0].triangle.begin() + 2);
  scene.meshes[0].triangle.erase(scene.meshes[0].triangle.begin(), scene.meshes[0].triangle.begin() + 2);
  const std::uint32_t second = addInstance(scene, std::move(lid), "piece");
  scene.instances[second].nodeIndex = scene.instances[0].nodeIndex;
  EXPECT_EQ(solids(scene), 12u);
  // Of two nodes each is open.
  scene.instances[second].nodeIndex = 1;
  EXPECT_EQ(solids(scene), 0u);
}

TEST(FindSolids, aMaskThatCutsHolesLeavesTheInsideToBeSeen) {
  Scene scene = levelOf(boxMesh(kLow, kHigh));
  Material& material = scene.materials[0];
  material.alphaMode = AlphaMode::mask;
  EXPECT_EQ(solids(scene), 12u) << "opaque everywhere";
  Image image;
  image.levels.push_back({2, 1, {255, 255, 255, 255, 255, 255, 255, 0}});
  scene.images.push_back(image);
  material.albedoTexture.image = 0;
  EXPECT_EQ(solids(scene), 0u);
  scene.images[0].levels[0].rgba[7] = 128;
  EXPECT_EQ(solids(scene), 12u);
  scene.meshes[0].colorAlpha.assign(scene.meshes[0].position.size(), 1.0f);
  scene.meshes[0].colorAlpha[3] = 0.1f;
  EXPECT_EQ(solids(scene), 0u);
}

TEST(FindSolids, whatIsSeenFromWithinIsARoom) {
  const auto crate = [] { return levelOf(boxMesh({-2, 0, -2}, {2, 3, 2})); };
  const auto at = [](const glm::vec3& p) { return glm::translate(glm::mat4(1.0f), p); };

  Scene scene = crate();
  scene.cameras.emplace_back().toWorld = at({0, 1, 0});
  EXPECT_EQ(solids(scene), 0u) << "a camera inside";

  scene.cameras.back().playSpace = false;
  EXPECT_EQ(solids(scene), 12u) << "a camera that only looks";
  for (const auto& [x, solid] : {std::pair(0.0f, 0u), std::pair(3.0f, 12u)}) {
    scene = crate();
    scene.volumes.emplace_back().toWorld = glm::scale(at({x, 1.5f, 0}), glm::vec3(3.8f, 2.8f, 3.8f));
    EXPECT_EQ(solids(scene), solid) << "a play volume at " << x;
  }
  scene = crate();
  scene.volumes.emplace_back().toWorld = glm::scale(at({0, 1.5f, 0}), glm::vec3(20.0f));
  EXPECT_EQ(solids(scene), 12u) << "furniture in a play volume";
  scene = crate();
  scene.lights.emplace_back().positionWorld = {0, 1, 0};
  EXPECT_EQ(solids(scene), 12u) << "a bulb, seen from outside";
}

TEST(FindSolids, whatHoldsThingsIsARoomWhereNobodySaysWhereReceiversAre) {
  Scene scene = levelOf(boxMesh({-2, 0, -2}, {2, 3, 2}));
  addInstance(scene, boxMesh({-0.5f, 0.01f, -0.5f}, {0.5f, 1, 0.5f}), "chair");
  EXPECT_EQ(solids(scene), 24u);
  scene.cameras.clear();
  EXPECT_EQ(solids(scene), 12u);
  EXPECT_TRUE(scene.bothSides(scene.instances[0], 0));
  EXPECT_FALSE(scene.bothSides(scene.instances[1], 0));

  for (const auto& [x, solid] : {std::pair(0.0f, 0u), std::pair(3.0f, 12u)}) {
    scene = levelOf(boxMesh({-2, 0, -2}, {2, 3, 2}));
    scene.cameras.clear();
    scene.lights.emplace_back().positionWorld = {x, 1, 0};
    EXPECT_EQ(solids(scene), solid) << "a light at " << x;
    scene.lights[0].kind = LightKind::directional;
    EXPECT_EQ(solids(scene), 12u) << "the sun is nowhere";
  }
}

// Anything goes in, nothing breaks.
TEST(FindSolids, hostileMeshesAreOpen) {
  Mesh mesh = boxMesh(kLow, kHigh);
  mesh.position[7].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(solidsOf(mesh), 0u);
  std::mt19937 random(5);
  for (int round = 0; round < 50; ++round) {
    Mesh soup;
    for (int i = 0; i < 8; ++i) soup.position.emplace_back(random() % 3, random() % 3, random() % 3);
    for (int i = 0; i < 40; ++i) soup.triangle.emplace_back(random() % 8, random() % 8, random() % 8);
    Scene scene = levelOf(std::move(soup), glm::scale(glm::mat4(1.0f), glm::vec3(1.0f, round % 2 ? 0.0f : 1.0f, 1.0f)));
    scene.lights.emplace_back();
    solids(scene);
  }
}

// A closed surface of many triangles that only holds half of what is in its box.
Mesh ballMesh(std::uint32_t rows) {
  Mesh mesh;
  mesh.material = 0;
  const std::uint32_t columns = 2 * rows;
  for (std::uint32_t r = 0; r <= rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const float up = 3.14159265f * static_cast<float>(r) / static_cast<float>(rows);
      const float around = 6.2831853f * static_cast<float>(c) / static_cast<float>(columns);
      const bool pole = r == 0 || r == rows;
      mesh.position.push_back(
          pole ? glm::vec3(0, r == 0 ? 1 : -1, 0)
               : glm::vec3(std::sin(up) * std::cos(around), std::cos(up), std::sin(up) * std::sin(around)));
    }
  }
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const std::uint32_t a = r * columns + c, b = r * columns + (c + 1) % columns;
      mesh.triangle.emplace_back(a, b, a + columns);
      mesh.triangle.emplace_back(b, b + columns, a + columns);
    }
  }
  return mesh;
}

// A ball, and things around it at the corners of its box; or one of them in it.
Scene ballAmongThings(std::uint32_t rows, std::uint32_t things, bool within) {
  Scene scene = levelOf(ballMesh(rows));
  scene.cameras.clear();
  for (std::uint32_t i = 0; i < things; ++i) {
    Mesh thing = boxMesh(glm::vec3(0.0f), glm::vec3(0.05f + 1e-4f * static_cast<float>(i)));
    thing.material = kNone;
    const glm::vec3 corner(i & 1u ? 0.8f : -0.85f, i & 2u ? 0.8f : -0.85f, i & 4u ? 0.8f : -0.85f);
    addInstance(scene, std::move(thing), "thing",
                glm::translate(glm::mat4(1.0f), within && i == 0 ? glm::vec3(0.1f) : corner));
  }
  return scene;
}

TEST(FindSolids, whatLiesBesideABallInItsBoxIsNotInIt) {
  Scene beside = ballAmongThings(16, 16, false), within = ballAmongThings(16, 16, true);
  EXPECT_EQ(solids(beside), 2u * 32u * 16u - 2u * 32u);  // without those at the poles, which have no area
  EXPECT_EQ(solids(within), 0u);
}

TEST(FindSolids, ofMuchHearsACancelAtOnce) {
  const Scene level = ballAmongThings(200, 160, false);
  const test::CancelledWork work([&](Context& context) {
    Scene scene = level;
    findSolids(scene, context);
    return !scene.solid.empty();
  });
  EXPECT_LT(work.shareAfterCancel(0.5), 0.5);
}

}  // namespace
}  // namespace relume
