// SPDX-License-Identifier: MIT
// Whole pictures by records: closed forms, the same bytes on any number of threads, limits, and levels that are bad.
#include "bake/preview/preview.h"

#include "bake/reference/emitters.h"
#include "bake/reference/path_tracer.h"
#include "tests/cancel_after.h"
#include "tests/preview/known_light.h"
#include "tests/preview/small_picture.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <cmath>
#include <vector>

namespace relume {
namespace {

using namespace test;

PreviewOptions smallPicture() { return pictureOf(48, 32, 2, 256); }

struct Asked {
  Camera camera;
  std::vector<SceneLight> lights;
  bool emissive = false;
  Sky sky;
};

// By direct light at what rays find.
Result<PreviewFrame> tryPreview(const Scene& scene, const Asked& asked, const PreviewOptions& options, Context& context,
                                std::vector<Record>& cache) {
  const RayTracer tracer = tracerOf(scene);
  const EmittingTriangles emitters(scene);
  const HitRadiance light =
      directRadiance(tracer, tracer, asked.lights, asked.emissive ? &emitters : nullptr, asked.sky, options.seed);
  return renderPreview({tracer, tracer, asked.camera, asked.lights, asked.emissive, asked.sky}, light, options, cache,
                       context);
}

PreviewFrame preview(const Scene& scene, const Asked& asked, const PreviewOptions& options, int threads = 0) {
  Context context;
  context.threads = threads;
  std::vector<Record> cache;
  auto frame = tryPreview(scene, asked, options, context, cache);
  EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
  return std::move(*frame);
}

SceneLight lamp(const glm::vec3& position, float intensity) {
  SceneLight light;
  light.positionWorld = position;
  light.intensity = glm::vec3(intensity, 2.0f * intensity, 0.5f * intensity);
  return light;
}

double meanOf(const std::vector<glm::vec3>& layer) {
  double sum = 0.0;
  for (const glm::vec3& v : layer) sum += v.x + v.y + v.z;
  return sum / static_cast<double>(layer.size());
}

// A room with a block in it and a lamp.
struct FurnishedRoom {
  Scene scene;
  Asked asked;
  FurnishedRoom() {
    const auto wall = addMaterial(scene, {0.7f, 0.5f, 0.6f});
    addInstance(scene, box({-2, 0, -2}, {2, 3, 2}, true, wall));
    addInstance(scene, box({-1, 0, -1}, {0, 1.2f, 0}, false, addMaterial(scene, glm::vec3(0.6f))));
    finish(scene);
    asked.camera = lookAt({1.6f, 2.2f, 1.7f}, {-0.5f, 0.4f, -0.6f}, 1.0f);
    asked.lights = {lamp({0.5f, 2.5f, 0.6f}, 10.0f)};
  }
};

// Every wall emits Le and reflects rho: what is reflected once leaves each point as rho Le, and irradiance / pi is
// that; straight it is Le. Layers are with albedo.
TEST(Preview, closedFurnaceGivesItsFirstBounce) {
  const float rho = 0.5f, le = 2.0f;
  Scene scene;
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, true, addMaterial(scene, glm::vec3(rho), glm::vec3(le))));
  finish(scene);
  const Asked asked{lookAt({0.2f, 0.1f, 0.3f}, {1, 0.2f, 0}), {}, true, {}};
  const RayTracer tracer = tracerOf(scene);
  const HitRadiance light = [&](std::uint64_t, float, std::span<const Ray>, std::span<const Hit> hits,
                                std::span<glm::vec3> radiance) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i]) radiance[i] = glm::vec3(rho * le);
    }
  };
  PreviewOptions options = smallPicture();
  options.emitterRays = 256;
  Context context;
  std::vector<Record> cache;
  const auto frame =
      renderPreview({tracer, tracer, asked.camera, asked.lights, true, asked.sky}, light, options, cache, context);
  ASSERT_TRUE(frame);
  for (const glm::vec3& bounced : frame->bounced) EXPECT_NEAR(bounced.y, rho * rho * le, 1e-3f);
  for (const glm::vec3& straight : frame->straight) EXPECT_NEAR(straight.y, rho * le, 1e-4f);
  EXPECT_NEAR(meanOf(frame->emission), 3 * le, 1e-4);
  EXPECT_NEAR(meanOf(frame->albedo), 3 * rho, 1e-5);
}

