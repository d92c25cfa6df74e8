// SPDX-License-Identifier: MIT
#include "bake/rays/ray_tracer.h"

#include "bake/base/random.h"
#include "bake/rays/ray_tracer_name.h"
#include "relume/bake/context.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

using namespace test;

RayTracer tracerOf(const Scene& scene, const std::string& isa = "avx2") {
  Context context;
  auto tracer = RayTracer::create(scene, isa, context);
  EXPECT_TRUE(tracer) << (tracer ? "" : tracer.error().message);
  return std::move(*tracer);
}

glm::vec3 hitPosition(const Scene& scene, const Hit& hit) {
  const auto c = scene.corners(scene.instances[hit.instance], hit.triangle);
  return c[0] + (c[1] - c[0]) * hit.barycentric.x + (c[2] - c[0]) * hit.barycentric.y;
}

glm::vec3 sphereDirection(RandomStream& random) {
  const glm::vec2 u = random.uniform2();
  const float z = 1 - 2 * u.x, r = std::sqrt(std::max(0.0f, 1 - z * z)), a = 6.2831853f * u.y;
  return {r * std::cos(a), r * std::sin(a), z};
}

std::vector<Ray> randomRays(std::size_t count, glm::vec3 low, glm::vec3 high) {
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    RandomStream random(7, 1, i);
    const glm::vec2 xy = random.uniform2();
    rays[i].origin = glm::mix(low, high, glm::vec3(xy, random.uniform()));
    rays[i].direction = sphereDirection(random);
  }
  return rays;
}

// Several meshes and instances, mirrored and stretched among them.
Scene clutter() {
  Scene scene;
  addInstance(scene, box({-4, -4, -4}, {4, 4, 4}, true));
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, false), glm::translate(glm::mat4(1), {2, 0, 0}));
  Instance mirrored = scene.instances.back();
  mirrored.toWorld = glm::scale(glm::translate(glm::mat4(1), {-2, 1, 0}), {-0.5f, 1.5f, 0.7f});
  scene.instances.push_back(mirrored);
  Instance turned = mirrored;
  turned.toWorld = glm::rotate(glm::translate(glm::mat4(1), {0, -2, 2}), 0.7f, glm::normalize(glm::vec3(1, 2, 3)));
  scene.instances.push_back(turned);
  finish(scene);
  return scene;
}

// Embree's cache for surfaces that are not used here would be 128 MiB.
TEST(RayTracer, startsInLittleMemory) {
  std::size_t pages = 0;
  ASSERT_TRUE(std::ifstream("/proc/self/statm") >> pages);
  rlimit before{};
  ::getrlimit(RLIMIT_AS, &before);
  const rlimit small{pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + (64u << 20), before.rlim_max};
  ::setrlimit(RLIMIT_AS, &small);
  const std::string name = rayTracerName("");
  ::setrlimit(RLIMIT_AS, &before);
  EXPECT_NE(name, "");
}

TEST(RayTracer, hitNamesInstanceTriangleAndBarycentricsOfTheWorldPoint) {
  const Scene scene = clutter();
  const RayTracer tracer = tracerOf(scene);
  const auto rays = randomRays(2000, glm::vec3(-3.9f), glm::vec3(3.9f));
  std::size_t others = 0;
  for (const Ray& ray : rays) {
    const Hit hit = tracer.trace(ray);
    ASSERT_TRUE(hit);
    others += hit.instance != 0;
    const glm::vec3 along = ray.origin + ray.direction * hit.distance;
    EXPECT_LT(glm::distance(along, hitPosition(scene, hit)), 1e-5f);
    const glm::vec3 n = geometricNormal(scene, hit.point());
    EXPECT_EQ(hit.back, glm::dot(n, ray.direction) > 0.0f);
  }
  EXPECT_GT(others, 100u);
}

