// SPDX-License-Identifier: MIT
// Frames of the shipped level: the CPU against OpenGL, a level against its mirror image, bounces that add up.
#include "bake/import/make_tangents.h"
#include "bake/reference/path_tracer.h"
#include "relume/bake/bake.h"
#include "tests/cancel_after.h"
#include "tests/rays/make_scene.h"
#include "tools/render/render_cpu.h"
#include "tools/render/render_frame.h"
#ifdef RELUME_RENDER_GL
#include "tools/render/render_gl.h"
#endif

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

const char* kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

const Scene& level() {
  static const Scene scene = [] {
    Context context;
    auto imported = importGltf(kLevel, context);
    EXPECT_TRUE(imported) << imported.error().message;
    return std::move(*imported);
  }();
  return scene;
}

Bake bakeDraft(const Scene& scene) {
  BakeOptions options = presetOptions(Preset::draft);
  options.caches.lightmapCaches = 2500;
  Context context;
  auto made = bake(scene, options, context);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

const Bake& levelBake() {
  static const Bake made = bakeDraft(level());
  return made;
}

const Camera& camera(const Scene& scene, const std::string& name) {
  return *std::find_if(scene.cameras.begin(), scene.cameras.end(), [&](const Camera& c) { return c.name == name; });
}

RenderRequest request(const Scene& scene, const Bake* made, const std::string& cameraName) {
  RenderRequest r;
  r.bake = made;
  r.camera = camera(scene, cameraName);
  r.lights = scene.lights;
  r.emissive = true;
  r.sky.radiance = {0.5f, 0.7f, 1.0f};
  r.width = 128;
  r.height = 72;
  r.samples = 2;
  r.straight = true;
  r.centres = true;
  return r;
}

Result<RenderedFrame> drawCpu(const Scene& scene, const RenderRequest& r, int threads = 0) {
  Context context;
  context.threads = threads;
  auto tracer = RayTracer::create(scene, "avx2", context, RayStructure::thorough, RayGeometry::drawn);
  if (!tracer) return tracer.error();
  return renderCpu(*tracer, r, context);
}

// The ball of the level that is no part of the bake, from near by.
RenderRequest requestOfTheToy() {
  RenderRequest r = request(level(), &levelBake(), "cam_hall");
  r.camera = test::lookAt({4.6f, 0.6f, 2.2f}, {3.9f, 0.14f, 1.3f}, 0.6f);
  return r;
}

// Whether a pixel shows the ball: its centre is within 0.14 m of where the level has it.
bool showsToy(const RenderedFrame& frame, std::size_t pixel) {
  return frame.depth[pixel] > 0.0f && glm::length(frame.position[pixel] - glm::vec3(3.9f, 0.14f, 1.3f)) < 0.145f;
}

// Root of the mean squared difference over the mean of `a`.
double relativeRms(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  double squared = 0.0, mean = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const glm::vec3 d = a[i] - b[i];
    squared += glm::dot(d, d) / 3.0;
    mean += (a[i].r + a[i].g + a[i].b) / 3.0;
  }
  const auto n = static_cast<double>(a.size());
  return std::sqrt(squared / n) / (mean / n);
}

double total(const std::vector<glm::vec3>& image) {
  double sum = 0.0;
  for (const glm::vec3& p : image) sum += p.r + p.g + p.b;
  return sum;
}

// Share of pixels that differ by more than `bound` of the mean.
double shareBeyond(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b, double bound) {
  const double mean = total(a) / (3.0 * static_cast<double>(a.size()));
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += glm::length(a[i] - b[i]) > bound * mean;
  return static_cast<double>(count) / static_cast<double>(a.size());
}

// The level seen in a mirror at x = 0: geometry, cameras, lights, volumes.
Scene mirrored(const Scene& original) {
  Scene scene = original;
  glm::mat4 mirror(1.0f);
  mirror[0][0] = -1.0f;
  for (Instance& instance : scene.instances) {
    instance.toWorld = mirror * instance.toWorld;
    instance.flipped = !instance.flipped;
  }
  for (Camera& c : scene.cameras) c.toWorld = mirror * c.toWorld;
  for (PlayVolume& v : scene.volumes) v.toWorld = mirror * v.toWorld;
  for (SceneLight& l : scene.lights) {
    l.positionWorld.x = -l.positionWorld.x;
    l.direction.x = -l.direction.x;
  }
  return scene;
}