// Emitters' light is drawn by points: where nothing is in the way none of their noise is left, and less of it in a half
// shadow (0.092 with it).
TEST(Preview, emittersHaveNoNoiseButThatOfShadows) {
  const auto square = [](const std::vector<glm::vec3>& layer, const std::vector<glm::vec3>& other) {
    double sum = 0.0;
    for (std::size_t i = 0; i < layer.size(); ++i) {
      const glm::vec3 d = layer[i] - other[i];
      sum += glm::dot(d, d);
    }
    return sum;
  };
  for (const bool shaded : {false, true}) {
    Scene scene;
    addInstance(scene, quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, addMaterial(scene, {0.7f, 0.5f, 0.6f})));
    addInstance(scene, quad({-1, 2, 1}, {0, 0, -2}, {2, 0, 0}, addMaterial(scene, glm::vec3(0.0f), {3, 6, 9})));
    if (shaded)
      addInstance(scene, quad({-0.6f, 0.8f, 0.6f}, {1.2f, 0, 0}, {0, 0, -1.2f}, addMaterial(scene, glm::vec3(0.0f))));
    finish(scene);
    Asked asked{lookAt({0, 1.5f, 6}, {0, 0, 0}), {}, true, {}};
    PreviewOptions options = smallPicture();
    options.rays = 16;
    const PreviewFrame first = preview(scene, asked, options);
    options.seed = 2;
    const PreviewFrame second = preview(scene, asked, options);
    options.emitterRays = 1024;
    const PreviewFrame truth = preview(scene, asked, options);
    const double sum = square(truth.straight, std::vector<glm::vec3>(truth.straight.size(), glm::vec3(0.0f)));
    EXPECT_NEAR(meanOf(first.straight), meanOf(truth.straight), (shaded ? 2e-3 : 1e-5) * meanOf(truth.straight));
    EXPECT_LT(std::sqrt(square(first.straight, second.straight) / sum), shaded ? 0.08 : 1e-5);
  }
}

TEST(Preview, aConstantSkyLightsAnOpenPlaneByItsRadiance) {
  Scene scene;
  addInstance(scene, quad({-10, 0, 10}, {20, 0, 0}, {0, 0, -20}, addMaterial(scene, glm::vec3(0.5f))));
  finish(scene);
  Asked asked{lookAt({0, 3, 0.1f}, {0, 0, 0}), {}, false, {}};
  asked.sky.radiance = {0.5f, 1.0f, 2.0f};
  const PreviewFrame frame = preview(scene, asked, smallPicture());
  for (const glm::vec3& e : frame.straight) {
    EXPECT_NEAR(e.x, 0.25f, 1e-4f);
    EXPECT_NEAR(e.z, 1.0f, 1e-4f);
  }
  EXPECT_EQ(meanOf(frame.bounced), 0.0);
  EXPECT_GT(frame.records, 0u);
  EXPECT_EQ(frame.extended, 0u);
}

TEST(Preview, simplePicturesGetFinerRecords) {
  const FurnishedRoom room;
  PreviewOptions options = smallPicture();
  const PreviewFrame coarse = preview(room.scene, room.asked, options);
  options.fewRecords = coarse.records / 2;
  EXPECT_EQ(preview(room.scene, room.asked, options).bounced, coarse.bounced);
  options.fewRecords = 2 * coarse.records;
  const PreviewFrame fine = preview(room.scene, room.asked, options);
  EXPECT_NEAR(fine.accuracy, 0.1f, 1e-6f);
  EXPECT_GT(fine.records, coarse.records);
  EXPECT_GT(fine.rays, 800ull * fine.records) << "32/9 of 256 rays for each record, in strata of 4 x 4";
  // The same picture as if that had been asked for.
  options = smallPicture();
  options.accuracy = fine.accuracy;
  options.rays = 910;
  EXPECT_EQ(preview(room.scene, room.asked, options).bounced, fine.bounced);
  // Half as many rays where it is hardly simple.
  options = smallPicture();
  options.rounds = 0;
  options.fewRecords = preview(room.scene, room.asked, options).records + 1;
  const PreviewFrame less = preview(room.scene, room.asked, options);
  EXPECT_NEAR(less.accuracy, 0.1f, 1e-6f);
  EXPECT_NEAR(static_cast<double>(less.rays) / less.records, 0.5 * static_cast<double>(fine.rays) / fine.records,
              0.1 * static_cast<double>(fine.rays) / fine.records);
}

