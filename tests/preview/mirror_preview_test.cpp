// SPDX-License-Identifier: MIT
// Pictures with gloss: closed forms, the path tracer, the same bytes on any number of threads, and what is out of
// range.
#include "bake/preview/mirror_surface.h"
#include "bake/preview/preview.h"
#include "bake/reference/emitters.h"
#include "bake/reference/path_tracer.h"
#include "relume/glossy.h"
#include "tests/preview/small_picture.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

namespace relume {
namespace {

using namespace test;

PreviewOptions smallGlossyPicture() {
  PreviewOptions options = pictureOf(48, 32, 2, 256);
  options.gloss = true;
  return options;
}

std::uint32_t addGlossy(Scene& scene, const glm::vec3& albedo, float metalness, float exponent) {
  const std::uint32_t material = addMaterial(scene, albedo);
  scene.materials[material].gloss.metalness = metalness;
  scene.materials[material].gloss.roughness = glossyRoughness(exponent);
  return material;
}

// A room with a lamp, a metal back wall and a ball-like block of paint in it.
struct MirrorRoom {
  Scene scene;
  Camera camera = lookAt({1.6f, 1.9f, 1.7f}, {-0.4f, 0.9f, -1.5f}, 1.0f);
  std::vector<SceneLight> lights;
  Sky sky;
  bool emissive = false;
  explicit MirrorRoom(float exponent = 12.0f) {
    addInstance(scene, box({-2, 0, -2}, {2, 3, 2}, true, addGlossy(scene, {0.7f, 0.5f, 0.6f}, 0.0f, 1.0f)));
    addInstance(scene, quad({-1.9f, 0.1f, -1.9f}, {3.8f, 0, 0}, {0, 2.8f, 0},
                            addGlossy(scene, {0.9f, 0.8f, 0.6f}, 1.0f, exponent)));
    addInstance(scene, box({-1, 0, -1}, {0, 0.8f, 0}, false, addGlossy(scene, glm::vec3(0.6f), 0.0f, 6.0f)));
    finish(scene);
    lights.resize(1);
    lights[0].positionWorld = {0.5f, 2.5f, 0.6f};
    lights[0].intensity = {10, 20, 5};
  }
  RayTracer tracer() const {
    Context context;
    auto made = RayTracer::create(scene, "avx2", context, RayStructure::bundles);
    EXPECT_TRUE(made);
    return std::move(*made);
  }
  PreviewFrame preview(const PreviewOptions& options, int threads = 0, std::string* said = nullptr) const {
    Context context;
    context.threads = threads;
    context.onMessage = [&](Severity, std::string_view text) {
      if (said != nullptr) *said += text;
    };
    const RayTracer rays = tracer();
    const EmittingTriangles emitters(scene);
    const HitRadiance light = directRadiance(rays, rays, lights, emissive ? &emitters : nullptr, sky, options.seed);
    std::vector<Record> cache;
    auto frame = renderPreview({rays, rays, camera, lights, emissive, sky}, light, options, cache, context);
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    return std::move(*frame);
  }
};

// RMSE over the truth's root mean square, its noise taken off, and energy.
void expectLike(const std::vector<glm::vec3>& found, const std::vector<glm::vec3>& truth,
                const std::vector<glm::vec3>& noise, double rmse, double energy) {
  double square = 0.0, noisy = 0.0, sum = 0.0, total = 0.0, all = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const glm::vec3 d = found[i] - truth[i];
    square += glm::dot(d, d);
    noisy += glm::dot(noise[i], noise[i]);
    sum += glm::dot(truth[i], truth[i]);
    total += d.x + d.y + d.z;
    all += truth[i].x + truth[i].y + truth[i].z;
  }
  EXPECT_LT(std::sqrt(std::max(0.0, square - noisy) / sum), rmse);
  EXPECT_NEAR(total / all, 0.0, energy);
}

// In a world of one radiance each surface mirrors its share of it, whatever its roughness and its records' frames.
TEST(MirrorPreview, aFurnaceIsMirroredByTheReflectance) {
  const MirrorRoom room;
  const RayTracer tracer = room.tracer();
  const HitRadiance light = [](std::uint64_t, float, std::span<const Ray>, std::span<const Hit> hits,
                               std::span<glm::vec3> radiance) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i]) radiance[i] = glm::vec3(2.0f);
    }
  };
  PreviewOptions options = smallGlossyPicture();
  options.samples = 1;
  Context context;
  std::vector<Record> cache;
  const auto frame = renderPreview({tracer, tracer, room.camera, {}, false, room.sky}, light, options, cache, context);
  ASSERT_TRUE(frame);
  const std::vector<MirrorSurface> seen =
      findMirrors(tracer, CameraRays(room.camera, options.width, options.height), context);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(frame->mirrored[i][c], 2.0f * seen[i].specular[c], 0.01f * 2.0f * seen[i].specular[c]);
      EXPECT_NEAR(frame->bounced[i][c], 2.0f * seen[i].diffuse[c], 0.01f);
    }
  }
  EXPECT_GT(frame->glossyRecords, 10u);
}

