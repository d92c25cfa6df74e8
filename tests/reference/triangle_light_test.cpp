// SPDX-License-Identifier: MIT
// Light of emitters in closed form: Lambert's formula against textbooks' and against sums over small patches.
#include "bake/reference/triangle_light.h"
#include "bake/reference/emitters.h"
#include "relume/bake/context.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace relume {
namespace {

using namespace test;

// A rectangle of two triangles, one corner at `corner`.
double openRectangleLight(const glm::vec3& corner, const glm::vec3& a, const glm::vec3& b, const glm::vec3& shading,
                          const glm::vec3& geometric) {
  return double{openTriangleLight({corner, corner + a, corner + b}, shading, geometric)} +
         double{openTriangleLight({corner + a + b, corner + a, corner + b}, shading, geometric)};
}

// The midpoint rule over 2^20 patches of a triangle.
double sumOverPatches(const std::array<glm::vec3, 3>& corners, const glm::vec3& shading, const glm::vec3& geometric) {
  constexpr int kSide = 1024;
  const glm::dvec3 a = corners[0], b = corners[1] - corners[0], c = corners[2] - corners[0], across = glm::cross(b, c);
  const double area = 0.5 * glm::length(across) / (kSide * kSide);
  const glm::dvec3 normal = glm::normalize(across);
  double sum = 0.0;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide - i; ++j) {
      for (int upper = 0; upper < (i + j < kSide - 1 ? 2 : 1); ++upper) {
        const double third = upper == 0 ? 1.0 / 3.0 : 2.0 / 3.0;
        const glm::dvec3 p = a + b * ((i + third) / kSide) + c * ((j + third) / kSide);
        const double squared = glm::dot(p, p), cosine = glm::dot(p, glm::dvec3(shading));
        if (cosine <= 0.0 || glm::dot(p, glm::dvec3(geometric)) <= 0.0) continue;
        sum += area * cosine * std::abs(glm::dot(p, normal)) / (squared * squared);
      }
    }
  }
  return sum;
}

// A point across from a rectangle's corner, and one on a wall at a right angle to it: Siegel and Howell's factors C-11
// and C-12.
TEST(TriangleLight, rectanglesHaveTheirConfigurationFactors) {
  for (const auto& [x, y] : {std::array{1.0, 1.0}, std::array{0.2, 3.0}, std::array{40.0, 25.0}}) {
    const double rx = std::sqrt(1 + x * x), ry = std::sqrt(1 + y * y);
    const double parallel = 0.5 * (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry));
    const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
    EXPECT_NEAR(openRectangleLight({0, 0, 1}, {fx, 0, 0}, {0, fy, 0}, {0, 0, 1}, {0, 0, 1}), parallel, 1e-6 * parallel);
    // The wall's normal is along x: the rectangle begins where it stands.
    const double upright = 0.5 * (std::atan(y) - std::atan(y / rx) / rx);
    EXPECT_NEAR(openRectangleLight({0, 0, 1}, {fx, 0, 0}, {0, fy, 0}, {1, 0, 0}, {1, 0, 0}), upright, 1e-6 * upright);
  }
}

// Parts below the horizon, of either normal, send nothing.
TEST(TriangleLight, horizonsCut) {
  const std::array<glm::vec3, 3> corners{glm::vec3(-3, -1, 2), glm::vec3(4, -2, 1), glm::vec3(1, 5, 0.5f)};
  const glm::vec3 up(0, 0, 1), aside = glm::normalize(glm::vec3(1, 0.4f, 0.3f)),
                               other = glm::normalize(glm::vec3(-0.2f, 1, 0.1f));
  for (const glm::vec3& shading : {up, aside, other}) {
    for (const glm::vec3& geometric : {up, aside, other}) {
      const double expected = sumOverPatches(corners, shading, geometric);
      EXPECT_NEAR(openTriangleLight(corners, shading, geometric), expected, 2e-3 * expected);
    }
  }
  EXPECT_EQ(openTriangleLight(corners, -up, -up), 0.0f);
}

// cos cos' A / d² from a kilometre, as far as corners are floats.
TEST(TriangleLight, fromAfarATriangleIsAPoint) {
  const glm::vec3 middle(300, -400, 866), b(0.3f, 0, 0), c(0, 0.2f, 0);
  const std::array<glm::vec3, 3> corners{middle - (b + c) / 3.0f, middle + (2.0f * b - c) / 3.0f,
                                         middle + (2.0f * c - b) / 3.0f};
  const glm::dvec3 m = middle;
  const double d2 = glm::dot(m, m), expected = 0.03 * m.z * m.z / (d2 * d2);
  EXPECT_NEAR(openTriangleLight(corners, {0, 0, 1}, {0, 0, 1}) / expected, 1.0, 1e-3);
}

// What connections come to in the mean, if nothing is in the way: emitters on two sides, one seen from behind, and one
// from behind that emits from both sides.
TEST(EmittingTriangles, openIrradianceIsTheMeanOfConnections) {
  Scene scene;
  addInstance(scene, quad({-1, 2, 1}, {0, 0, -2}, {2, 0, 0}, addMaterial(scene, glm::vec3(0.5f), {1, 2, 4})));
  addInstance(scene, quad({3, 0.1f, 1}, {0, 1, 0}, {0, 0, -2}, addMaterial(scene, glm::vec3(0.5f), {8, 1, 1})));
  addInstance(scene, quad({-3, 0.1f, 1}, {0, 1, 0}, {0, 0, -2}, addMaterial(scene, glm::vec3(0.5f), {3, 3, 9})));
  addInstance(scene, quad({-2, 0.1f, 1}, {0, 0.5f, 0}, {0, 0, -1}, addMaterial(scene, glm::vec3(0.5f), {2, 5, 2})));
  scene.materials.back().doubleSided = true;
  addInstance(scene, quad({-1, 1, 1}, {0, 0, -2}, {2, 0, 0}, addMaterial(scene, glm::vec3(0.5f))));
  finish(scene);
  Context context;
  auto tracer = RayTracer::create(scene, "avx2", context);
  ASSERT_TRUE(tracer);
  const EmittingTriangles emitters(scene);
  ASSERT_TRUE(emitters.knowsOpenIrradiance());
  const glm::vec3 at(0.2f, 0, 0.1f), normal(0, 1, 0), bent = glm::normalize(glm::vec3(0.5f, 1, -0.3f));
  const glm::vec3 open = emitters.openIrradiance(at, bent, normal);
  std::vector<float> chances;
  emitters.aim(at, bent, chances);
  RandomStream random(7, 1, 2);
  glm::dvec3 sum(0.0), arriving(0.0);
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double u = random.uniform();
    const EmitterConnection c =
        connectEmitter(*tracer, emitters.sample(chances, u, random.uniform2()), at, bent, normal);
    sum += glm::dvec3(c.openIrradiance());
    arriving += glm::dvec3(c.irradiance());
  }
  for (int c = 0; c < 3; ++c) {
    EXPECT_GT(open[c], 0.1f);
    EXPECT_NEAR(sum[c] / kCount, open[c], 0.01 * open[c]);
    EXPECT_LT(arriving[c], 0.95 * sum[c]) << "the shelf is in the way";
  }
}

}  // namespace
}  // namespace relume
