// SPDX-License-Identifier: MIT
// Light on what levels are made of, against path-traced irradiance: corners where closed two-sided pieces meet, and a
// small smooth ball, and facets that are shaded smooth.
#include "bake/base/parallel.h"
#include "bake/import/find_solids.h"
#include "relume/bake/bake.h"
#include "relume/relighter.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/measure/traced_light.h"
#include "tests/pipeline/read_at_hit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;

constexpr float kWidth = 4.0f, kHeight = 3.0f;
const glm::vec3 kMiddle(2.0f, 1.5f, 2.0f);

// A room of six slabs that run into each other at its edges, lit by a lamp.
Scene kitRoom(bool twoSided) {
  constexpr float t = 0.2f, w = kWidth, h = kHeight;
  Scene scene;
  scene.name = "kit";
  scene.materials.emplace_back();
  scene.materials[0].albedo = glm::vec3(0.6f);
  scene.materials[0].doubleSided = twoSided;
  const auto slab = [&](const char* node, const glm::vec3& low, const glm::vec3& high) {
    Mesh mesh;
    addBox(mesh, low, high, false);
    mesh.material = 0;
    addInstance(scene, std::move(mesh), node);
  };
  slab("floor", {-t, -t, -t}, {w + t, 0, w + t});
  slab("ceiling", {-t, h, -t}, {w + t, h + t, w + t});
  slab("left", {-t, -t, -t}, {0, h + t, w + t});
  slab("right", {w, -t, -t}, {w + t, h + t, w + t});
  slab("far", {-t, -t, -t}, {w + t, h + t, 0});
  slab("near", {-t, -t, w}, {w + t, h + t, w + t});
  scene.cameras = {test::cameraAt({3.2f, 1.6f, 3.2f})};
  SceneLight lamp;
  lamp.name = "lamp";
  lamp.intensity = glm::vec3(10.0f);
  lamp.positionWorld = {1.8f, 2.2f, 2.1f};
  scene.lights.push_back(lamp);
  return scene;
}

BakeOptions smallOptions() {
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = 16384;
  options.caches.lightmapCaches = 3000;
  options.links.linksPerCache = 192;
  options.links.raysPerCache = 2048;
  options.links.bands = options.lumaBands = 4;
  return options;
}

// Irradiance over bounces where rays hit: read from a bake, and traced.
struct Compared {
  std::vector<glm::vec3> found;
  std::vector<test::TracedReceiver> truth;
};

Compared compare(const Scene& scene, std::span<const Ray> rays, int paths) {
  Compared result;
  Context context;
  auto baked = bake(scene, smallOptions(), context);
  auto tracer = RayTracer::create(scene, "avx2", context);
  if (!baked || !tracer) {
    ADD_FAILURE() << (baked ? tracer.error() : baked.error()).message;
    return result;
  }
  const test::TracedLevel level{scene, *tracer, scene.lights, false};
  auto relighter = Relighter::create(*baked, {});
  if (!relighter) {
    ADD_FAILURE() << relighter.error().message;
    return result;
  }
  const std::vector<glm::vec3> direct = test::shadowedLight(level, baked->surfels);
  LightSetup setup;
  setup.surfelIrradiance = direct;
  if (const Result<int> frames = relightUntilConverged(*relighter, setup); !frames) {
    ADD_FAILURE() << frames.error().message;
    return result;
  }
  for (const Ray& ray : rays) {
    const Hit hit = tracer->trace(ray);
    if (!hit || hit.back) {
      ADD_FAILURE() << "a ray misses";
      continue;
    }
    const glm::vec3 position = ray.origin + hit.distance * ray.direction;
    const glm::vec3 plane = geometricNormal(scene, hit.point()), normal = shadingNormal(scene, hit.point());
    result.found.push_back(test::readAtHit(*baked, *relighter, hit, position, normal, plane));
    result.truth.push_back({position + plane * tracer->epsilonAt(position), normal, {}});
  }
  parallelChunks(context, "", result.truth.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      RandomStream random(7, 0x74657374, i);
      test::traceIrradiance(level, paths, random, result.truth[i]);
    }
  });
  return result;
}

// Along the edges of the room, two centimetres off the next wall.
std::vector<Ray> towardEdges() {
  std::vector<Ray> rays;
  for (int i = 0; i < 40; ++i) {
    const float s = 0.1f + 0.8f * static_cast<float>(i) / 39.0f, near = 0.02f;
    for (const glm::vec3& p :
         {glm::vec3(0.0f, kHeight * s, near), glm::vec3(near, kHeight * s, 0.0f), glm::vec3(kWidth * s, 0.0f, near),
          glm::vec3(kWidth * s, near, 0.0f), glm::vec3(0.0f, kHeight - near, kWidth * s),
          glm::vec3(kWidth * s, kHeight - near, 0.0f)})
      rays.push_back({kMiddle, 0.0f, glm::normalize(p - kMiddle)});
  }
  return rays;
}

float brightness(const glm::vec3& e) { return e.x + e.y + e.z; }

