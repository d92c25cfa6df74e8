// SPDX-License-Identifier: MIT
// What stages reckon with before they begin: what is shared is counted once, and what does not fit is refused.
#include "bake/stage_memory.h"

#include "bake/base/memory_budget.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace relume