// Each record was gathered at a pixel's centre, and has a weight there.
TEST(Preview, pixelsKnowWhichOfThemHaveARecord) {
  const FurnishedRoom room;
  const PreviewFrame frame = preview(room.scene, room.asked, smallPicture());
  std::uint32_t marked = 0;
  for (std::size_t i = 0; i < frame.recordAt.size(); ++i) {
    if (frame.recordAt[i] == 0.0f) continue;
    ++marked;
    EXPECT_GT(frame.weight[i], 0.0f);
  }
  EXPECT_LE(marked, frame.records);
  EXPECT_GE(marked, 0.9 * frame.records) << "but for those that were gathered again";
}

// Against the path tracer's first bounce: the whole picture and its direct light.
TEST(Preview, firstBounceIsThePathTracers) {
  const FurnishedRoom room;
  const PreviewOptions options = smallPicture();
  const PreviewFrame frame = preview(room.scene, room.asked, options);
  ReferenceOptions truth;
  truth.width = options.width;
  truth.height = options.height;
  truth.samplesPerPixel = 256;
  truth.maxBounces = 1;
  const RayTracer tracer = tracerOf(room.scene);
  Context context;
  const auto image = renderReference(tracer, room.asked.camera, room.asked.lights, truth, context);
  ASSERT_TRUE(image);
  double square = 0.0, noise = 0.0, sum = 0.0, energy = 0.0;
  for (std::size_t i = 0; i < frame.bounced.size(); ++i) {
    const glm::vec3 expected = image->indirect[i] * image->albedo[i], d = frame.bounced[i] - expected,
                    err = image->indirectError[i] * image->albedo[i];
    square += glm::dot(d, d);
    noise += glm::dot(err, err);
    sum += glm::dot(expected, expected);
    energy += d.x + d.y + d.z;
  }
  EXPECT_LT(std::sqrt(std::max(0.0, square - noise) / sum), 0.03);
  EXPECT_NEAR(energy / (meanOf(frame.bounced) * static_cast<double>(frame.bounced.size())), 0.0, 0.01);
}

// A wall of 10 cm between a lit room and a dark one, seen along its edge from above: nothing of the light gets across.
TEST(Preview, noRecordLightsTheOtherSideOfAWall) {
  Scene scene;
  const auto white = addMaterial(scene, glm::vec3(0.8f));
  addInstance(scene, box({-2, 0, -1}, {0, 1, 1}, true, white));
  addInstance(scene, box({0.1f, 0, -1}, {2, 1, 1}, true, white));
  finish(scene);
  const Asked lit{lookAt({-1.5f, 0.5f, 0.5f}, {-0.2f, 0.2f, 0}), {lamp({-1, 0.8f, 0}, 5.0f)}, false, {}};
  const Asked dark{lookAt({1.5f, 0.5f, 0.5f}, {0.2f, 0.2f, 0}), {lamp({-1, 0.8f, 0}, 5.0f)}, false, {}};
  const RayTracer tracer = tracerOf(scene);
  const HitRadiance light = directRadiance(tracer, tracer, lit.lights, nullptr, lit.sky, 1);
  Context context;
  std::vector<Record> cache;
  const auto bright =
      renderPreview({tracer, tracer, lit.camera, lit.lights, false, lit.sky}, light, smallPicture(), cache, context);
  ASSERT_TRUE(bright);
  EXPECT_GT(meanOf(bright->bounced), 0.1);
  // With all records of the lit room in the cache.
  const auto black =
      renderPreview({tracer, tracer, dark.camera, dark.lights, false, dark.sky}, light, smallPicture(), cache, context);
  ASSERT_TRUE(black);
  EXPECT_EQ(meanOf(black->bounced), 0.0);
  EXPECT_EQ(meanOf(black->direct), 0.0);
}