TEST(RayTracer, frontsAndBacksAlsoOnMirroredInstances) {
  Scene scene;
  addInstance(scene, quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}));  // front up
  Instance mirrored = scene.instances[0];
  mirrored.toWorld = glm::scale(glm::translate(glm::mat4(1), {10, 0, 0}), {-1, 1, 1});
  scene.instances.push_back(mirrored);
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  for (const float x : {0.2f, 10.2f}) {
    EXPECT_FALSE(tracer.trace({{x, 1, 0.3f}, 0.0f, {0, -1, 0}}).back);
    EXPECT_TRUE(tracer.trace({{x, -1, 0.3f}, 0.0f, {0, 1, 0}}).back);
  }
}

// Bit for bit: Embree's own numbers differ in the last bits between instruction sets, packets, and makers of
// processors.
TEST(RayTracer, hitsAreTheSameInPacketsAndWithEveryInstructionSet) {
  const Scene scene = clutter();
  const auto rays = randomRays(20003, glm::vec3(-3.9f), glm::vec3(3.9f));  // not a multiple of a packet
  std::vector<Hit> first;
  for (const char* isa : {"avx2", "sse2", "sse4.2", ""}) {
    SCOPED_TRACE(isa);
    const RayTracer tracer = tracerOf(scene, isa);
    std::vector<Hit> hits(rays.size());
    std::vector<std::uint8_t> blocked(rays.size());
    tracer.trace(rays, hits);
    tracer.occluded(rays, blocked);
    if (first.empty()) first = hits;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Hit single = tracer.trace(rays[i]);
      for (const Hit& hit : {hits[i], single}) {
        ASSERT_EQ(hit.instance, first[i].instance);
        ASSERT_EQ(hit.triangle, first[i].triangle);
        ASSERT_EQ(hit.distance, first[i].distance);
        ASSERT_EQ(hit.barycentric, first[i].barycentric);
        ASSERT_EQ(hit.back, first[i].back);
      }
      ASSERT_EQ(blocked[i], 1);
      ASSERT_TRUE(tracer.occluded(rays[i]));
    }
  }
}

// Rays along the plane of a triangle and through its corners, far away and tiny: every hit has a place on it.
TEST(RayTracer, hitsOfSliversHaveAFinitePlaceWithinTheRay) {
  Scene scene;
  Mesh slivers;
  for (int i = 0; i < 400; ++i) {
    RandomStream random(11, 2, static_cast<std::uint64_t>(i));
    const glm::vec3 at = 10.0f * sphereDirection(random), along = sphereDirection(random);
    const float width = std::pow(10.0f, -1.0f - 7.0f * random.uniform());
    const auto first = static_cast<std::uint32_t>(slivers.position.size());
    slivers.position.insert(slivers.position.end(),
                            {at, at + along, at + 0.5f * along + width * sphereDirection(random)});
    slivers.triangle.emplace_back(first, first + 1, first + 2);
  }
  addInstance(scene, slivers);
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  int hits = 0;
  for (std::uint64_t i = 0; i < 40000; ++i) {
    RandomStream random(12, 3, i);
    const glm::uvec3 triangle = slivers.triangle[i % slivers.triangle.size()];
    const glm::vec3 target = glm::mix(slivers.position[triangle.x], slivers.position[triangle.y], random.uniform());
    Ray ray;
    ray.origin = 20.0f * sphereDirection(random);
    if (i % 2) ray.origin = target + slivers.position[triangle.y] - slivers.position[triangle.x];  // in its plane
    ray.direction = glm::normalize(target - ray.origin);
    const Hit hit = tracer.trace(ray);
    if (!hit) continue;
    ++hits;
    ASSERT_TRUE(std::isfinite(hit.distance));
    ASSERT_GE(hit.distance, 0.0f);
    ASSERT_GE(hit.barycentric.x, 0.0f);
    ASSERT_GE(hit.barycentric.y, 0.0f);
    ASSERT_LE(hit.barycentric.x + hit.barycentric.y, 1.0f + 1e-6f);
  }
  EXPECT_GT(hits, 100);
}