// The least of found / truth over the points.
float darkest(const Compared& c) {
  float min = INFINITY;
  for (std::size_t i = 0; i < c.found.size(); ++i)
    min = std::min(min, brightness(c.found[i]) / brightness(c.truth[i].truth()));
  return min;
}

TEST(SmallThings, cornersOfTwoSidedPiecesAreNotDark) {
  const std::vector<Ray> rays = towardEdges();
  Scene scene = kitRoom(true);
  const Compared sheets = compare(scene, rays, 256);
  Context context;
  findSolids(scene, context);
  const Compared solid = compare(scene, rays, 2048), oneSided = compare(kitRoom(false), rays, 256);
  ASSERT_EQ(solid.found.size(), rays.size());
  EXPECT_NE(sheets.found, oneSided.found) << "nothing is shown of solids";
  EXPECT_GT(darkest(sheets), 0.8f) << "caches stand in what nobody looks at";
  EXPECT_GT(darkest(solid), 0.85f);
  const test::TracedError error = test::errorOf(solid.truth, solid.found);
  EXPECT_LT(error.rmse, 0.05);
  EXPECT_NEAR(error.energy, 1.0, 0.04);
  EXPECT_EQ(solid.found, oneSided.found);
}

// A smooth ball of 0.3 m in the room.
TEST(SmallThings, aSmallBallIsLitAsTheTruthSays) {
  Scene scene = kitRoom(false);
  Mesh ball = test::sphere(0.3f, 24, 48);
  for (const glm::vec3& p : ball.position) ball.normal.push_back(glm::normalize(p));
  ball.material = 0;
  const glm::vec3 at(1.4f, 1.0f, 1.6f);
  addInstance(scene, std::move(ball), "ball", glm::translate(glm::mat4(1.0f), at));
  std::vector<Ray> rays;
  for (int i = 0; i < 400; ++i) {
    const float z = 1.0f - 2.0f * (static_cast<float>(i) + 0.5f) / 400.0f, r = std::sqrt(1.0f - z * z),
                angle = 2.39996f * static_cast<float>(i);
    const glm::vec3 d(r * std::cos(angle), z, r * std::sin(angle));
    rays.push_back({at + 0.35f * d, 0.0f, -d});
  }
  const Compared smooth = compare(scene, rays, 1024);
  ASSERT_EQ(smooth.found.size(), rays.size());
  const test::TracedError error = test::errorOf(smooth.truth, smooth.found);
  EXPECT_LT(error.rmse, 0.05);
  EXPECT_NEAR(error.energy, 1.0, 0.03);
}

// Rocks in the room, of steep facets that are shaded as one smooth surface, under a spot that lights nothing else: all
// light at the ceiling is theirs.
TEST(SmallThings, facetsThatAreShadedSmoothSendTheLightOfSmoothSurfaces) {
  Scene scene = kitRoom(false);
  constexpr int kAcross = 16;
  constexpr float kSize = 2.4f, kStep = kSize / kAcross;
  RandomStream random(3, 0x726f636b, 0);
  std::vector<glm::vec3> point;
  for (int i = 0; i <= kAcross; ++i) {
    for (int k = 0; k <= kAcross; ++k)
      point.push_back({0.8f + kStep * static_cast<float>(i), 0.1f + 1.2f * kStep * random.uniform(),
                       0.8f + kStep * static_cast<float>(k)});
  }
  Mesh rocks;
  rocks.material = 0;
  rocks.position = point;
  rocks.normal.assign(point.size(), glm::vec3(0, 1, 0));
  const auto at = [](int i, int k) { return static_cast<std::uint32_t>(i * (kAcross + 1) + k); };
  for (int i = 0; i < kAcross; ++i) {
    for (int k = 0; k < kAcross; ++k) {
      rocks.triangle.emplace_back(at(i, k), at(i, k + 1), at(i + 1, k + 1));
      rocks.triangle.emplace_back(at(i, k), at(i + 1, k + 1), at(i + 1, k));
    }
  }
  addInstance(scene, std::move(rocks), "rocks");
  SceneLight& spot = scene.lights[0];
  spot.kind = LightKind::spot;
  spot.positionWorld = kMiddle + glm::vec3(0.0f, 1.2f, 0.0f);
  spot.direction = {0, -1, 0};
  spot.outerConeRad = 0.4f;
  std::vector<Ray> rays;
  for (int i = 0; i < 12; ++i) {
    for (int k = 0; k < 12; ++k)
      rays.push_back(
          {{0.3f * static_cast<float>(i) + 0.35f, 2.5f, 0.3f * static_cast<float>(k) + 0.35f}, 0.0f, {0, 1, 0}});
  }
  const Compared ceiling = compare(scene, rays, 512);
  ASSERT_EQ(ceiling.found.size(), rays.size());
  EXPECT_NEAR(test::errorOf(ceiling.truth, ceiling.found).energy, 1.0, 0.02);
}

}  // namespace
}  // namespace relume