TEST(Preview, sameBytesAtOneTwoAndSevenThreads) {
  const FurnishedRoom room;
  Asked asked = room.asked;
  asked.sky.radiance = glm::vec3(0.3f);
  for (const PlacementOrder order : {PlacementOrder::waves, PlacementOrder::linear}) {
    PreviewOptions options = smallPicture();
    options.order = order;
    const PreviewFrame one = preview(room.scene, asked, options, 1);
    for (const int threads : {2, 7}) {
      const PreviewFrame many = preview(room.scene, asked, options, threads);
      EXPECT_EQ(one.bounced, many.bounced);
      EXPECT_EQ(one.straight, many.straight);
      EXPECT_EQ(one.direct, many.direct);
      EXPECT_EQ(one.weight, many.weight);
      EXPECT_EQ(one.records, many.records);
    }
    options.seed = 2;
    EXPECT_NE(preview(room.scene, asked, options).bounced, one.bounced);
  }
}

TEST(Preview, wavesAndTheLinearScanAgree) {
  const FurnishedRoom room;
  PreviewOptions options = smallPicture();
  const PreviewFrame waves = preview(room.scene, room.asked, options);
  options.order = PlacementOrder::linear;
  const PreviewFrame linear = preview(room.scene, room.asked, options);
  double square = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < waves.bounced.size(); ++i) {
    const glm::vec3 d = waves.bounced[i] - linear.bounced[i];
    square += glm::dot(d, d);
    sum += glm::dot(waves.bounced[i], waves.bounced[i]);
  }
  EXPECT_GT(square, 0.0);
  EXPECT_LT(std::sqrt(square / sum), 0.05);
}

TEST(Preview, recordsOfOneViewServeTheNext) {
  const FurnishedRoom room;
  Context context;
  std::vector<Record> cache;
  const auto first = tryPreview(room.scene, room.asked, smallPicture(), context, cache);
  ASSERT_TRUE(first);
  const auto again = tryPreview(room.scene, room.asked, smallPicture(), context, cache);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->records, first->records);
  EXPECT_EQ(again->rays, 0u);
  EXPECT_EQ(again->bounced, first->bounced);
  Asked turned = room.asked;
  turned.camera = lookAt({1.6f, 2.2f, 1.7f}, {-0.65f, 0.4f, -0.45f}, 1.0f);
  const auto moved = tryPreview(room.scene, turned, smallPicture(), context, cache);
  ASSERT_TRUE(moved);
  EXPECT_LT(moved->records - first->records, first->records / 2);
}

TEST(Preview, tooFewRecordsReachFartherAndNoPixelStaysDark) {
  const FurnishedRoom room;
  Context context;
  int warnings = 0;
  context.onMessage = [&](Severity severity, std::string_view text) {
    warnings += severity == Severity::warning && text.find("--max-records") != std::string_view::npos ? 1 : 0;
  };
  PreviewOptions options = smallPicture();
  options.maxRecords = 3;
  std::vector<Record> cache;
  const auto frame = tryPreview(room.scene, room.asked, options, context, cache);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->records, 3u);
  EXPECT_EQ(warnings, 1);
  EXPECT_GT(frame->extended, 100u);
  for (const glm::vec3& light : frame->bounced) EXPECT_GT(light.y, 0.0f);
}

TEST(Preview, aTimeLimitLeavesAWholePicture) {
  const FurnishedRoom room;
  PreviewOptions options = smallPicture();
  options.timeLimitSeconds = 1e-300;
  const PreviewFrame frame = preview(room.scene, room.asked, options);
  EXPECT_EQ(frame.accuracy, 1.0f) << "the first picture, however short the time";
  EXPECT_EQ(frame.extended, 0u) << "is whole";
  options.timeLimitSeconds = 1000.0;
  const PreviewFrame whole = preview(room.scene, room.asked, options);
  EXPECT_FLOAT_EQ(whole.accuracy, options.accuracy);
  EXPECT_GT(whole.firstSeconds, 0.0);
  EXPECT_LE(whole.firstSeconds, whole.recordSeconds);
  EXPECT_EQ(whole.extended, 0u);
}

