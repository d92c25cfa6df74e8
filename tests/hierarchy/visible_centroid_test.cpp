// SPDX-License-Identifier: MIT
// What a surfel sees, and that clusters keep apart what does not see the same.
#include "bake/hierarchy/visible_centroid.h"
#include "bake/hierarchy/hierarchy.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <vector>

namespace relume {
namespace {

void addQuad(Scene& scene, const glm::vec3& corner, const glm::vec3& u, const glm::vec3& v) {
  if (scene.meshes.empty()) {
    scene.meshes.emplace_back();
    scene.instances.emplace_back();
  }
  Mesh& mesh = scene.meshes[0];
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (const glm::vec3& p : {corner, corner + u, corner + u + v, corner + v}) mesh.position.push_back(p);
  mesh.triangle.push_back({first, first + 1, first + 2});
  mesh.triangle.push_back({first, first + 2, first + 3});
}

// Surfels on the floor of a hall of 20 x 20 m, 3 m high, with a wall across its middle (x = 0).
Surfels floorSurfels(std::uint32_t along) {
  Surfels surfels;
  std::vector<glm::vec3> position;
  for (std::uint32_t y = 0; y < along; ++y) {
    for (std::uint32_t x = 0; x < along; ++x) {
      const float step = 20.0f / static_cast<float>(along);
      position.push_back(
          {-10.0f + (static_cast<float>(x) + 0.5f) * step, 0.0f, -10.0f + (static_cast<float>(y) + 0.5f) * step});
    }
  }
  surfels.normal = std::vector<glm::vec3>(position.size(), glm::vec3(0, 1, 0));
  surfels.emission = std::vector<glm::vec3>(position.size(), glm::vec3(0.0f));
  surfels.albedo = std::vector<glm::vec3>(position.size(), glm::vec3(0.5f));
  surfels.areaEach = 400.0f / static_cast<float>(position.size());
  surfels.positionWorld = std::move(position);
  return surfels;
}

Scene hallWithWall() {
  Scene scene;
  addQuad(scene, {-10, 0, -10}, {0, 0, 20}, {20, 0, 0});
  addQuad(scene, {-10, 3, -10}, {20, 0, 0}, {0, 0, 20});
  addQuad(scene, {0, 0, -10}, {0, 3, 0}, {0, 0, 20});
  return scene;
}

TEST(VisibleCentroid, isThePlaneAboveForASurfelUnderACeiling) {
  // Under an endless ceiling at height h every direction ends on it: the mean of the ends is straight above, at h.
  Scene scene;
  addQuad(scene, {-500, 3, -500}, {1000, 0, 0}, {0, 0, 1000});
  Context context;
  auto tracer = RayTracer::create(scene, "avx2", context);
  ASSERT_TRUE(tracer);
  Surfels surfels = floorSurfels(2);
  const std::vector<glm::vec3> centroids = visibleCentroids(*tracer, surfels, context);
  for (std::uint32_t i = 0; i < surfels.count(); ++i) {
    // Cosine-weighted over the height: all 3 m; sideways the few directions do not quite cancel.
    EXPECT_NEAR(centroids[i].y, 3.0f, 1e-2f);
    EXPECT_LT(glm::length(glm::vec3(centroids[i] - surfels.positionWorld[i]) * glm::vec3(1, 0, 1)), 1.0f);
  }
}

TEST(VisibleCentroid, isOnTheSurfelsOwnSideOfAWall) {
  const Scene scene = hallWithWall();
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  auto tracer = RayTracer::create(scene, "avx2", one);
  ASSERT_TRUE(tracer);
  const Surfels surfels = floorSurfels(40);
  const std::vector<glm::vec3> centroids = visibleCentroids(*tracer, surfels, one);
  for (std::uint32_t i = 0; i < surfels.count(); ++i) {
    if (std::abs(surfels.positionWorld[i].x) > 2.0f) continue;
    EXPECT_GT(centroids[i].x * surfels.positionWorld[i].x, 0.0f) << i;
  }
  EXPECT_EQ(visibleCentroids(*tracer, surfels, two), centroids);
}

// How many nodes of at least that many leaves hold surfels of both sides of the wall.
int straddling(const Hierarchy& h, const Surfels& surfels, int leavesAtLeast) {
  std::vector<int> left(h.nodeCount(), 0), right(h.nodeCount(), 0);
  int count = 0;
  for (std::uint32_t node = h.nodeCount(); node-- > 0;) {
    if (h.isLeaf(node)) {
      (surfels.positionWorld[h.sender(node)].x < 0.0f ? left : right)[node] = 1;
      continue;
    }
    left[node] = left[h.child[node]] + left[h.child[node] + 1];
    right[node] = right[h.child[node]] + right[h.child[node] + 1];
    count += left[node] > 0 && right[node] > 0 && left[node] + right[node] >= leavesAtLeast;
  }
  return count;
}

TEST(VisibleCentroid, clustersDoNotReachThroughAWall) {
  const Scene scene = hallWithWall();
  Context context;
  auto tracer = RayTracer::create(scene, "avx2", context);
  ASSERT_TRUE(tracer);
  const Surfels surfels = floorSurfels(40);
  ClusteringOptions paper;
  paper.outlookWeight = 0.0f;
  const auto ours = clusterSurfels(*tracer, surfels, 0, {}, context);
  const auto papers = clusterSurfels(*tracer, surfels, 0, paper, context);
  ASSERT_TRUE(ours && papers);
  EXPECT_GE(straddling(*papers, surfels, 8), 20);
  EXPECT_LE(3 * straddling(*ours, surfels, 8), straddling(*papers, surfels, 8));
}

}  // namespace
}  // namespace relume