// Means of 8 x 8 pixels: what is left is not a matter of where single rays fell.
std::vector<glm::vec3> blocks(const std::vector<glm::vec3>& image, std::uint32_t width) {
  std::vector<glm::vec3> out(image.size() / 64, glm::vec3(0.0f));
  for (std::size_t i = 0; i < image.size(); ++i) out[i / width / 8 * (width / 8) + i % width / 8] += image[i] / 64.0f;
  return out;
}

TEST(CameraRays, middleLooksForwardAndEdgesSpanTheFieldOfView) {
  Camera c;
  c.yfovRad = 1.0f;
  const CameraRays rays(c, 320, 180);
  glm::vec3 origin, direction;
  rays.at(160.0f, 90.0f, origin, direction);
  EXPECT_NEAR(glm::length(direction - glm::vec3(0, 0, -1)), 0.0f, 1e-6f);
  rays.at(160.0f, 0.0f, origin, direction);
  EXPECT_NEAR(std::atan2(direction.y, -direction.z), 0.5f, 1e-5f) << "row 0 is on top";
  rays.at(320.0f, 90.0f, origin, direction);
  EXPECT_NEAR(direction.x / -direction.z, std::tan(0.5f) * 320.0f / 180.0f, 1e-5f);
}

TEST(ComposeAov, dividesByAlbedoAndLeavesBlackChannelsBlack) {
  RenderRequest request;
  request.width = request.height = 1;
  RenderedFrame frame;
  frame.resize(request);
  frame.albedo[0] = {0.5f, 0.0f, 0.25f};
  frame.indirect[0] = {1.0f, 0.0f, 0.5f};
  frame.straight[0] = {0.25f, 0.0f, 0.5f};
  frame.direct[0] = {2.0f, 0.0f, 0.0f};
  frame.emission[0] = {0.0f, 3.0f, 0.0f};
  EXPECT_EQ(composeAov(frame, Aov::indirect)[0], glm::vec3(2.0f, 0.0f, 2.0f));
  EXPECT_EQ(composeAov(frame, Aov::bounced)[0], glm::vec3(1.5f, 0.0f, 0.0f));
  EXPECT_EQ(composeAov(frame, Aov::full)[0], glm::vec3(3.0f, 3.0f, 0.5f));
  EXPECT_EQ(composeAov(frame, Aov::unbounced)[0], glm::vec3(2.25f, 3.0f, 0.5f));
}

TEST(RenderCpu, isTheSameAtAnyThreadCount) {
  const RenderRequest r = request(level(), &levelBake(), "cam_hall");
  const auto one = drawCpu(level(), r, 1), two = drawCpu(level(), r, 2);
  ASSERT_TRUE(one && two);
  for (const Aov aov : {Aov::full, Aov::bounced, Aov::normal, Aov::depth})
    EXPECT_EQ(composeAov(*one, aov), composeAov(*two, aov));
}

TEST(RenderCpu, drawsDynamicInstancesLitByTheGrid) {
  const auto frame = drawCpu(level(), requestOfTheToy());
  ASSERT_TRUE(frame) << frame.error().message;
  std::size_t shown = 0, lit = 0;
  const auto indirect = composeAov(*frame, Aov::indirect);
  for (std::size_t i = 0; i < frame->depth.size(); ++i) {
    if (!showsToy(*frame, i)) continue;
    ++shown;
    lit += indirect[i].r > 0.0f ? 1 : 0;
  }
  EXPECT_GT(shown, 300u);
  EXPECT_EQ(lit, shown);
}

TEST(RenderCpu, aBakeWithAGridAloneLightsAllFromTheGrid) {
  Bake gridOnly = levelBake();
  gridOnly.caches.lightmap = {};
  gridOnly.surfels.receiver = std::vector<std::uint32_t>(gridOnly.surfels.count(), kGridReceiver);
  const auto frame = drawCpu(level(), request(level(), &gridOnly, "cam_hall"));
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_GT(total(frame->indirect), 0.0);
}

TEST(RenderCpu, aLightThatTheRelighterRefusesIsAnError) {
  RenderRequest r = request(level(), &levelBake(), "cam_hall");
  r.lights.at(0).kind = LightKind::directional;
  r.lights.at(0).direction = glm::vec3(0.0f);
  for (const int bounces : {0, 2}) {
    r.bounces = bounces;
    const auto frame = drawCpu(level(), r);
    ASSERT_FALSE(frame) << bounces;
    EXPECT_NE(frame.error().message.find("direction"), std::string::npos) << frame.error().message;
  }
}

