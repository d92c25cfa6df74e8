// SPDX-License-Identifier: MIT
// Where charts meet: both sides of a seam take their light from nearly the same place, and every cache lies on the
// surface it lights.
#include "tests/caches/seams.h"
#include "bake/caches/caches.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"

#include <gtest/gtest.h>
#include <glm/ext/matrix_transform.hpp>

#include <cmath>
#include <random>
#include <string>

namespace relume {
namespace {

// A room with a dented ball in it: its charts are curved, and meet at seams.
Scene roomWithBall() {
  Scene scene;
  Mesh room, ball = test::sphere(1.1f, 40, 64);
  test::addBox(room, {-2, 0, -3}, {2, 3, 3}, true);
  for (glm::vec3& p : ball.position) p *= 1.0f + 0.04f * std::sin(7.0f * p.x) * std::sin(6.0f * p.y + 5.0f * p.z);
  test::addInstance(scene, std::move(room), "room");
  test::addInstance(scene, std::move(ball), "ball", glm::translate(glm::mat4(1.0f), glm::vec3(0, 1.4f, 0)));
  scene.cameras = {test::cameraAt({0.1f, 1.4f, 2.2f})};
  return scene;
}

struct Placed : test::Placed {
  double texel = 0.0;                       // [m]
  double unstitched = 0.0, stitched = 0.0;  // [texel]
};

void place(Placed& p, std::uint32_t count) {
  Context context;
  Context::Stage stage(context, "caches");
  CacheOptions options;
  options.lightmapCaches = count;
  options.gridCaches = 27;
  ASSERT_NO_FATAL_FAILURE(test::place(p, options, test::walks(1u << 16), context));
  p.texel = test::figureOf(context, "texel_m");
  p.unstitched = test::figureOf(context, "seam_jump_unstitched_texels");
  p.stitched = test::figureOf(context, "seam_jump_texels");
}

TEST(Seams, BothSidesTakeTheirLightFromNearlyOnePlace) {
  for (const std::uint32_t count : {800u, 3000u}) {
    Placed p{{roomWithBall(), {}, {}, {}}};
    place(p, count);
    const auto seams = test::findSeams(p.scene, p.caches.lightmap, 0.8f, 0.02f);
    const test::SeamJump jump = test::measureSeams(p.caches, seams);
    ASSERT_GT(jump.length, 3.0) << "the ball has seams";
    ASSERT_TRUE(std::isfinite(p.texel) && p.texel > 0.0);
    EXPECT_LT(jump.rms, 0.5 * p.texel);
    EXPECT_LT(jump.p95, p.texel);
    EXPECT_LT(p.stitched, 0.9 * p.unstitched) << "stitching helps";
  }
}

// Not on a plane fitted through the texel: a chord of the ball is within it.
TEST(Seams, CachesLieOnTheTrianglesThemselves) {
  Placed p{{roomWithBall(), {}, {}, {}}};
  place(p, 1500);
  int onBall = 0;
  for (std::uint32_t c = 0; c < p.caches.count(); ++c) {
    const glm::vec3 x = p.caches.positionWorld[c], n = p.caches.normal[c];
    if (n == glm::vec3(0.0f) || glm::distance(x, glm::vec3(0, 1.4f, 0)) > 1.2f) continue;
    ++onBall;
    // The nearest triangle in the plane of which the cache lies, seen along its normal.
    float nearest = INFINITY;
    const Instance& ball = p.scene.instances[1];
    for (std::uint32_t t = 0; t < p.scene.meshes[ball.mesh].triangle.size(); ++t) {
      const auto corner = p.scene.corners(ball, t);
      const glm::vec3 e = corner[1] - corner[0], f = corner[2] - corner[0], g = glm::cross(e, f);
      const float area = glm::length(g);
      if (!(area > 1e-9f) || glm::dot(g / area, n) < 0.9999f) continue;
      const float off = glm::dot(x - corner[0], g / area);
      const glm::vec3 on = x - off * g / area - corner[0];
      const float u = glm::dot(glm::cross(on, f), g) / (area * area),
                  v = glm::dot(glm::cross(e, on), g) / (area * area);
      if (std::min({u, v, 1.0f - u - v}) > -1e-3f) nearest = std::min(nearest, std::abs(off));
    }
    EXPECT_LT(nearest, 0.011f) << "cache " << c;
  }
  EXPECT_GT(onBall, 100);
}

}  // namespace
}  // namespace relume
