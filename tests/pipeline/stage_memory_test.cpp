// SPDX-License-Identifier: MIT
// What stages reckon with before they begin: what is shared is counted once, and what does not fit is refused.
#include "bake/stage_memory.h"

#include "bake/base/memory_budget.h"
#include "relume/bake/bake.h"
#include "tests/load_level.h"
#include "tests/pipeline/stage_peaks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

namespace relume {
namespace {

constexpr std::uint32_t kTriangles = 4096, kInstances = 1200;  // 4.9 million: enough to be shared

// Instances of one mesh, or each of a mesh of its own.
Scene levelOf(bool isShared) {
  Scene scene;
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  mesh.triangle.assign(kTriangles, glm::uvec3(0, 2, 1));
  scene.meshes.assign(isShared ? 1 : kInstances, mesh);
  for (std::uint32_t i = 0; i < kInstances; ++i) {
    Instance instance;
    instance.mesh = isShared ? 0 : i;
    instance.firstTriangle = i * kTriangles;
    scene.instances.push_back(instance);
  }
  return scene;
}

TEST(StageMemory, instancesThatShareAMeshAreCountedOnce) {
  Context context;
  const Scene shared = levelOf(true), own = levelOf(false);
  context.maxMemory = heldMemory() + (std::uint64_t{64} << 20);
  EXPECT_TRUE(reserveRays(shared, RayStructure::quick, context));
  const Status refused = reserveRays(own, RayStructure::quick, context);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("rays needs about"), std::string::npos) << refused.error().message;
}

TEST(StageMemory, sharedStructuresThatDoNotFitAreRefused) {
  Context context;
  const Scene shared = levelOf(true);
  context.maxMemory = heldMemory() + (std::uint64_t{1} << 20);
  EXPECT_FALSE(reserveRays(shared, RayStructure::quick, context));
}

TEST(StageMemory, surfelsTakeMemoryForTheSidesThatAreSeen) {
  const Scene scene = levelOf(true);
  PlaySpace unseen, seen;
  const std::vector<float> nothing(2 * scene.triangleCount(), 0.0f), all(2 * scene.triangleCount(), 1.0f);
  unseen.seenArea = std::span<const float>(nothing);
  seen.seenArea = std::span<const float>(all);
  SurfelOptions options;
  options.count = 1000;
  Context context;
  context.maxMemory = heldMemory() + (std::uint64_t{64} << 20);
  EXPECT_TRUE(reserveSurfels(scene, unseen, options, context));
  EXPECT_FALSE(reserveSurfels(scene, seen, options, context));
}

// The caches' stage, and that in which the bake is put together, hold what they reckoned with, and not far less.
void expectNear(const Scene& scene, const BakeOptions& options) {
  if (!test::StagePeaks::canMeasure()) GTEST_SKIP() << "the system does not tell";
  Context context;
  context.threads = 2;
  test::StagePeaks peaks(context);
  const Result<Bake> baked = bake(scene, options, context);
  ASSERT_TRUE(baked) << baked.error().message;
  const auto measured = peaks.measured();
  auto reckoned = peaks.reckoned();
  for (const char* stage : {"caches", "provenance"}) {
    EXPECT_GE(reckoned[stage], measured.at(stage)) << stage;
    EXPECT_LE(reckoned[stage], 1.3 * measured.at(stage)) << stage;
  }
}

std::filesystem::path sample(const char* path) { return std::filesystem::path(RELUME_SOURCE_DIR) / "samples" / path; }

TEST(StageMemory, cachesAreReckonedAtNoLessAndAtMostALittleMore) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "sanitizers hold several times as much";
  for (const char* path : {"level/two_rooms.glb", "blender/cabin.glb", "area_lights/stars.glb"}) {
    SCOPED_TRACE(path);
    expectNear(test::loadLevel(sample(path)), presetOptions(Preset::draft));
  }
  expectNear(test::loadLevel(sample("level/two_rooms.glb")), presetOptions(Preset::medium));
}

TEST(StageMemory, cachesOfManyInstancesAreReckonedAtNoLessAndAtMostALittleMore) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "sanitizers hold several times as much";
  // Pyramids of a thousand triangles on a plain.
  Scene scene;
  Mesh mesh;
  constexpr std::uint32_t kAlong = 22;
  for (std::uint32_t y = 0; y <= kAlong; ++y) {
    for (std::uint32_t x = 0; x <= kAlong; ++x) {
      const glm::vec2 p = glm::vec2(x, y) / (0.5f * kAlong) - 1.0f;
      mesh.position.emplace_back(p.x, 1.0f - std::max(std::abs(p.x), std::abs(p.y)), -p.y);
      const std::uint32_t at = y * (kAlong + 1) + x;
      if (x == kAlong || y == kAlong) continue;
      mesh.triangle.emplace_back(at, at + 1, at + kAlong + 2);
      mesh.triangle.emplace_back(at, at + kAlong + 2, at + kAlong + 1);
    }
  }
  scene.meshes.push_back(mesh);
  for (std::uint32_t i = 0; i < 5000; ++i) {
    Instance instance;
    instance.node = "pyramid";
    instance.gpuInstance = i;
    instance.toWorld[3] = glm::vec4(3.0f * static_cast<float>(i % 70), 0.0f, 3.0f * static_cast<float>(i / 70), 1.0f);
    instance.firstTriangle = scene.triangleCount();
    scene.instances.push_back(instance);
  }
  expectNear(scene, presetOptions(Preset::draft));
}

}  // namespace
}  // namespace relume
