// SPDX-License-Identifier: MIT
// Levels whose instances share one structure for each mesh: hits are of the right instance, triangle and place.
#include "bake/rays/ray_tracer.h"

#include "bake/base/random.h"
#include "relume/bake/context.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr std::uint32_t kSquares = 32, kColumns = 46;  // 2048 triangles a sheet, 4.3 million in all

// One square metre about the origin, fronts up.
Mesh sheet() {
  Mesh mesh;
  for (std::uint32_t z = 0; z <= kSquares; ++z) {
    for (std::uint32_t x = 0; x <= kSquares; ++x)
      mesh.position.emplace_back(static_cast<float>(x) / kSquares - 0.5f, 0.0f,
                                 static_cast<float>(z) / kSquares - 0.5f);
  }
  for (std::uint32_t z = 0; z < kSquares; ++z) {
    for (std::uint32_t x = 0; x < kSquares; ++x) {
      const std::uint32_t a = z * (kSquares + 1) + x, b = a + kSquares + 1;
      mesh.triangle.emplace_back(a, b, a + 1);
      mesh.triangle.emplace_back(a + 1, b, b + 1);
    }
  }
  return mesh;
}

float heightOf(std::uint32_t i) { return 0.01f * static_cast<float>(i % 101); }

// Sheets two metres apart: every third mirrored, every fifth stretched; the last is a copy of the first in its place.
Scene field() {
  Scene scene;
  for (std::uint32_t i = 0; i < kColumns * kColumns; ++i) {
    const glm::vec3 at(2.0f * static_cast<float>(i % kColumns), heightOf(i), 2.0f * static_cast<float>(i / kColumns));
    glm::mat4 to = glm::translate(glm::mat4(1.0f), at);
    to = glm::scale(to, glm::vec3(i % 3 == 0 ? -1.0f : 1.0f, 1.0f, i % 5 == 0 ? 1.5f : 1.0f));
    if (i == 0) {
      addInstance(scene, sheet(), to);
    } else {
      scene.instances.push_back(scene.instances.front());
      scene.instances.back().toWorld = to;
    }
  }
  scene.instances.push_back(scene.instances.front());
  finish(scene);
  return scene;
}

TEST(SharedStructure, hitsAreOfTheRightInstanceTriangleAndPlace) {
  const Scene scene = field();
  ASSERT_GT(scene.triangleCount(), 1u << 22);
  Context context;
  const auto tracer = RayTracer::create(scene, "avx2", context);
  ASSERT_TRUE(tracer) << tracer.error().message;
  std::vector<Ray> rays(20000);
  std::vector<std::uint32_t> below(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    RandomStream random(3, 1, i);
    const glm::vec2 u = random.uniform2();
    below[i] = static_cast<std::uint32_t>(random.uniform() * kColumns * kColumns) % (kColumns * kColumns);
    const glm::vec3 place =
        scene.instances[below[i]].toWorld * glm::vec4(0.98f * (u.x - 0.5f), 0, 0.98f * (u.y - 0.5f), 1);
    const bool fromBelow = i % 2 == 1;
    rays[i].origin = place + glm::vec3(0.0f, fromBelow ? -3.0f : 3.0f, 0.0f);
    rays[i].direction = {0.0f, fromBelow ? 1.0f : -1.0f, 0.0f};
  }
  std::vector<Hit> hits(rays.size());
  tracer->trace(rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_TRUE(hits[i]) << i;
    const std::uint32_t copy = kColumns * kColumns;
    ASSERT_TRUE(hits[i].instance == below[i] || (below[i] == 0 && hits[i].instance == copy)) << i;
    const auto c = scene.corners(scene.instances[hits[i].instance], hits[i].triangle);
    const glm::vec3 at = c[0] + (c[1] - c[0]) * hits[i].barycentric.x + (c[2] - c[0]) * hits[i].barycentric.y;
    const glm::vec3 expected = rays[i].origin + 3.0f * rays[i].direction;
    EXPECT_LT(glm::distance(at, expected), 2e-4f) << i;
    EXPECT_NEAR(hits[i].distance, 3.0f, 1e-4f);
    EXPECT_GT(geometricNormal(scene, {hits[i].instance, hits[i].triangle, hits[i].barycentric}).y, 0.99f);
  }
}

}  // namespace
}  // namespace relume
