// SPDX-License-Identifier: MIT
// Normals and corners under the transforms that break them.
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <cmath>

namespace relume {
namespace {

Scene triangleScene(const glm::mat4& toWorld, bool withNormals) {
  Scene scene;
  Mesh mesh;
  mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, -1}};
  if (withNormals) mesh.normal.assign(3, glm::normalize(glm::vec3(0, 1, 1)));
  mesh.triangle = {{0, 1, 2}};
  scene.meshes.push_back(mesh);
  Instance instance;
  instance.toWorld = toWorld;
  instance.flipped = glm::determinant(glm::mat3(toWorld)) < 0.0f;
  scene.instances.push_back(instance);
  return scene;
}

const SurfacePoint kMiddle{0, 0, {1.0f / 3.0f, 1.0f / 3.0f}};

TEST(Normals, standOnTheirPlaneUnderAnyScale) {
  const glm::vec3 scales[] = {{1, 1, 1}, {5, 0.1f, 3}, {-1, 1, 1}, {2, -3, 0.5f}, {-1, -1, -1}, {1e-6f, 1e-6f, 1e-6f}};
  for (const glm::vec3& scale : scales) {
    const Scene scene = triangleScene(glm::scale(glm::mat4(1.0f), scale), true);
    const auto c = scene.corners(scene.instances[0], 0);
    const glm::vec3 n = geometricNormal(scene, kMiddle);
    EXPECT_NEAR(glm::length(n), 1.0f, 1e-5f);
    EXPECT_NEAR(glm::dot(n, glm::normalize(c[1] - c[0])), 0.0f, 1e-5f);
    EXPECT_NEAR(glm::dot(n, glm::normalize(c[2] - c[0])), 0.0f, 1e-5f);
    EXPECT_GT(glm::dot(n, glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]))), 0.999f);
    EXPECT_LT(glm::length(shadingNormal(scene, kMiddle) - n), 1e-4f) << scale.x;  // the mesh's normals are its plane's
  }
}

TEST(Normals, surviveAFlattenedAxisWhenTheFaceDoes) {
  const Scene scene = triangleScene(glm::scale(glm::mat4(1.0f), {1, 1, 0}), false);
  EXPECT_EQ(geometricNormal(scene, kMiddle), glm::vec3(0, 0, 1));
  const Scene gone = triangleScene(glm::scale(glm::mat4(1.0f), {0, 1, 1}), false);
  EXPECT_EQ(geometricNormal(gone, kMiddle), glm::vec3(0.0f));
}

TEST(Normals, keepTheirDigitsFarFromTheOrigin) {
  const Scene scene = triangleScene(glm::translate(glm::mat4(1.0f), {2e5f, 1e5f, -2e5f}), false);
  EXPECT_LT(glm::length(geometricNormal(scene, kMiddle) - glm::normalize(glm::vec3(0, 1, 1))), 1e-6f);
}

TEST(Normals, ofShadingStayOnTheGeometricSide) {
  Scene scene = triangleScene(glm::mat4(1.0f), true);
  for (glm::vec3& n : scene.meshes[0].normal) n = -n;
  EXPECT_GT(glm::dot(shadingNormal(scene, kMiddle), geometricNormal(scene, kMiddle)), 0.999f);
}

TEST(Normals, interpolateWithTheWeightsOfCorners) {
  for (const float mirror : {1.0f, -1.0f}) {
    Scene scene = triangleScene(glm::scale(glm::mat4(1.0f), {mirror, 1, 1}), true);
    scene.meshes[0].normal = {{0, 0, 1}, {0, 1, 0}, {0, 0.6f, 0.8f}};
    const auto corner = scene.corners(scene.instances[0], 0);
    // At each end the normal must be that of the vertex which corners() put there.
    const glm::vec2 ends[3] = {{0, 0}, {1, 0}, {0, 1}};
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 at = glm::vec3(corner[k].x * mirror, corner[k].y, corner[k].z);
      const glm::vec3 expected = at == glm::vec3(1, 0, 0)   ? glm::vec3(0, 1, 0)
                                 : at == glm::vec3(0, 0, 0) ? glm::vec3(0, 0, 1)
                                                            : glm::vec3(0, 0.6f, 0.8f);
      EXPECT_LT(glm::length(shadingNormal(scene, {0, 0, ends[k]}) - expected), 1e-5f) << k;
    }
  }
}

}  // namespace
}  // namespace relume
