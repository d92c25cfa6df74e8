// SPDX-License-Identifier: MIT
// What a bake says of its own error: against truths that are known, without bias by the noise of its rays, and the same
// however it is made.
#include "bake/base/random.h"
#include "bake/certificate/certify.h"
#include "bake/rays/seen_surface.h"
#include "bake/reference/path_tracer.h"
#include "bake/stages.h"
#include "formats/pack.h"
#include "relume/bake/bake.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "tests/measure/traced_light.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <array>
#include <cmath>
#include <span>
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

// What the runtime reads at the receivers after so many bounces: [receiver * lights + light].
std::vector<glm::vec3> readBounces(const Bake& bake, const TestRays& rays, int bounces) {
  const TestReceivers& receivers = rays.receivers;
  std::vector<glm::vec3> read(receivers.count() * rays.lights.size());
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
    for (int bounce = 0; bounce < bounces; ++bounce) {
      setup.bounceScale = bounce == 0 ? 0.0f : 1.0f;
      EXPECT_TRUE(relighter->relight(setup));
    }
    for (std::size_t i = 0; i < receivers.count(); ++i) {
      const std::uint32_t at = receivers.at[i];
      const glm::vec3 n = receivers.normal[i];
      read[i * rays.lights.size() + l] =
          at == kGridReceiver ? relighter->irradianceInGrid(receivers.positionWorld[i], n)
                              : relighter->irradianceOnLightmap(unpackUnorm16x2(at), n, receivers.geometricNormal[i]);
    }
  }
  return read;
}
std::vector<glm::vec3> readOnce(const Bake& bake, const TestRays& rays) { return readBounces(bake, rays, 1); }

// Mean over receivers and channels of what one light sends.
double meanOf(const std::vector<glm::vec3>& irradiance, std::size_t light, std::size_t lights) {
  double sum = 0.0;
  for (std::size_t i = light; i < irradiance.size(); i += lights)
    sum += static_cast<double>(irradiance[i].x + irradiance[i].y + irradiance[i].z) / 3.0;
  return sum * static_cast<double>(lights) / static_cast<double>(irradiance.size());
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
  ASSERT_GE(test.receivers.count(), 200u);
  for (const auto& set : test.irradiance) {
    for (std::size_t i = 0; i < test.receivers.count(); ++i)
      EXPECT_NEAR(set[i * test.lights.size()].x, kPi, 0.02f * kPi) << "E = pi L";
  }
  EXPECT_NEAR(test.meanLight[0], kPi, 0.02f * kPi) << "nothing is reflected onto a floor";
}

// Mean light of a test light after one bounce over all receivers, by rays that look for nothing else.
double meanOfOneLight(const Scene& scene, const PlacedLevel& placed, const SceneLight& light) {
  constexpr int kDirections = 64;
  RandomStream random(5, 0x77686F6C, 0);
  const TestReceivers& receivers = placed.test.receivers;
  double sum = 0.0;
  for (std::size_t i = 0; i < receivers.count(); ++i) {
    const glm::vec3 origin =
        receivers.positionWorld[i] + receivers.geometricNormal[i] * placed.tracer.epsilonAt(receivers.positionWorld[i]);
    for (int k = 0; k < kDirections; ++k) {
      const Ray ray{origin, 0.0f, test::cosineDirection(receivers.normal[i], random.uniform2())};
      const Hit hit = placed.tracer.trace(ray);
      if (!hit || glm::dot(ray.direction, receivers.geometricNormal[i]) <= 0.0f) continue;
      const SeenSurface seen = seenAt(scene, ray, hit);
      const glm::vec3 from = seen.positionWorld + seen.geometricNormal * placed.tracer.epsilonAt(seen.positionWorld);
      const glm::vec3 sent = albedoAt(scene, seen.point) *
                             directIrradiance(placed.tracer, std::span(&light, 1), from, seen.geometricNormal);
      sum += static_cast<double>(sent.x + sent.y + sent.z) / (3.0 * kDirections);
    }
  }
  return sum / static_cast<double>(receivers.count());
}

// Each light's own, though rays draw one of them and take surfels for the others: a single light that few surfels see
// is found with noise, all of them together are right.
TEST(TestRays, findEachLightWhole) {
  const Scene scene = sampleLevel();
  Context context;
  double ratios = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    BakeOptions options = test::smallBakeOptions();
    options.seed = seed;
    const Result<PlacedLevel> placed = placeLevel(scene, options, placeStages(options), context);
    ASSERT_TRUE(placed) << placed.error().message;
    const TestRays& test = placed->test;
    for (std::size_t l = 0; l < test.lights.size(); ++l) {
      if (test.lights[l].kind == TestLightKind::sky) continue;
      const double expected = meanOfOneLight(scene, *placed, test.lights[l].light);
      const double found =
          0.5 * (meanOf(test.irradiance[0], l, test.lights.size()) + meanOf(test.irradiance[1], l, test.lights.size()));
      if (!(expected > 0.0)) continue;
      EXPECT_NEAR(found, expected, 0.25 * expected) << "seed " << seed << ", light " << l;
      ratios += found / expected;
      ++count;
    }
  }
  ASSERT_GT(count, 12);
  EXPECT_NEAR(ratios / count, 1.0, 0.03);
}