TEST(RayTracer, occlusionEndsAtTheRaysLength) {
  Scene scene;
  addInstance(scene, quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}));
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  EXPECT_TRUE(tracer.occluded({{0, 1, 0}, 0.0f, {0, -1, 0}, 1.01f}));
  EXPECT_FALSE(tracer.occluded({{0, 1, 0}, 0.0f, {0, -1, 0}, 0.99f}));
  EXPECT_FALSE(tracer.occluded({{0, 1, 0}, 1.01f, {0, -1, 0}}));
}

TEST(RayTracer, aClosedRoomHoldsRandomRays) {
  // A sphere of many triangles around the origin. About one ray of ten million finds a gap between two triangles.
  Scene scene;
  Mesh sphere;
  constexpr std::uint32_t kRows = 48, kColumns = 96;
  for (std::uint32_t r = 0; r <= kRows; ++r) {
    for (std::uint32_t c = 0; c < kColumns; ++c) {
      const float a = 3.14159265f * r / kRows, b = 6.2831853f * c / kColumns;
      const float ring = r == 0 || r == kRows ? 0.0f : std::sin(a);  // the poles are points, not tiny holes
      sphere.position.emplace_back(ring * std::cos(b), std::cos(a), ring * std::sin(b));
    }
  }
  for (std::uint32_t r = 0; r < kRows; ++r) {
    for (std::uint32_t c = 0; c < kColumns; ++c) {
      const std::uint32_t a = r * kColumns + c, b = r * kColumns + (c + 1) % kColumns;
      sphere.triangle.emplace_back(a, b, b + kColumns);
      sphere.triangle.emplace_back(a, b + kColumns, a + kColumns);
    }
  }
  addInstance(scene, sphere);
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  std::vector<Ray> rays = randomRays(200000, glm::vec3(-0.5f), glm::vec3(0.5f));
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  EXPECT_LE(std::count_if(hits.begin(), hits.end(), [](const Hit& h) { return !h; }), 1);
}

TEST(RayTracer, alphaMaskLetsRaysThroughWhatItCutsOut) {
  Scene scene;
  const std::uint32_t material = addHalfMask(scene);
  addInstance(scene, quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, material));
  addInstance(scene, quad({0, 0, -1}, {1, 0, 0}, {0, 1, 0}));
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  EXPECT_EQ(tracer.trace({{0.25f, 0.4f, 1}, 0.0f, {0, 0, -1}}).instance, 1u);
  EXPECT_EQ(tracer.trace({{0.75f, 0.4f, 1}, 0.0f, {0, 0, -1}}).instance, 0u);
  const std::vector<Ray> rays{{{0.25f, 0.4f, 1}, 0.0f, {0, 0, -1}, 1.5f}, {{0.75f, 0.4f, 1}, 0.0f, {0, 0, -1}, 1.5f}};
  std::vector<std::uint8_t> blocked(2);
  tracer.occluded(rays, blocked);
  EXPECT_EQ(blocked[0], 0);
  EXPECT_EQ(blocked[1], 1);
}

TEST(RayTracer, onlyFixedInstancesAreHit) {
  for (const BakeMode mode : {BakeMode::dynamic, BakeMode::ignore}) {
    Scene scene;
    addInstance(scene, quad({-1, 1, 1}, {2, 0, 0}, {0, 0, -2}));
    scene.instances[0].mode = mode;
    addInstance(scene, quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}));
    finish(scene);
    const RayTracer tracer = tracerOf(scene);
    const Hit hit = tracer.trace({{0, 5, 0}, 0.0f, {0, -1, 0}});
    EXPECT_EQ(hit.instance, 1u);
    EXPECT_FLOAT_EQ(hit.distance, 5.0f);
    EXPECT_FLOAT_EQ(tracer.boundsMax().y, 0.0f);
  }
}