TEST(MirrorPreview, whatIsMirroredIsThePathTracers) {
  const MirrorRoom room;
  PreviewOptions options = smallGlossyPicture();
  options.rays = 1024;
  const PreviewFrame frame = room.preview(options);
  ReferenceOptions truth;
  truth.width = options.width;
  truth.height = options.height;
  truth.samplesPerPixel = 400;
  truth.maxBounces = 1;
  truth.gloss = true;
  Context context;
  const auto image = renderReference(room.tracer(), room.camera, room.lights, truth, context);
  ASSERT_TRUE(image);
  expectLike(frame.mirrored, image->glossyIndirect, image->glossyIndirectError, 0.06, 0.02);
  expectLike(frame.highlights, image->glossyDirect, image->glossyDirectError, 0.06, 0.02);
  expectLike(frame.albedo, image->albedo, std::vector<glm::vec3>(frame.albedo.size()), 0.05, 0.01);
}

// What is too sharp for records is seen along rays, and a message says so: no energy is lost.
TEST(MirrorPreview, sharpLobesAreSeenAlongRays) {
  const MirrorRoom room(300.0f);
  PreviewOptions options = smallGlossyPicture();
  options.samples = 8;
  std::string said;
  const PreviewFrame frame = room.preview(options, 0, &said);
  EXPECT_NE(said.find("too smooth for records"), std::string::npos) << said;
  ReferenceOptions truth;
  truth.width = options.width;
  truth.height = options.height;
  truth.samplesPerPixel = 256;
  truth.maxBounces = 1;
  truth.gloss = true;
  Context context;
  const auto image = renderReference(room.tracer(), room.camera, room.lights, truth, context);
  ASSERT_TRUE(image);
  double found = 0.0, expected = 0.0;
  for (std::size_t i = 0; i < frame.mirrored.size(); ++i) {
    found += frame.mirrored[i].x + frame.mirrored[i].y;
    expected += image->glossyIndirect[i].x + image->glossyIndirect[i].y;
  }
  EXPECT_NEAR(found, expected, 0.03 * expected);
  said.clear();
  MirrorRoom(12.0f).preview(options, 0, &said);
  EXPECT_EQ(said, "");
}

// Emitters are seen in lobes once: by points drawn on them where records carry the lobe, by rays where not.
TEST(MirrorPreview, emittersAreMirroredOnce) {
  for (const float exponent : {8.0f, 200.0f}) {
    MirrorRoom room(exponent);
    addInstance(room.scene, quad({-0.6f, 2.9f, -1.2f}, {1.2f, 0, 0}, {0, 0, 1.2f},
                                 addMaterial(room.scene, glm::vec3(0.0f), glm::vec3(4, 3, 2))));
    finish(room.scene);
    room.emissive = true;
    room.lights.clear();
    PreviewOptions options = smallGlossyPicture();
    options.samples = 6;
    const PreviewFrame frame = room.preview(options);
    ReferenceOptions truth;
    truth.width = options.width;
    truth.height = options.height;
    truth.samplesPerPixel = 256;
    truth.maxBounces = 1;
    truth.gloss = truth.emissive = true;
    Context context;
    const auto image = renderReference(room.tracer(), room.camera, room.lights, truth, context);
    ASSERT_TRUE(image);
    double found = 0.0, expected = 0.0;
    for (std::size_t i = 0; i < frame.mirrored.size(); ++i) {
      found += frame.mirrored[i].y + frame.highlights[i].y;
      expected += image->glossyIndirect[i].y + image->glossyDirect[i].y;
    }
    EXPECT_NEAR(found, expected, 0.05 * expected) << exponent;
  }
}

TEST(MirrorPreview, sameBytesAtOneTwoAndSevenThreads) {
  MirrorRoom room;
  room.sky.radiance = glm::vec3(0.3f);
  const PreviewFrame one = room.preview(smallGlossyPicture(), 1);
  for (const int threads : {2, 7}) {
    const PreviewFrame many = room.preview(smallGlossyPicture(), threads);
    EXPECT_EQ(one.mirrored, many.mirrored);
    EXPECT_EQ(one.highlights, many.highlights);
    EXPECT_EQ(one.bounced, many.bounced);
    EXPECT_EQ(one.glossyRecords, many.glossyRecords);
  }
}