TEST(TestRays, knowTheLightOfAllBounces) {
  const Tested tested = bakeWithRays(sampleLevel(), test::smallBakeOptions());
  const std::size_t lights = tested.rays.lights.size();
  const std::vector<glm::vec3> once = readOnce(tested.bake, tested.rays),
                               all = readBounces(tested.bake, tested.rays, 12);
  for (std::size_t l = 0; l < lights; ++l) {
    const double expected = meanOf(all, l, lights);
    EXPECT_NEAR(tested.rays.meanLight[l], expected, 0.12 * expected) << "light " << l;
    if (tested.rays.lights[l].kind != TestLightKind::lamp) continue;
    EXPECT_LT(1.2 * meanOf(once, l, lights), expected) << "bounces of light " << l;
  }
}

// Seven of eight are pixels of a camera that looks down on a corner of the floor.
TEST(TestRays, areSeenByCameras) {
  Scene scene = floorUnderTheSky();
  Camera camera;
  camera.name = "above";
  camera.toWorld = glm::translate(glm::mat4(1.0f), glm::vec3(2.0f, 2.0f, 2.0f)) *
                   glm::rotate(glm::mat4(1.0f), -0.5f * kPi, glm::vec3(1, 0, 0));
  camera.yfovRad = 2.0f * std::atan(0.5f);
  camera.aspect = 1.0f;
  scene.cameras.push_back(camera);
  Context context;
  const BakeOptions options = test::smallBakeOptions();
  const Result<PlacedLevel> placed = placeLevel(scene, options, placeStages(options), context);
  ASSERT_TRUE(placed) << placed.error().message;
  const TestReceivers& receivers = placed->test.receivers;
  ASSERT_GE(receivers.count(), 200u);
  std::size_t inPicture = 0;
  for (const glm::vec3& p : receivers.positionWorld)
    inPicture += std::abs(p.x - 2.0f) <= 1.001f && std::abs(p.z - 2.0f) <= 1.001f ? 1 : 0;
  EXPECT_GE(inPicture, receivers.count() * 7 / 8);
  EXPECT_LT(inPicture, receivers.count()) << "some are seen from elsewhere";
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
  // Half of what is read, squared, over the mean light, squared.
  const std::size_t lights = found->lightKind.size();
  ASSERT_EQ(lights, tested.rays.lights.size());
  double parts = 0.0, mean = 0.0;
  for (std::size_t l = 0; l < lights; ++l) {
    double squares = 0.0;
    for (std::size_t i = l; i < read.size(); i += lights) squares += static_cast<double>(glm::dot(read[i], read[i]));
    const double light = static_cast<double>(tested.rays.meanLight[l]);
    const double expected = 0.25 * squares / (3.0 * static_cast<double>(tested.rays.receivers.count()) * light * light);
    EXPECT_NEAR(found->squaredError[l], expected, 1e-4 * expected) << "light " << l;
    mean += static_cast<double>(found->squaredError[l]) / static_cast<double>(lights);
  }
  for (const float part : found->partError) parts += static_cast<double>(part);
  EXPECT_NEAR(parts, mean, 1e-4 * mean) << "the parts add up to the whole";

  TestRays same = tested.rays;
  for (auto& set : same.irradiance) set = read;
  const Result<Certificate> none = certify(tested.bake, same, context);
  ASSERT_TRUE(none);
  EXPECT_EQ(certifiedError(*none), 0.0f);
}

TEST(Certificate, saysLessOfABetterBake) {
  const Scene scene = sampleLevel();
  Context context;
  // Each seed has lights of its own, of which a few hide what the other settings change.
  float coarseSum = 0.0f, fineSum = 0.0f;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    BakeOptions options = test::smallBakeOptions();
    options.seed = seed;
    const auto coarse = bake(scene, options, context);
    options.surfels.count = 16384;
    options.caches.lightmapCaches = 6000;
    options.links.linksPerCache = 192;
    options.links.raysPerCache = 512;
    const auto fine = bake(scene, options, context);
    ASSERT_TRUE(coarse && fine);
    coarseSum += certifiedError(coarse->certificate);
    fineSum += certifiedError(fine->certificate);
  }
  EXPECT_GT(coarseSum, 1.5f * fineSum);
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