// Nothing to see, nothing to light, an eye within matter, and triangles of no area.
TEST(Preview, badViewsAreBlackOrSky) {
  const FurnishedRoom room;
  Scene empty;
  finish(empty);
  Asked away{lookAt({0, 50, 0}, {0, 100, 1}), {}, false, {}};
  away.sky.radiance = glm::vec3(2.0f);
  for (const Scene* scene : {&room.scene, static_cast<const Scene*>(&empty)}) {
    const PreviewFrame frame = preview(*scene, away, smallPicture());
    EXPECT_NEAR(meanOf(frame.emission), 6.0, 1e-5);
    EXPECT_EQ(frame.records, 0u);
  }
  Asked dark = room.asked;
  dark.lights.clear();
  EXPECT_EQ(meanOf(preview(room.scene, dark, smallPicture()).bounced), 0.0);
  Asked within = room.asked;
  within.camera = lookAt({-0.5f, 0.5f, -0.5f}, {1, 0.4f, 0.3f});
  EXPECT_TRUE(std::isfinite(meanOf(preview(room.scene, within, smallPicture()).bounced)));
  Scene slivers = room.scene;
  addInstance(slivers, quad({0, 1, 0}, {1e-20f, 0, 0}, {0, 1, 0}));
  finish(slivers);
  EXPECT_TRUE(std::isfinite(meanOf(preview(slivers, room.asked, smallPicture()).bounced)));
}

// The same level more than a kilometre from the origin.
TEST(Preview, farFromTheOriginItIsTheSame) {
  const FurnishedRoom room;
  FurnishedRoom moved;
  const glm::vec3 offset(1024.0f, 0.0f, -1024.0f);
  for (Instance& instance : moved.scene.instances) instance.toWorld[3] += glm::vec4(offset, 0.0f);
  moved.asked.camera.toWorld[3] += glm::vec4(offset, 0.0f);
  for (SceneLight& light : moved.asked.lights) light.positionWorld += offset;
  PreviewOptions options = smallPicture();
  options.rays = 4096;
  const double here = meanOf(preview(room.scene, room.asked, options).bounced),
               there = meanOf(preview(moved.scene, moved.asked, options).bounced);
  EXPECT_NEAR(there, here, 0.01 * here);
}

TEST(Preview, anOrthographicViewShowsThePlan) {
  FurnishedRoom room;
  room.asked.camera = lookAt({0, 2.9f, 0}, {0, 0, 0}, 1.0f, {0, 0, -1});
  room.asked.camera.orthographic = true;
  room.asked.camera.yMag = 1.2f;
  const PreviewFrame frame = preview(room.scene, room.asked, smallPicture());
  EXPECT_GT(meanOf(frame.bounced), 0.0);
  EXPECT_NEAR(frame.depth[0], 2.9f, 1e-4f);
}

TEST(Preview, optionsOutOfRangeAreRefused) {
  const FurnishedRoom room;
  for (const auto& change :
       {+[](PreviewOptions& o) { o.width = 0; }, +[](PreviewOptions& o) { o.height = 16385; },
        +[](PreviewOptions& o) { o.samples = 17; }, +[](PreviewOptions& o) { o.accuracy = 0.0f; },
        +[](PreviewOptions& o) { o.accuracy = NAN; }, +[](PreviewOptions& o) { o.rays = 15; },
        +[](PreviewOptions& o) { o.planeFovDeg = 180.0f; }, +[](PreviewOptions& o) { o.planeSide = 1; },
        +[](PreviewOptions& o) { o.maxRecords = 0; }, +[](PreviewOptions& o) { o.timeLimitSeconds = -1.0; },
        +[](PreviewOptions& o) { o.contrast = 0.0f; }, +[](PreviewOptions& o) { o.rounds = 17; },
        +[](PreviewOptions& o) { o.emitterRays = 0; }}) {
    PreviewOptions options = smallPicture();
    change(options);
    Context context;
    std::vector<Record> cache;
    const auto frame = tryPreview(room.scene, room.asked, options, context, cache);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, ErrorCode::usage);
  }
}

TEST(Preview, aCancelIsHeard) {
  const FurnishedRoom room;
  PreviewOptions options = smallPicture();
  options.rays = 32768;
  options.accuracy = 0.2f;
  const CancelledWork work([&](Context& context) {
    std::vector<Record> cache;
    const auto frame = tryPreview(room.scene, room.asked, options, context, cache);
    if (!frame) {
      EXPECT_EQ(frame.error().message, "cancelled");
    }
    return static_cast<bool>(frame);
  });
  EXPECT_LT(work.shareAfterCancel(0.3), 0.5);
}

}  // namespace
}  // namespace relume