// Glossy light of a draft against paths: lobes that the bands carry.
TEST(RenderCpu, glossyLightIsWhatPathsSee) {
  Context context;
  RenderRequest r = request(level(), &levelBake(), "cam_hall");
  r.bands = {6, 4};
  r.width = 64;
  r.height = 32;
  ReferenceOptions options;
  options.width = r.width;
  options.height = r.height;
  options.samplesPerPixel = 96;
  options.emissive = r.emissive;
  options.sky = r.sky;
  const auto tracer = RayTracer::create(level(), "avx2", context);
  ASSERT_TRUE(tracer);
  for (const float exponent : {1.0f, 4.0f}) {
    r.exponent = options.exponent = exponent;
    const auto frame = renderCpu(*tracer, r, context);
    const auto truth = renderReference(*tracer, r.camera, r.lights, options, context);
    ASSERT_TRUE(frame && truth);
    std::vector<glm::vec3> paths;
    for (std::size_t i = 0; i < frame->glossy.size(); ++i)
      paths.push_back(truth->glossyDirect[i] + truth->glossyIndirect[i]);
    EXPECT_NEAR(total(frame->glossy) / total(paths), 1.0, 0.05) << exponent;
    const double apart = relativeRms(blocks(paths, 64), blocks(frame->glossy, 64));
    EXPECT_LT(apart, 0.12) << exponent;
    RecordProperty("exponent" + std::to_string(static_cast<int>(exponent)), std::to_string(apart));
  }
}

// The level with the same gloss on all surfaces.
Scene glossyLevel(float metalness, float roughness) {
  Scene scene = level();
  for (Material& material : scene.materials) {
    material.gloss.metalness = metalness;
    material.gloss.roughness = roughness;
  }
  return scene;
}

TEST(RenderCpu, whiteSurfacesOfAnyMaterialShineLikeTheSkyAroundThem) {
  // A white furnace by a bake: a floor alone under a sky of 1. What caches carry and what rays do, and any mix of them.
  Scene scene;
  test::addInstance(scene, test::quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, test::addMaterial(scene, glm::vec3(1.0f))));
  test::finish(scene);
  scene.cameras.push_back(test::lookAt({1.5f, 1.2f, 0.1f}, {0, 0, 0}));
  const Bake made = bakeDraft(scene);
  RenderRequest r;
  r.bake = &made;
  r.camera = scene.cameras[0];
  r.sky.radiance = glm::vec3(1.0f);
  r.width = r.height = 24;
  r.samples = 2;
  r.gloss = true;
  for (const float metalness : {0.0f, 0.5f, 1.0f}) {
    for (const float roughness : {0.0f, 0.3f, 0.5f, 0.6f, 1.0f}) {
      scene.materials[0].gloss.metalness = metalness;
      scene.materials[0].gloss.roughness = roughness;
      const auto frame = drawCpu(scene, r);
      ASSERT_TRUE(frame) << frame.error().message;
      for (const glm::vec3& p : composeAov(*frame, Aov::full))
        EXPECT_NEAR(p.x, 1.0f, 0.03f) << metalness << ' ' << roughness;
    }
  }
}

TEST(RenderCpu, glossOfMaterialsIsWhatPathsSee) {
  RenderRequest r = request(level(), &levelBake(), "cam_hall");
  r.straight = r.centres = false;
  r.gloss = true;
  r.width = 64;
  r.height = 32;
  r.samples = 8;
  ReferenceOptions options;
  options.width = r.width;
  options.height = r.height;
  options.samplesPerPixel = 128;
  options.emissive = true;
  options.sky = r.sky;
  options.gloss = true;
  for (const float roughness : {0.2f, 0.6f, 1.0f}) {
    const Scene scene = glossyLevel(0.5f, roughness);
    Context context;
    const auto tracer = RayTracer::create(scene, "avx2", context);
    ASSERT_TRUE(tracer);
    const auto frame = renderCpu(*tracer, r, context);
    const auto truth = renderReference(*tracer, r.camera, r.lights, options, context);
    ASSERT_TRUE(frame && truth);
    std::vector<glm::vec3> paths;
    for (std::size_t i = 0; i < frame->glossy.size(); ++i)
      paths.push_back(truth->glossyDirect[i] + truth->glossyIndirect[i]);
    EXPECT_NEAR(total(frame->glossy) / total(paths), 1.0, 0.05) << roughness;
    EXPECT_LT(relativeRms(blocks(truth->albedo, 64), blocks(frame->albedo, 64)), 0.02) << roughness;
    const double apart = relativeRms(blocks(paths, 64), blocks(frame->glossy, 64));
    EXPECT_LT(apart, 0.15) << roughness;
    RecordProperty("roughness" + std::to_string(static_cast<int>(10.0f * roughness)), std::to_string(apart));
  }
}

