// SPDX-License-Identifier: MIT
// What bench_grid_error measures with: bases of points, and the spline through a lattice's values.
#include "tests/measure/point_basis.h"

#include "bake/base/random.h"
#include "runtime/shared/grid_texture.h"
#include "tests/measure/spline_prefilter.h"
#include "tests/measure/traced_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string_view>
#include <vector>

namespace relume::test {
namespace {

// Numbers of the halves that a normal reads, or all of them.
std::vector<float> readOf(const PointBasis& basis, const SphereLight& light, const glm::vec3& n) {
  std::vector<float> kept(basis.numbers), read;
  basis.keep(light, kept);
  if (!basis.halves) return kept;
  const std::size_t group = basis.numbers / 6;
  for (int a = 0; a < 3; ++a) {
    const auto from = kept.begin() + static_cast<std::ptrdiff_t>(group * halfOf(n, a));
    read.insert(read.end(), from, from + static_cast<std::ptrdiff_t>(group));
  }
  return read;
}

template <class Radiance>
SphereLight lightOf(const Radiance& radiance) {
  constexpr std::uint32_t kSide = 400;
  SphereLight light;
  for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
    const glm::vec2 u((static_cast<float>(i % kSide) + 0.5f) / kSide, (static_cast<float>(i / kSide) + 0.5f) / kSide);
    const glm::vec3 d = sphereDirection(u);
    light.add(d, radiance(d), 4.0f * kPathPi / (kSide * kSide));
  }
  return light;
}

// Uniform light has no direction: bases but the print have pi of it for any normal, in its colour. 18 numbers take
// colour from the vector of the whole sphere, which is nothing here.
TEST(PointBasis, uniformLightIsPi) {
  const SphereLight light = lightOf([](const glm::vec3&) { return glm::vec3(1.0f, 0.5f, 0.25f); });
  for (const PointBasis& basis : pointBases()) {
    const std::string_view name = basis.name;
    if (name == "vectors, six slabs as printed") continue;
    for (std::uint64_t i = 0; i < 20; ++i) {
      RandomStream random(1, 2, i);
      const glm::vec3 n = sphereDirection(random.uniform2());
      const std::vector<float> read = readOf(basis, light, n);
      ASSERT_EQ(read.size(), basis.readNumbers());
      const glm::vec3 e = basis.read(read, n);
      if (name == "vectors, 18 numbers") {
        EXPECT_NEAR(0.25f * e.x + 0.5f * e.y + 0.25f * e.z, 0.5625f * kPathPi, 2e-3f) << name;
        continue;
      }
      EXPECT_NEAR(e.x, kPathPi, 4e-3f) << name;
      EXPECT_NEAR(e.z, 0.25f * kPathPi, 4e-3f) << name;
    }
  }
}

// A bright half and a dark one: E = pi (1 + n_y) / 2, which vectors have exactly along the axes. Two bands would, but
// for the third that is guessed.
TEST(PointBasis, halfALitSphereIsReadByItsAxes) {
  const SphereLight light = lightOf([](const glm::vec3& d) { return glm::vec3(d.y > 0.0f ? 1.0f : 0.0f); });
  for (const PointBasis& basis : pointBases()) {
    if (basis.bytes == 8) continue;
    const float bound = (basis.numbers == 12 ? 0.12f : 0.01f) * kPathPi;
    for (const float y : {1.0f, -1.0f}) {
      const glm::vec3 n(0.0f, y, 0.0f);
      EXPECT_NEAR(basis.read(readOf(basis, light, n), n).y, y > 0.0f ? kPathPi : 0.0f, bound) << basis.name;
    }
    const glm::vec3 n(1.0f, 0.0f, 0.0f);
    EXPECT_NEAR(basis.read(readOf(basis, light, n), n).y, 0.5f * kPathPi, bound) << basis.name;
  }
}

TEST(SplinePrefilter, theSplineHasTheValuesAtThePoints) {
  for (const glm::uvec3 r : {glm::uvec3(7, 5, 4), glm::uvec3(2, 3, 1)}) {
    std::vector<float> values(std::size_t{2} * r.x * r.y * r.z);
    RandomStream random(3, 4, r.x);
    for (float& v : values) v = random.uniform();
    std::vector<float> spline = values;
    prefilterSpline(spline, r, 2);
    for (std::uint32_t i = 0; i < r.x * r.y * r.z; ++i) {
      const glm::uvec3 p(i % r.x, i / r.x % r.y, i / r.x / r.y);
      const std::array<float, 4> w = splineWeights(0.0f);
      for (std::uint32_t k = 0; k < 2; ++k) {
        float sum = 0.0f;
        for (std::uint32_t c = 0; c < 64; ++c) {
          const glm::uvec3 o(c & 3, c >> 2 & 3, c >> 4);
          const glm::uvec3 at = glm::min(glm::max(p + o, glm::uvec3(1)) - 1u, r - 1u);
          sum += w[o.x] * w[o.y] * w[o.z] * spline[2 * ((std::size_t{at.z} * r.y + at.y) * r.x + at.x) + k];
        }
        EXPECT_NEAR(sum, values[2 * i + k], 1e-5f) << i;
      }
    }
  }
}

}  // namespace
}  // namespace relume::test
