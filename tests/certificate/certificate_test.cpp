// SPDX-License-Identifier: MIT
// What a bake says of its own error: against truths that are known, without bias by the noise of its rays, and the same
// however it is made.
#include "bake/base/random.h"
#include "bake/certificate/certify.h"
#include "bake/stages.h"
#include "formats/pack.h"
#include "relume/bake/bake.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr float kPi = 3.14159265f;

Scene sampleLevel() {
  Context context;
  Result<Scene> scene = loadScene(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", context, {}, MeshReport::none);
  EXPECT_TRUE(scene) << scene.error().message;
  return std::move(*scene);
}

// A square floor under the sky, and nothing else: every receiver sees all of the sky's half.
Scene floorUnderTheSky() {
  Scene scene;
  scene.name = "floor";
  Mesh mesh;
  mesh.name = "floor";
  mesh.position = {{-4, 0, -4}, {4, 0, -4}, {4, 0, 4}, {-4, 0, 4}};
  mesh.triangle = {{0, 2, 1}, {0, 3, 2}};
  mesh.material = 0;
  scene.meshes.push_back(mesh);
  Material material;
  material.albedo = glm::vec3(0.5f);
  scene.materials.push_back(material);
  Instance instance;
  instance.node = "floor";
  instance.mesh = 0;
  scene.instances.push_back(instance);
  return scene;
}

// Bakes by stages, so that the test rays are at hand.
struct Tested {
  Bake bake;
  TestRays rays;
};
Tested bakeWithRays(const Scene& scene, const BakeOptions& options) {
  Context context;
  Result<PlacedLevel> placed = placeLevel(scene, options, placeStages(options), context);
  EXPECT_TRUE(placed) << placed.error().message;
  TestRays rays = std::move(placed->test);
  Result<Bake> baked = bake(scene, options, context);
  EXPECT_TRUE(baked) << baked.error().message;
  return {std::move(*baked), std::move(rays)};
}

// What the runtime reads at the receivers after one bounce: [receiver * lights + light].
std::vector<glm::vec3> readOnce(const Bake& bake, const TestRays& rays) {
  std::vector<glm::vec3> read(rays.receiver.size() * rays.lights.size());
  RelightOptions options;
  options.simd = Simd::baseline;
  auto relighter = Relighter::create(bake, options);
  EXPECT_TRUE(relighter);
  for (std::size_t l = 0; l < rays.lights.size(); ++l) {
    std::vector<glm::vec3> direct(bake.surfels.count(), glm::vec3(0.0f));
    for (std::size_t s = 0; s < rays.lights[l].surfelIrradiance.size(); ++s)
      direct[s] = glm::vec3(rays.lights[l].surfelIrradiance[s]);
    LightSetup setup;
    setup.surfelIrradiance = direct;
    setup.emissionScale = glm::vec3(0.0f);
    setup.skyRadiance = glm::vec3(rays.lights[l].kind == TestLightKind::sky ? 1.0f : 0.0f);
    setup.bounceScale = 0.0f;
    EXPECT_TRUE(relighter->relight(setup));
    for (std::size_t i = 0; i < rays.receiver.size(); ++i) {
      const std::uint32_t s = rays.receiver[i], at = bake.surfels.receiver[s];
      const glm::vec3 n = bake.surfels.normal[s];
      read[i * rays.lights.size() + l] = at == kGridReceiver
                                             ? relighter->irradianceInGrid(bake.surfels.positionWorld[s], n)
                                             : relighter->irradianceOnLightmap(unpackUnorm16x2(at), n);
    }
  }
  return read;
}

TEST(TestRays, findTheWholeSkyOverAFloor) {
  const Scene scene = floorUnderTheSky();
  BakeOptions options = test::smallBakeOptions();
  options.playSpace.mode = PlaySpaceOptions::Mode::all;
  Context context;
  const Result<PlacedLevel> placed = placeLevel(scene, options, placeStages(options), context);
  ASSERT_TRUE(placed) << placed.error().message;
  const TestRays& test = placed->test;
  ASSERT_FALSE(test.lights.empty());
  ASSERT_EQ(test.lights[0].kind, TestLightKind::sky);
  ASSERT_GE(test.receiver.size(), 200u);
  for (const auto& set : test.irradiance) {
    for (std::size_t i = 0; i < test.receiver.size(); ++i)
      EXPECT_NEAR(set[i * test.lights.size()].x, kPi, 0.02f * kPi) << "E = pi L";
  }
}

TEST(Certificate, noiseOfTheRaysDropsOut) {
  const Tested tested = bakeWithRays(sampleLevel(), test::smallBakeOptions());
  const std::vector<glm::vec3> read = readOnce(tested.bake, tested.rays);
  // Rays whose mean is what the bake says, each with noise as large as that.
  TestRays noisy = tested.rays;
  RandomStream random(3, 0x6E6F6973, 0);
  for (auto& set : noisy.irradiance) {
    for (std::size_t i = 0; i < set.size(); ++i) set[i] = read[i] * (2.0f * random.uniform());
  }
  Context context;
  const Result<Certificate> independent = certify(tested.bake, noisy, context);
  noisy.irradiance[1] = noisy.irradiance[0];
  const Result<Certificate> same = certify(tested.bake, noisy, context);
  ASSERT_TRUE(independent && same);
  ASSERT_GE(independent->lightKind.size(), 4u);
  for (std::size_t l = 0; l < independent->lightKind.size(); ++l) {
    EXPECT_LE(std::abs(independent->squaredError[l]), 5.0f * independent->standardError[l]) << "light " << l;
    EXPECT_GT(same->squaredError[l], 0.01f) << "of one set, the variance of its noise";
  }
  EXPECT_LT(certifiedError(*independent), 0.5f * certifiedError(*same));
}

TEST(Certificate, findsAnErrorThatIsThere) {
  const Tested tested = bakeWithRays(sampleLevel(), test::smallBakeOptions());
  const std::vector<glm::vec3> read = readOnce(tested.bake, tested.rays);
  // The truth is half as bright again as what the bake says.
  TestRays brighter = tested.rays;
  for (auto& set : brighter.irradiance) {
    for (std::size_t i = 0; i < set.size(); ++i) set[i] = read[i] * 1.5f;
  }
  Context context;
  const Result<Certificate> found = certify(tested.bake, brighter, context);
  ASSERT_TRUE(found);
  // A quarter of the light of one bounce, over that of all: the more is kept at each bounce, the less.
  double parts = 0.0, mean = 0.0;
  for (std::size_t l = 0; l < found->lightKind.size(); ++l) {
    EXPECT_GT(found->squaredError[l], 0.02f) << "light " << l;
    EXPECT_LE(found->squaredError[l], 0.2501f) << "light " << l;
    mean += static_cast<double>(found->squaredError[l]) / static_cast<double>(found->lightKind.size());
  }
  for (const float part : found->partError) parts += static_cast<double>(part);
  EXPECT_NEAR(parts, mean, 1e-5) << "the parts add up to the whole";

  TestRays same = tested.rays;
  for (auto& set : same.irradiance) set = read;
  const Result<Certificate> none = certify(tested.bake, same, context);
  ASSERT_TRUE(none);
  EXPECT_EQ(certifiedError(*none), 0.0f);
}

TEST(Certificate, saysLessOfABetterBake) {
  const Scene scene = sampleLevel();
  BakeOptions options = test::smallBakeOptions();
  Context context;
  const auto coarse = bake(scene, options, context);
  options.surfels.count = 16384;
  options.caches.lightmapCaches = 6000;
  options.links.linksPerCache = 192;
  options.links.raysPerCache = 512;
  const auto fine = bake(scene, options, context);
  ASSERT_TRUE(coarse && fine);
  EXPECT_GT(certifiedError(coarse->certificate), 1.5f * certifiedError(fine->certificate));
}

TEST(Certificate, isTheSameAtAnyNumberOfThreads) {
  const Scene scene = sampleLevel();
  std::vector<std::byte> first;
  for (const int threads : {1, 2, 7}) {
    Context context;
    context.threads = threads;
    const auto baked = bake(scene, test::smallBakeOptions(), context);
    ASSERT_TRUE(baked);
    ASSERT_FALSE(baked->certificate.empty());
    const auto bytes = serializeBake(*baked);
    ASSERT_TRUE(bytes);
    if (first.empty()) first = *bytes;
    EXPECT_EQ(*bytes, first) << threads << " threads";
  }
}

TEST(Certificate, knowsNothingOfTheLevelsOwnLights) {
  Scene scene = sampleLevel();
  Context context;
  const auto with = bake(scene, test::smallBakeOptions(), context);
  ASSERT_FALSE(scene.lights.empty());
  scene.lights.clear();
  const auto without = bake(scene, test::smallBakeOptions(), context);
  ASSERT_TRUE(with && without);
  EXPECT_EQ(*serializeBake(*with), *serializeBake(*without));
}

}  // namespace
}  // namespace relume