TEST(RayTracer, copesWithNothingWithDegenerateTrianglesAndWithFlatInstances) {
  Scene scene;
  const RayTracer none = tracerOf(scene);
  EXPECT_FALSE(none.trace({{0, 0, 0}, 0.0f, {0, 0, 1}}));
  EXPECT_FALSE(none.occluded({{0, 0, 0}, 0.0f, {0, 0, 1}}));

  Mesh degenerate = quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  degenerate.triangle.emplace_back(0, 0, 1);
  degenerate.triangle.emplace_back(2, 2, 2);
  addInstance(scene, degenerate);
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, false),
              glm::scale(glm::translate(glm::mat4(1), {0, 3, 0}), {1, 0, 1}));
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, false), glm::scale(glm::mat4(1), {0, 0, 0}));
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  EXPECT_EQ(tracer.trace({{0.1f, 1, 0.2f}, 0.0f, {0, -1, 0}}).instance, 0u);
  EXPECT_EQ(tracer.trace({{0.1f, 9, 0.2f}, 0.0f, {0, -1, 0}}).instance, 1u);
}

TEST(RayTracer, saysWhichEmbreeAndWhichInstructionSet) {
  const Scene scene = clutter();
  Context context;
  const auto tracer = RayTracer::create(scene, "avx2", context);
  ASSERT_TRUE(tracer);
  EXPECT_NE(tracer->description().find("embree 3."), std::string::npos);
  EXPECT_NE(tracer->description().find("isa=avx2"), std::string::npos);
}

TEST(RayTracer, anInstructionSetThatTheProcessorLacksIsNamed) {
  const Scene scene = clutter();
  Context context;
  const auto tracer = RayTracer::create(scene, "avx512", context);
  if (tracer) GTEST_SKIP() << "this processor has avx512";
  EXPECT_EQ(tracer.error().code, ErrorCode::unsupported);
  for (const char* word : {"processor", "avx512", "--isa"})
    EXPECT_NE(tracer.error().message.find(word), std::string::npos) << word << " in: " << tracer.error().message;
}

TEST(RayTracer, hitsAreTheSameAtAnyThreadCount) {
  // Two coplanar sheets over each other: every hit is a tie.
  Scene scene;
  for (int sheet = 0; sheet < 2; ++sheet) {
    Mesh mesh;
    constexpr std::uint32_t kSide = 40;
    for (std::uint32_t i = 0; i <= kSide; ++i) {
      for (std::uint32_t k = 0; k <= kSide; ++k) mesh.position.emplace_back(i, 0, k);
    }
    for (std::uint32_t i = 0; i < kSide; ++i) {
      for (std::uint32_t k = 0; k < kSide; ++k) {
        const std::uint32_t a = i * (kSide + 1) + k;
        mesh.triangle.emplace_back(a, a + 1, a + kSide + 1);
        mesh.triangle.emplace_back(a + 1, a + kSide + 2, a + kSide + 1);
      }
    }
    addInstance(scene, mesh);
  }
  finish(scene);
  Context one, many;
  one.threads = 1;
  many.threads = 8;
  const auto a = RayTracer::create(scene, "avx2", one), b = RayTracer::create(scene, "avx2", many);
  ASSERT_TRUE(a && b);
  auto rays = randomRays(20000, {0, 1, 0}, {40, 2, 40});
  std::vector<Hit> hitsA(rays.size()), hitsB(rays.size());
  a->trace(rays, hitsA);
  b->trace(rays, hitsB);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(hitsA[i].instance, hitsB[i].instance);
    ASSERT_EQ(hitsA[i].triangle, hitsB[i].triangle);
    ASSERT_EQ(hitsA[i].distance, hitsB[i].distance);
    ASSERT_EQ(hitsA[i].barycentric, hitsB[i].barycentric);
  }
}

