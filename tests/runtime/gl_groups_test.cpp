// SPDX-License-Identifier: MIT
// Work groups are cut for the driver: hardware shares a cache among many threads and pulls in small groups. A software
// driver runs those, too, so that machines without a GPU test them.
#include "runtime/gl/gl_backend.h"

#include "tests/runtime/ball.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/random_tree.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

namespace relume {
namespace {

class GlGroups : public test::GlTest {};

Owned<gl::GlBackend> make(const Bake& bake, int luma, int chroma, gpu::GroupThreads threads,
                          std::uint32_t movingParts) {
  const Result<gl::Functions> functions = gl::loadFunctions(EglContext::getProcAddress);
  EXPECT_TRUE(functions) << (functions ? "" : functions.error().message);
  if (!functions) return nullptr;
  auto made = gl::GlBackend::create(*functions, bake, {luma, chroma, bake.links.kind == LinkKind::irradiance}, {},
                                    ImageSizes(), GridTexture(std::pmr::new_delete_resource()),
                                    std::pmr::new_delete_resource(), movingParts, 4, threads);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return made ? std::move(*made) : nullptr;
}

// Two frames on both, so that bounces read what the first has written.
void expectSame(const Bake& bake, int luma, int chroma, const MovingShapes* shapes = nullptr,
                std::span<const MovingPart> parts = {}, float intensity = 1.0f) {
  const auto most = static_cast<std::uint32_t>(parts.size());
  const auto software = make(bake, luma, chroma, gpu::GroupThreads::serial, most),
             hardware = make(bake, luma, chroma, gpu::GroupThreads::parallel, most);
  ASSERT_TRUE(software && hardware);
  std::vector<Light> lights = test::someLights();
  for (Light& light : lights) light.intensity *= intensity;
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.2f, 0.3f, 0.4f};
  setup.movingShapes = shapes;
  setup.movingParts = parts;
  for (const auto* each : {&software, &hardware}) (*each)->reserve(setup);
  for (int frame = 0; frame < 2; ++frame) {
    software->relight(setup);
    hardware->relight(setup);
  }
  const std::vector<glm::vec3> a = software->nodeRadiosity(), b = hardware->nodeRadiosity();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const float largest = std::max({a[i].r, a[i].g, a[i].b});
    for (int k = 0; k < 3; ++k) ASSERT_NEAR(a[i][k], b[i][k], 0.02f * largest + 1e-5f) << "node " << i;
  }
  const auto toVector = [](std::span<const float> values) { return std::vector<float>(values.begin(), values.end()); };
  EXPECT_LT(test::coefficientDifference(toVector(software->coefficients()), toVector(hardware->coefficients()),
                                        luma * luma + 2 * chroma * chroma),
            1e-3);
}

TEST_F(GlGroups, ofHardwareLightCachesOfAllKindsAlike) {
  for (const LinkKind kind : kLinkKinds) {
    for (const auto& [luma, chroma] : {std::pair{1, 1}, {3, 1}, {4, 2}, {4, 4}}) {
      SCOPED_TRACE(std::to_string(static_cast<int>(kind)) + " Y" + std::to_string(luma) + "Co" +
                   std::to_string(chroma));
      expectSame(
          test::makeSyntheticBake({.surfels = 2000, .skyPatches = 12, .linksPerCache = 61, .kind = kind, .bands = 4}),
          luma, chroma);
    }
  }
}

// More than halves hold, which all threads of a cache dim alike.
TEST_F(GlGroups, ofHardwareDimCachesAlike) {
  const Bake bake = test::makeSyntheticBake({.surfels = 2000, .linksPerCache = 61, .kind = LinkKind::oct6});
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {4, 2}}) expectSame(bake, luma, chroma, nullptr, {}, 1e6f);
}

TEST_F(GlGroups, ofHardwareOccludeLinksOfAllKindsAlike) {
  const test::Ball ball(0.7f, 24);
  const glm::vec3 red(0.8f, 0.2f, 0.1f);
  const MovingMesh mesh{ball.position, ball.triangle, {&red, 1}};
  const Result<MovingShapes> shapes = MovingShapes::create({&mesh, 1});
  ASSERT_TRUE(shapes);
  MovingPart parts[2];
  parts[0].toWorld[3] = {6.0f, 2.0f, 3.0f};
  parts[1].toWorld[3] = {2.0f, 1.0f, 1.5f};
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(std::to_string(static_cast<int>(kind)));
    expectSame(
        test::makeSyntheticBake({.surfels = 2000, .skyPatches = 12, .linksPerCache = 61, .kind = kind, .bands = 4}), 4,
        2, &*shapes, parts);
  }
}

TEST_F(GlGroups, ofHardwarePullTreesOfAnyShapeAlike) {
  Bake bake = test::makeSyntheticBake({.surfels = 20000, .grid = {1, 1, 1}, .lightmapCaches = 6, .linksPerCache = 8});
  expectSame(bake, 2, 1);
  bake.hierarchy = test::makeRandomTree(20000, 0.05f, 5);
  expectSame(bake, 2, 1);
  bake = test::makeSyntheticBake({.surfels = 3000, .grid = {1, 1, 1}, .lightmapCaches = 6, .linksPerCache = 8});
  bake.hierarchy = test::makeRandomTree(3000, 0.0f, 5);
  expectSame(bake, 2, 1);
}

}  // namespace
}  // namespace relume