TEST(RenderCpu, glossIsPartOfAllLightAndLeavesDiffuseLightAsItIs) {
  RenderRequest r = request(level(), &levelBake(), "cam_hall");
  const Scene scene = glossyLevel(1.0f, 0.7f);
  const auto plain = drawCpu(scene, r);
  r.gloss = true;
  const auto glossy = drawCpu(scene, r);
  ASSERT_TRUE(plain && glossy);
  // Metals scatter nothing; what is seen is what they mirror.
  EXPECT_EQ(total(glossy->albedo), 0.0);
  const auto full = composeAov(*glossy, Aov::full), mirrored = composeAov(*glossy, Aov::glossy);
  for (std::size_t i = 0; i < full.size(); ++i) EXPECT_EQ(full[i], glossy->emission[i] + mirrored[i]);
  EXPECT_GT(total(mirrored), 0.2 * total(composeAov(*plain, Aov::full)));
  EXPECT_EQ(glossy->emission, plain->emission);
}

TEST(RenderCpu, emittersAloneHaveNothingBouncedInTheFirstFrame) {
  RenderRequest r = request(level(), &levelBake(), "cam_hall");
  r.lights.clear();
  r.bounces = 1;
  const auto frame = drawCpu(level(), r);
  ASSERT_TRUE(frame);
  EXPECT_GT(total(frame->indirect), 0.0);
  EXPECT_EQ(total(frame->direct), 0.0);
  for (const glm::vec3& p : composeAov(*frame, Aov::bounced)) EXPECT_LT(glm::length(p), 1e-5f);
}

TEST(RenderCpu, everyBounceAddsLessLightThanTheOneBefore) {
  RenderRequest r = request(level(), &levelBake(), "cam_living");
  r.emissive = false;
  r.sky.radiance = glm::vec3(0.0f);
  double before = 0.0, gain = 0.0;
  for (const int bounces : {1, 2, 3, 4}) {
    r.bounces = bounces;
    const auto frame = drawCpu(level(), r);
    ASSERT_TRUE(frame);
    const double now = total(frame->indirect);
    EXPECT_GT(now, before);
    if (bounces > 1) {
      EXPECT_LT(now - before, gain) << bounces;
    }
    gain = now - before;
    before = now;
  }
  r.bounces = 0;
  const auto converged = drawCpu(level(), r);
  ASSERT_TRUE(converged);
  EXPECT_GT(total(converged->indirect), before);
  EXPECT_LT(total(converged->indirect), before + 8.0 * gain);
}

TEST(RenderCpu, aMirroredLevelLooksMirrored) {
  const Scene mirror = mirrored(level());
  const Bake mirrorBake = bakeDraft(mirror);
  for (const char* name : {"cam_living", "cam_hall"}) {
    const auto a = drawCpu(level(), request(level(), &levelBake(), name));
    const auto b = drawCpu(mirror, request(mirror, &mirrorBake, name));
    ASSERT_TRUE(a && b);
    EXPECT_LT(relativeRms(blocks(a->direct, 128), blocks(b->direct, 128)), 0.01) << name;
    EXPECT_LT(relativeRms(blocks(a->albedo, 128), blocks(b->albedo, 128)), 1e-3) << name;
    const double apart =
        relativeRms(blocks(composeAov(*a, Aov::indirect), 128), blocks(composeAov(*b, Aov::indirect), 128));
    EXPECT_LT(apart, 0.08) << name;
    RecordProperty(name, std::to_string(apart));
  }
}