// Two sheets in one place, cut into triangles differently, the second turned over: each side shows its own front, with
// every instruction set. One sheet over itself: the first counts.
TEST(RayTracer, surfacesInOnePlaceAreToldApartByRule) {
  Scene scene;
  addInstance(scene, quad({-1, 0.3f, 1}, {2, 0, 0}, {0, 0, -2}));     // front up
  addInstance(scene, quad({-1, 0.3f, -1}, {0.7f, 0, 0}, {0, 0, 2}));  // front down, a part of it
  addInstance(scene, quad({-0.3f, 0.3f, -1}, {1.3f, 0, 0}, {0, 0, 2}));
  addInstance(scene, quad({-0.9f, 0.3f, 0.9f}, {1.5f, 0, 0}, {0, 0, -1.4f}));  // front up again
  finish(scene);
  for (const char* isa : {"avx2", "sse2", "sse4.2", ""}) {
    SCOPED_TRACE(isa);
    const RayTracer tracer = tracerOf(scene, isa);
    for (std::uint64_t i = 0; i < 20000; ++i) {
      RandomStream random(13, 4, i);
      const glm::vec2 x = 1.9f * (random.uniform2() - 0.5f);
      const float from = i % 2 ? 1.0f : -1.0f;
      Ray ray;
      ray.origin = {3.0f * (random.uniform() - 0.5f), 0.3f + from, 3.0f * (random.uniform() - 0.5f)};
      ray.direction = glm::normalize(glm::vec3(x.x, 0.3f, x.y) - ray.origin);
      const Hit hit = tracer.trace(ray);
      ASSERT_TRUE(hit);
      ASSERT_FALSE(hit.back);
      if (from > 0.0f) {
        ASSERT_EQ(hit.instance, 0u);
      } else if (std::abs(x.x + 0.3f) > 1e-4f) {
        ASSERT_EQ(hit.instance, x.x < -0.3f ? 1u : 2u);
      }
    }
  }
}

// Where overlaps are not looked for rays are stopped by the same, and some triangle there is hit.
TEST(RayTracer, structureForShadowsHasTheSameOcclusion) {
  Scene scene = clutter();
  for (int i = 0; i < 3; ++i) addInstance(scene, quad({-3, 0.3f, 3}, {5, 0, 0}, {0, 0, -4}));
  addInstance(scene, quad({-3, 0.3f, 3}, {0, 0, -4}, {5, 0, 0}));
  finish(scene);
  Context context;
  const auto shadows = RayTracer::create(scene, "avx2", context, RayStructure::shadows);
  ASSERT_TRUE(shadows) << shadows.error().message;
  const RayTracer quick = tracerOf(scene);
  std::vector<Ray> rays = randomRays(20000, glm::vec3(-3.9f), glm::vec3(3.9f));
  for (std::size_t i = 0; i < rays.size(); i += 2) rays[i].tMax = 2.0f;
  std::vector<std::uint8_t> ours(rays.size()), theirs(rays.size());
  shadows->occluded(rays, ours);
  quick.occluded(rays, theirs);
  EXPECT_EQ(ours, theirs);
  const auto stopped = std::count(ours.begin(), ours.end(), 1);
  EXPECT_GT(stopped, 12000);
  EXPECT_LT(stopped, 19000);
  for (std::size_t i = 0; i < 2000; ++i) {
    const Hit hit = shadows->trace(rays[i]), one = quick.trace(rays[i]);
    ASSERT_EQ(shadows->occluded(rays[i]), theirs[i] != 0);
    ASSERT_EQ(static_cast<bool>(hit), static_cast<bool>(one));
    ASSERT_TRUE(!hit || std::abs(hit.distance - one.distance) < 1e-4f);
  }
}

// The same of two fans of 2,000 triangles: overlaps are not looked for near the corner that all of a fan share.
TEST(RayTracer, fansInOnePlaceAreToldApartByRule) {
  constexpr std::uint32_t kTriangles = 2000;
  const auto fan = [](float side) {
    Mesh mesh;
    mesh.position.emplace_back(0.0f);
    for (std::uint32_t i = 0; i < kTriangles; ++i) {
      const double a = 2.0 * 3.14159265358979 * i / kTriangles;
      mesh.position.emplace_back(5.0 * std::cos(a), 0.0, -side * 5.0 * std::sin(a));
      mesh.triangle.emplace_back(0, 1 + i, 1 + (i + 1) % kTriangles);
    }
    mesh.material = kNone;
    return mesh;
  };
  Scene scene;
  addInstance(scene, fan(1.0f));   // front up
  addInstance(scene, fan(-1.0f));  // front down
  finish(scene);
  const RayTracer tracer = tracerOf(scene, "avx2");
  for (std::uint64_t i = 0; i < 2000; ++i) {
    RandomStream random(13, 5, i);
    const glm::vec2 x = 6.0f * (random.uniform2() - 0.5f);
    const float from = i % 2 ? 1.0f : -1.0f;
    Ray ray;
    ray.origin = {x.x, from, x.y};
    ray.direction = {0.0f, -from, 0.0f};
    const Hit hit = tracer.trace(ray);
    ASSERT_TRUE(hit);
    ASSERT_FALSE(hit.back);
    ASSERT_EQ(hit.instance, from > 0.0f ? 0u : 1u);
  }
}

