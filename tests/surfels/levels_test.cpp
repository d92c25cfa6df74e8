// SPDX-License-Identifier: MIT
// Surfels on the large levels: areas, spacing and coverage hold there, too.
#include "bake/base/random.h"
#include "bake/surfels/surfels.h"
#include "formats/color.h"
#include "tests/surfels/make_level.h"

#include <filesystem>

namespace relume {
namespace {

void expectGoodSurfels(const char* file, std::uint32_t count, double spacingMin) {
  const std::filesystem::path path = std::filesystem::path(RELUME_SHARED_DIR) / "scenes" / file;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " does not exist: set RELUME_SHARED_DIR";
  Context context;
  const Result<Scene> scene = importGltf(path, context);
  ASSERT_TRUE(scene) << scene.error().message;
  const Result<RayTracer> tracer = RayTracer::create(*scene, "avx2", context);
  ASSERT_TRUE(tracer) << tracer.error().message;
  PlaySpaceOptions seen;
  seen.walks = 1u << 17;
  const Result<PlaySpace> space = findPlaySpace(*tracer, seen, 1, context);
  ASSERT_TRUE(space) << space.error().message;
  SurfelOptions options;
  options.count = count;
  const Result<PlacedSurfels> placed = placeSurfels(*tracer, *space, options, 1, context);
  ASSERT_TRUE(placed) << placed.error().message;
  EXPECT_EQ(placed->surfels.count(), count);
  EXPECT_LE(placed->statistics.areaError, 1e-3f);
  EXPECT_GT(placed->statistics.spacingMin, spacingMin * placed->statistics.spacingDensest);
  EXPECT_LT(placed->statistics.spacingCv, 0.15f);
  for (const glm::vec3& n : placed->surfels.normal) EXPECT_NEAR(glm::length(n), 1.0f, 1e-5f);
  for (const glm::vec3& a : placed->surfels.albedo) {
    EXPECT_TRUE(a.x >= 0 && a.y >= 0 && a.z >= 0 && a.x <= 1 && a.y <= 1 && a.z <= 1);
  }

  // Rays from where receivers can be find a surfel, on the side they hit.
  int hits = 0, unmapped = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    RandomStream r(3, 1, i);
    const glm::vec3 from = space->receivers[r.below(static_cast<std::uint32_t>(space->receivers.size()))];
    const glm::vec3 to(r.uniform() - 0.5f, r.uniform() - 0.5f, r.uniform() - 0.5f);
    if (glm::length(to) < 1e-3f) continue;
    const Hit hit = tracer->trace({from, 0.0f, glm::normalize(to)});
    if (!hit) continue;
    ++hits;
    const std::uint32_t side = 2 * (scene->instances[hit.instance].firstTriangle + hit.triangle) + (hit.back ? 1u : 0u);
    const std::uint32_t surfel = placed->map.at(side, hit.barycentric);
    if (surfel == kNone) {
      ++unmapped;
      continue;
    }
    const glm::vec3 front = geometricNormal(*scene, hit.point());
    // Less than a right angle to the surfel as it was placed, which is lit at a face within acos(0.85) of that.
    EXPECT_GT(glm::dot(hit.back ? -front : front, placed->surfels.normal[surfel]), -0.53f);
  }
  EXPECT_GT(hits, 2000);
  EXPECT_LT(unmapped, hits / 100);
}

// The least of 16,384 spacings is 0.650 to 0.655 of the densest, by the luck of the candidates.
TEST(Levels, sponza) { expectGoodSurfels("sponza/sponza.glb", 16384, 0.645); }
TEST(Levels, cornell) { expectGoodSurfels("cornell/cornell.glb", 8192, 0.65); }
TEST(Levels, house) { expectGoodSurfels("house/house.glb", 16384, 0.6); }

}  // namespace
}  // namespace relume