#ifdef RELUME_RENDER_GL
// OpenGL shades the same pixels with shadow maps, half floats and its own rasteriser: a few pixels on edges differ, the
// rest must not.
TEST(RenderGl, agreesWithTheCpu) {
  for (const char* name : {"cam_living", "cam_hall"}) {
    RenderRequest r = request(level(), &levelBake(), name);
    r.exponent = 8.0f;
    Context context;
    const auto gl = renderGl(level(), r, context);
    if (!gl && gl.error().code == ErrorCode::unsupported) GTEST_SKIP() << gl.error().message;
    ASSERT_TRUE(gl) << gl.error().message;
    const auto cpu = drawCpu(level(), r);
    ASSERT_TRUE(cpu) << cpu.error().message;
    const auto pair = [&](Aov aov) { return std::pair(composeAov(*cpu, aov), composeAov(*gl, aov)); };
    const auto [indirectCpu, indirectGl] = pair(Aov::indirect);
    EXPECT_LT(relativeRms(indirectCpu, indirectGl), 0.03) << name;
    EXPECT_NEAR(total(indirectGl) / total(indirectCpu), 1.0, 0.01) << name;
    const auto [bouncedCpu, bouncedGl] = pair(Aov::bounced);
    EXPECT_LT(relativeRms(bouncedCpu, bouncedGl), 0.04) << name;
    const auto [glossyCpu, glossyGl] = pair(Aov::glossy);
    EXPECT_LT(relativeRms(glossyCpu, glossyGl), 0.04) << name;
    EXPECT_NEAR(total(glossyGl) / total(glossyCpu), 1.0, 0.01) << name;
    const auto [albedoCpu, albedoGl] = pair(Aov::albedo);
    EXPECT_LT(relativeRms(albedoCpu, albedoGl), 0.03) << name << ": mip levels";
    const auto [directCpu, directGl] = pair(Aov::direct);
    EXPECT_LT(shareBeyond(directCpu, directGl, 0.05), 0.05) << name << ": shadow edges only";
    EXPECT_NEAR(total(directGl) / total(directCpu), 1.0, 0.03) << name;
    for (const Aov aov : {Aov::normal, Aov::position, Aov::depth}) {
      const auto [a, b] = pair(aov);
      EXPECT_LT(shareBeyond(a, b, 0.02), 0.01) << name << " " << aovNames()[static_cast<std::size_t>(aov)];
    }
  }
}

// A floor with a normal map and roughness in a texture, in a room with a lamp and a light, seen from within. The room
// is a mirror image when asked for.
Scene mappedRoom(bool isMirrored) {
  Scene scene;
  scene.images.resize(2);
  scene.images[0].levels.push_back(
      {2, 2, {170, 128, 240, 255, 90, 128, 240, 255, 128, 190, 230, 255, 128, 80, 240, 255}});
  scene.images[1].levels.push_back({2, 1, {0, 255, 0, 255, 0, 170, 255, 255}});
  for (Image& image : scene.images) image.isColor = false;
  Mesh floor = test::quad({0, 0, 3}, {4, 0, 0}, {0, 0, -3}, test::addMaterial(scene, {0.8f, 0.5f, 0.3f}));
  MaterialGloss& gloss = scene.materials[0].gloss;
  gloss.roughness = 0.9f;
  gloss.texture.image = 1;
  gloss.normalTexture.image = 0;
  EXPECT_EQ(makeTangents(floor, {}, gloss.normalTexture), 0u);
  glm::mat4 mirror(1.0f);
  if (isMirrored) mirror[0][0] = -1.0f;
  test::addInstance(scene, floor, mirror);
  test::addInstance(
      scene, test::box({-0.5f, -0.5f, -0.5f}, {4.5f, 3, 3.5f}, true, test::addMaterial(scene, {0.6f, 0.7f, 0.8f})),
      mirror);
  test::addInstance(
      scene, test::quad({1, 2.9f, 1}, {1.5f, 0, 0}, {0, 0, 1}, test::addMaterial(scene, glm::vec3(0.0f), {6, 5, 4})),
      mirror);
  scene.materials[1].gloss = {0.0f, 0.7f, {}, {}, 1.0f};
  test::finish(scene);
  const float side = isMirrored ? -1.0f : 1.0f;
  SceneLight light;
  light.name = "light";
  light.positionWorld = {side * 3, 2, 1};
  light.intensity = glm::vec3(3.0f);
  scene.lights.push_back(light);
  scene.cameras.push_back(test::lookAt({side * 0.3f, 1.5f, 2.7f}, {side * 2.2f, 0.2f, 1}));
  scene.cameras[0].name = "cam";
  return scene;
}