TEST(RayTracer, epsilonFollowsTheSizeOfTheCoordinates) {
  // A room in millimetres, in metres, and 200 km away.
  for (const auto& [size, offset] : {std::pair{0.004f, 0.0f}, {4.0f, 0.0f}, {8.0f, 2e5f}}) {
    Scene scene;
    addInstance(scene, box(glm::vec3(offset), glm::vec3(offset + size), true));
    finish(scene);
    const RayTracer tracer = tracerOf(scene);
    const glm::vec3 inside(offset + 0.5f * size);
    const Hit hit = tracer.trace({inside, 0.0f, glm::normalize(glm::vec3(0.3f, -1, 0.2f))});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit.distance, glm::length(glm::vec3(0.15f, 0.5f, 0.1f)) * size, 0.005f * size);
    const glm::vec3 p = hitPosition(scene, hit);
    const float epsilon = tracer.epsilonAt(p);
    EXPECT_GT(epsilon, 0.0f);
    EXPECT_LT(epsilon, 0.015f * size);
    // Off the floor by epsilon, the ceiling is seen and the floor does not hide it.
    const glm::vec3 start = p + glm::vec3(0, epsilon, 0);
    EXPECT_NE(start.y, p.y);
    EXPECT_NEAR(tracer.trace({start, 0.0f, {0, 1, 0}}).distance, size, 0.06f * size);
  }
}

TEST(RayTracer, levelsTooFarFromTheOriginForTheirSizeAreToldOf) {
  for (const auto& [offset, count] : {std::pair{0.0f, 0u}, {4e3f, 0u}, {2e4f, 1u}, {1e6f, 1u}}) {
    Scene scene;
    addInstance(scene, box(glm::vec3(offset), glm::vec3(offset + 4.0f), true));
    finish(scene);
    Context context;
    std::vector<std::string> said;
    context.onMessage = [&](Severity, std::string_view text) { said.emplace_back(text); };
    ASSERT_TRUE(RayTracer::create(scene, "avx2", context));
    ASSERT_EQ(said.size(), count) << offset;
    if (count > 0) {
      EXPECT_NE(said[0].find("m from the origin"), std::string::npos) << said[0];
    }
  }
}

TEST(RayTracer, meetsDynamicInstancesOnlyWhenAskedFor) {
  Scene scene;
  addInstance(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}));
  const std::uint32_t moving = addInstance(scene, quad({-5, 1, 5}, {10, 0, 0}, {0, 0, -10}));
  const std::uint32_t ignored = addInstance(scene, quad({-5, 2, 5}, {10, 0, 0}, {0, 0, -10}));
  scene.instances[moving].mode = BakeMode::dynamic;
  scene.instances[ignored].mode = BakeMode::ignore;
  finish(scene);
  Context context;
  const Ray down{{0.3f, 3.0f, 0.4f}, 0.0f, {0, -1, 0}};
  const auto fixed = RayTracer::create(scene, "avx2", context);
  const auto drawn = RayTracer::create(scene, "avx2", context, RayStructure::thorough, RayGeometry::drawn);
  ASSERT_TRUE(fixed && drawn);
  EXPECT_EQ(fixed->trace(down).instance, 0u);
  EXPECT_EQ(drawn->trace(down).instance, moving);
  EXPECT_EQ(fixed->boundsMax().y, 0.0f);
  EXPECT_EQ(drawn->boundsMax().y, 1.0f);
}

}  // namespace
}  // namespace relume