TEST(MirrorPreview, withoutGlossThereAreNoLayersAndMaterialsDoNotMatter) {
  PreviewOptions options = smallGlossyPicture();
  options.gloss = false;
  const PreviewFrame metal = MirrorRoom(12.0f).preview(options), other = MirrorRoom(300.0f).preview(options);
  EXPECT_TRUE(metal.mirrored.empty());
  EXPECT_TRUE(metal.highlights.empty());
  EXPECT_EQ(metal.glossyRecords, 0u);
  EXPECT_EQ(metal.bounced, other.bounced);
  EXPECT_EQ(metal.albedo, other.albedo);
}

// Time that has gone by before mirrors get records is not given again: they have those of the first picture, which is
// whole however late it is. Of the time that there is, half is theirs.
TEST(MirrorPreview, aTimeLimitIsOfAllRecordsTogether) {
  const MirrorRoom room;
  const RayTracer tracer = room.tracer();
  // The first record takes that share of the time.
  const auto picture = [&](double limitSeconds, double share) {
    std::atomic<bool> waits = share > 0.0;
    const HitRadiance light = [&](std::uint64_t, float, std::span<const Ray>, std::span<const Hit>,
                                  std::span<glm::vec3> radiance) {
      if (waits.exchange(false)) std::this_thread::sleep_for(std::chrono::duration<double>(share * limitSeconds));
      std::fill(radiance.begin(), radiance.end(), glm::vec3(1.0f));
    };
    PreviewOptions options = smallGlossyPicture();
    options.rays = 16;
    options.glossyOrder = 2;
    options.samples = 1;
    options.timeLimitSeconds = limitSeconds;
    Context context;
    std::vector<Record> cache;
    const auto frame =
        renderPreview({tracer, tracer, room.camera, {}, false, room.sky}, light, options, cache, context);
    EXPECT_TRUE(frame);
    return *frame;
  };
  const PreviewFrame first = picture(1e-300, 0.0), late = picture(0.3, 1.1), half = picture(0.3, 0.6),
                     whole = picture(1e6, 0.0);
  EXPECT_EQ(first.accuracy, 1.0f);
  EXPECT_EQ(first.extended, 0u);
  EXPECT_GT(first.glossyRecords, 0u);
  EXPECT_EQ(late.records, first.records);
  EXPECT_EQ(late.glossyRecords, first.glossyRecords);
  EXPECT_EQ(half.records, first.records);
  EXPECT_GT(whole.records, first.records);
  EXPECT_GT(whole.glossyRecords, first.glossyRecords);
  EXPECT_FLOAT_EQ(whole.accuracy, smallGlossyPicture().accuracy);
}

// Few records, a time limit, triangles without an area, and orders out of range.
TEST(MirrorPreview, limitsAndBadLevelsLeaveFinitePictures) {
  MirrorRoom room;
  PreviewOptions options = smallGlossyPicture();
  options.maxRecords = 3;
  const auto isFinite = [](const PreviewFrame& frame) {
    for (const glm::vec3& v : frame.mirrored) {
      if (!std::isfinite(v.x + v.y + v.z) || v.x < 0.0f || v.y < 0.0f || v.z < 0.0f) return false;
    }
    return !frame.mirrored.empty();
  };
  EXPECT_TRUE(isFinite(room.preview(options)));
  options = smallGlossyPicture();
  options.timeLimitSeconds = 1e-300;
  EXPECT_TRUE(isFinite(room.preview(options)));
  options = smallGlossyPicture();
  options.glossyOrder = 1;
  EXPECT_TRUE(isFinite(room.preview(options)));
  options.accuracy = 2.0f;
  EXPECT_TRUE(isFinite(room.preview(options)));
  addInstance(room.scene, quad({0, 1, 0}, {1e-20f, 0, 0}, {0, 1, 0}));
  finish(room.scene);
  EXPECT_TRUE(isFinite(room.preview(smallGlossyPicture())));
  for (const int order : {-1, 11}) {
    options = smallGlossyPicture();
    options.glossyOrder = order;
    const RayTracer tracer = room.tracer();
    Context context;
    std::vector<Record> cache;
    const auto frame =
        renderPreview({tracer, tracer, room.camera, room.lights, false, room.sky}, {}, options, cache, context);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, ErrorCode::usage);
    EXPECT_NE(frame.error().message.find("order of radiance records must be 1..10"), std::string::npos);
  }
}

}  // namespace
}  // namespace relume