TEST(RenderGl, glossAndNormalMapsAreTheCpus) {
  for (const bool isMirrored : {false, true}) {
    const Scene scene = mappedRoom(isMirrored);
    const Bake made = bakeDraft(scene);
    RenderRequest r = request(scene, &made, "cam");
    r.straight = false;
    r.gloss = true;
    Context context;
    const auto gl = renderGl(scene, r, context);
    if (!gl && gl.error().code == ErrorCode::unsupported) GTEST_SKIP() << gl.error().message;
    ASSERT_TRUE(gl) << gl.error().message;
    const auto cpu = drawCpu(scene, r);
    ASSERT_TRUE(cpu) << cpu.error().message;
    EXPECT_LT(relativeRms(cpu->normal, gl->normal), 0.03) << isMirrored;
    EXPECT_LT(relativeRms(cpu->albedo, gl->albedo), 0.05) << isMirrored;
    EXPECT_LT(relativeRms(composeAov(*cpu, Aov::glossy), composeAov(*gl, Aov::glossy)), 0.08) << isMirrored;
    EXPECT_NEAR(total(gl->glossy) / total(cpu->glossy), 1.0, 0.02) << isMirrored;
    EXPECT_LT(relativeRms(composeAov(*cpu, Aov::full), composeAov(*gl, Aov::full)), 0.05) << isMirrored;
    // The map is seen: without it the floor's normals are those of its triangles.
    RenderRequest plain = r;
    plain.gloss = false;
    const auto flat = drawCpu(scene, plain);
    EXPECT_GT(relativeRms(flat->normal, cpu->normal), 0.1) << isMirrored;
  }
}

TEST(RenderGl, drawsDynamicInstancesAsTheCpuDoes) {
  const RenderRequest r = requestOfTheToy();
  Context context;
  const auto gl = renderGl(level(), r, context);
  if (!gl && gl.error().code == ErrorCode::unsupported) GTEST_SKIP() << gl.error().message;
  ASSERT_TRUE(gl) << gl.error().message;
  const auto cpu = drawCpu(level(), r);
  ASSERT_TRUE(cpu) << cpu.error().message;
  std::vector<glm::vec3> a, b;
  const auto indirectCpu = composeAov(*cpu, Aov::indirect), indirectGl = composeAov(*gl, Aov::indirect);
  for (std::size_t i = 0; i < indirectCpu.size(); ++i) {
    if (!showsToy(*cpu, i) || !showsToy(*gl, i)) continue;
    a.push_back(indirectCpu[i]);
    b.push_back(indirectGl[i]);
  }
  ASSERT_GT(a.size(), 300u);
  EXPECT_LT(relativeRms(a, b), 0.03);
  EXPECT_LT(shareBeyond(composeAov(*cpu, Aov::direct), composeAov(*gl, Aov::direct), 0.05), 0.05)
      << "the ball's shadow, too";
}

TEST(RenderGl, tilesJoinWithoutSeams) {
  RenderRequest r = request(level(), nullptr, "cam_hall");
  r.straight = false;
  r.centres = false;
  r.lights = {r.lights.front()};
  Context context;
  r.width = 150;
  r.height = 90;
  r.samples = 1;
  const auto whole = renderGl(level(), r, context);
  if (!whole && whole.error().code == ErrorCode::unsupported) GTEST_SKIP() << whole.error().message;
  ASSERT_TRUE(whole) << whole.error().message;
  // The same view in 3 x 3 times as many pixels takes more than one tile; its block means are the supersampled view.
  r.samples = 9;
  const auto tiled = renderGl(level(), r, context);
  ASSERT_TRUE(tiled) << tiled.error().message;
  EXPECT_LT(shareBeyond(whole->albedo, tiled->albedo, 0.3), 0.08);
  EXPECT_NEAR(total(tiled->albedo) / total(whole->albedo), 1.0, 0.01);
}
#endif

// One row of four million sub-pixels, each with many shadow rays.
TEST(RenderCpu, aCancelIsHeardWithinARow) {
  Context quiet;
  auto tracer = RayTracer::create(level(), "avx2", quiet, RayStructure::thorough, RayGeometry::drawn);
  ASSERT_TRUE(tracer);
  RenderRequest r = request(level(), nullptr, "cam_hall");
  r.width = 16384;
  r.height = 1;
  r.samples = 16;
  r.straight = r.centres = false;
  ASSERT_FALSE(r.lights.empty());
  r.lights.resize(40, r.lights.front());
  const double after = test::processorSecondsAfterCancel(0.2, [&](Context& context) {
    const auto frame = renderCpu(*tracer, r, context);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().message, "cancelled");
  });
  EXPECT_LT(after, 2.0);
}

}  // namespace
}  // namespace relume
