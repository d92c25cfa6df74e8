// SPDX-License-Identifier: MIT
// Frames of the shipped level: the CPU against OpenGL, a level against its mirror image, bounces that add up.
#include "relume/bake/bake.h"
#include "tests/cancel_after.h"
#include "tests/rays/make_scene.h"
#include "tests/render/pictures.h"
#include "tools/render/default_view.h"
#include "tools/render/render_cpu.h"
#include "tools/render/render_frame.h"
#include "tools/render/view_options.h"
#ifdef RELUME_RENDER_GL
#include "tools/render/render_gl.h"
#endif

#include <gtest/gtest.h>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace relume {
namespace {

using namespace test;

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

TEST(ViewOptions, namesOfLightsMayHaveCommas) {
  Scene scene;
  for (const char* name : {"a", "b", "Lampe, EG", "c,d,e"}) scene.lights.emplace_back().name = name;
  using Names = std::vector<std::string>;
  EXPECT_EQ(lightNames({"a", "b"}, scene), (Names{"a", "b"}));
  EXPECT_EQ(lightNames({"Lampe", " EG"}, scene), (Names{"Lampe, EG"}));
  EXPECT_EQ(lightNames({"b", "c", "d", "e", "a"}, scene), (Names{"b", "c,d,e", "a"}));
  EXPECT_EQ(lightNames({"c", "d"}, scene), (Names{"c", "d"})) << "of which neither is a light";
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
    const auto drawn = drawTwice(level(), r);
    if (!drawn) return;
    const RenderedFrame &cpu = drawn->cpu, &gl = drawn->gl;
    const auto pair = [&](Aov aov) { return std::pair(composeAov(cpu, aov), composeAov(gl, aov)); };
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

// In pictures of a few pixels, many a pixel's neighbour looks past the horizon of the plane that the pixel shows.
TEST(RenderGl, normalsBeforeAHorizonAreTheCpus) {
  const std::pair<const char*, std::uint32_t> views[] = {{"cam_hall", 1}, {"cam_living", 3}};
  for (const auto& [name, width] : views) {
    RenderRequest r;
    r.camera = camera(level(), name);
    r.width = width;
    r.height = (width + 1) / 2;
    r.samples = 1;
    r.centres = true;
    const auto drawn = drawTwice(level(), r);
    if (!drawn) return;
    const RenderedFrame &cpu = drawn->cpu, &gl = drawn->gl;
    for (std::size_t i = 0; i < cpu.normal.size(); ++i) {
      ASSERT_LT(glm::length(cpu.position[i] - gl.position[i]), 1e-3f) << name << ", pixel " << i;
      EXPECT_LT(glm::length(cpu.normal[i] - gl.normal[i]), 0.01f) << name << ", pixel " << i;
    }
  }
}

TEST(RenderGl, drawsDynamicInstancesAsTheCpuDoes) {
  const RenderRequest r = requestOfTheToy();
  const auto drawn = drawTwice(level(), r);
  if (!drawn) return;
  const RenderedFrame &cpu = drawn->cpu, &gl = drawn->gl;
  std::vector<glm::vec3> a, b;
  const auto indirectCpu = composeAov(cpu, Aov::indirect), indirectGl = composeAov(gl, Aov::indirect);
  for (std::size_t i = 0; i < indirectCpu.size(); ++i) {
    if (!showsToy(cpu, i) || !showsToy(gl, i)) continue;
    a.push_back(indirectCpu[i]);
    b.push_back(indirectGl[i]);
  }
  ASSERT_GT(a.size(), 300u);
  EXPECT_LT(relativeRms(a, b), 0.03);
  EXPECT_LT(shareBeyond(composeAov(cpu, Aov::direct), composeAov(gl, Aov::direct), 0.05), 0.05)
      << "the ball's shadow, too";
}

// A hut with a window on a ground of two kilometres: texels of the whole level's shadow map are a metre wide.
TEST(RenderGl, aWideGroundLeavesShadowsSharp) {
  Scene scene;
  const std::uint32_t grey = test::addMaterial(scene, glm::vec3(0.5f));
  test::addInstance(scene, test::quad({-1000, 0, -1000}, {0, 0, 2000}, {2000, 0, 0}, grey));
  test::addInstance(scene, test::box({-2, 2.5f, -2}, {2, 2.7f, 2}, false, grey));
  test::addInstance(scene, test::box({-2, 0, -2}, {-1.8f, 2.5f, 2}, false, grey));
  test::addInstance(scene, test::box({1.8f, 0, -2}, {2, 0.9f, 2}, false, grey));
  test::addInstance(scene, test::box({1.8f, 1.7f, -2}, {2, 2.5f, 2}, false, grey));
  test::finish(scene);
  RenderRequest r;
  r.width = 128;
  r.height = 72;
  r.camera = test::lookAt({-1.5f, 1.5f, 0.5f}, {1.0f, 0.8f, 0.0f}, 1.2f);
  SceneLight sun;
  sun.kind = LightKind::directional;
  sun.intensity = glm::vec3(3.0f);
  sun.direction = glm::normalize(glm::vec3(-0.8f, -1.0f, 0.3f));
  r.lights = {sun};
  const auto drawn = drawTwice(scene, r);
  if (!drawn) return;
  const RenderedFrame &cpu = drawn->cpu, &gl = drawn->gl;
  const auto directCpu = composeAov(cpu, Aov::direct), directGl = composeAov(gl, Aov::direct);
  ASSERT_GT(total(directCpu), 0.0);
  EXPECT_LT(shareBeyond(directCpu, directGl, 0.3), 0.05) << "shadow edges only";
  EXPECT_NEAR(total(directGl) / total(directCpu), 1.0, 0.03);
}

// A room of 12 x 9 x 15 mm, in which neither the camera's near plane nor the light's cuts anything off.
TEST(RenderGl, drawsALevelOfMillimetresAsTheCpuDoes) {
  Scene scene;
  const std::uint32_t grey = test::addMaterial(scene, glm::vec3(0.5f));
  test::addInstance(scene, test::box({0, 0, 0}, {0.012f, 0.009f, 0.015f}, true, grey));
  test::addInstance(scene, test::box({0.004f, 0, 0.006f}, {0.006f, 0.004f, 0.008f}, false, grey));
  test::finish(scene);
  RenderRequest r;
  r.width = 96;
  r.height = 64;
  r.camera = test::lookAt({0.011f, 0.005f, 0.014f}, {0.002f, 0.003f, 0.001f}, 1.2f);
  r.camera.znear = 0.1f;  // as Blender writes it
  SceneLight lamp;
  lamp.kind = LightKind::point;
  lamp.intensity = glm::vec3(1e-4f);
  lamp.positionWorld = {0.009f, 0.007f, 0.004f};
  r.lights = {lamp};
  const auto drawn = drawTwice(scene, r);
  if (!drawn) return;
  const auto directCpu = composeAov(drawn->cpu, Aov::direct), directGl = composeAov(drawn->gl, Aov::direct);
  ASSERT_GT(total(directCpu), 0.0);
  EXPECT_LT(shareBeyond(directCpu, directGl, 0.3), 0.05) << "shadow edges only";
  EXPECT_NEAR(total(directGl) / total(directCpu), 1.0, 0.03);
}

// A room of 4 x 2.5 x 6 m with half a roof, a box and a panel that glows, 36 km from the world's origin. Lights of
// every kind of shadow map.
struct FarRoom {
  Scene scene;
  RenderRequest request;

  FarRoom() {
    const glm::vec3 at(20000, 0, -30000);
    const std::uint32_t grey = test::addMaterial(scene, glm::vec3(0.7f)),
                        red = test::addMaterial(scene, {0.7f, 0.1f, 0.1f}),
                        glowing = test::addMaterial(scene, glm::vec3(0.5f), {1.0f, 0.8f, 0.5f});
    const glm::mat4 toWorld = glm::translate(glm::mat4(1.0f), at);
    Mesh room = test::box({-2, 0, -3}, {2, 2.5f, 3}, true, grey);
    room.triangle.erase(room.triangle.begin() + 7);  // half of the roof
    test::addInstance(scene, room, toWorld);
    test::addInstance(scene, test::box({-1.2f, 0, -1.5f}, {-0.3f, 1.2f, -0.6f}, false, red), toWorld);
    test::addInstance(scene, test::quad({1.95f, 1, -1}, {0, 0, 0.8f}, {0, 0.8f, 0}, glowing), toWorld);
    test::finish(scene);
    request.width = 160;
    request.height = 90;
    request.samples = 1;
    request.emissive = request.centres = true;
    request.camera = test::lookAt({0.3f, 1.4f, 2.6f}, {-0.2f, 0.9f, -3.0f}, 1.2f);
    request.camera.toWorld[3] += glm::vec4(at, 0.0f);
    SceneLight lamp, spot, sun;
    lamp.positionWorld = at + glm::vec3(0.5f, 2.0f, 0.0f);
    lamp.intensity = glm::vec3(5.0f);
    spot.kind = LightKind::spot;
    spot.positionWorld = at + glm::vec3(1.5f, 2.2f, 1.0f);
    spot.direction = glm::normalize(glm::vec3(-0.8f, -0.6f, -0.8f));
    spot.intensity = glm::vec3(20.0f);
    spot.outerConeRad = 0.6f;
    sun.kind = LightKind::directional;
    sun.direction = glm::normalize(glm::vec3(-0.3f, -1.0f, -0.2f));
    sun.intensity = glm::vec3(3.0f);
    request.lights = {lamp, spot, sun};
  }
};

// Places in the world are 2 mm apart there; those in the picture and in the shadow maps must not be.
TEST(RenderGl, drawsALevelFarOutAsTheCpuDoes) {
  const FarRoom room;
  const auto drawn = drawTwice(room.scene, room.request);
  if (!drawn) return;
  const RenderedFrame &cpu = drawn->cpu, &gl = drawn->gl;
  std::size_t lost = 0, bent = 0;
  for (std::size_t i = 0; i < cpu.depth.size(); ++i) {
    lost += cpu.depth[i] > 0.0f && gl.depth[i] == 0.0f;
    bent += cpu.depth[i] > 0.0f && glm::dot(cpu.normal[i], gl.normal[i]) < 0.99f;
  }
  EXPECT_EQ(lost, 0u);
  EXPECT_LT(bent, cpu.depth.size() / 500) << "at edges only";
  for (const Aov aov : {Aov::direct, Aov::full}) {
    const auto lightCpu = composeAov(cpu, aov), lightGl = composeAov(gl, aov);
    ASSERT_GT(total(lightCpu), 0.0);
    EXPECT_LT(shareBeyond(lightCpu, lightGl, 0.3), 0.01) << "shadow edges only";
    EXPECT_LT(relativeRms(lightCpu, lightGl), 0.08);
    EXPECT_NEAR(total(lightGl) / total(lightCpu), 1.0, 0.015) << "rays start a centimetre off surfaces";
  }
}

// Once, as who traces rays does.
TEST(RenderGl, warnsOfALevelFarOut) {
  FarRoom room;
  room.request.width = room.request.height = 8;
  std::size_t warnings = 0;
  Context context;
  context.onMessage = [&](Severity severity, std::string_view text) {
    warnings += severity == Severity::warning && text.find("m from the origin") != std::string_view::npos;
  };
  const auto drawn = renderGl(room.scene, room.request, context);
  if (!drawn && drawn.error().code == ErrorCode::unsupported) GTEST_SKIP() << drawn.error().message;
  ASSERT_TRUE(drawn) << drawn.error().message;
  EXPECT_EQ(warnings, 1u);
}

// A level without a camera is framed by rays of its own.
TEST(DefaultView, leavesWarningsToWhoDrawsTheLevel) {
  const FarRoom room;
  std::size_t messages = 0;
  Context context;
  context.onMessage = [&](Severity, std::string_view) { ++messages; };
  const auto framed = frameLevel(room.scene, 1.2f, 1.6f, context);
  ASSERT_TRUE(framed) << framed.error().message;
  EXPECT_EQ(messages, 0u);
  context.message(Severity::info, "later ones come");
  EXPECT_EQ(messages, 1u);
}

// Linear factors of colour, and of the alpha that the test asks.
TEST(RenderGl, drawsVertexColorsAsTheCpuDoes) {
  Scene scene;
  const std::uint32_t mask = test::addMaterial(scene, glm::vec3(0.5f));
  scene.materials[mask].alphaMode = AlphaMode::mask;
  scene.materials[mask].alphaCutoff = 0.5f;
  Mesh painted = test::quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, mask);
  painted.color = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.2f, 0.2f, 0.2f}};
  painted.colorAlpha = {1.0f, 0.2f, 1.0f, 1.0f};
  test::addInstance(scene, painted);
  test::addInstance(scene, test::quad({-3, -1, 0}, {2, 0, 0}, {0, 2, 0}, mask));
  test::finish(scene);
  RenderRequest r;
  r.width = 96;
  r.height = 64;
  r.camera = test::lookAt({-1, 0, 3}, {-1, 0, 0}, 1.0f);
  const auto drawn = drawTwice(scene, r);
  if (!drawn) return;
  const RenderedFrame &cpu = drawn->cpu, &gl = drawn->gl;
  EXPECT_LT(relativeRms(cpu.albedo, gl.albedo), 0.02);
  EXPECT_GT(total(cpu.albedo), 0.0);
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

// One row of a million sub-pixels, each with many shadow rays.
TEST(RenderCpu, aCancelIsHeardWithinARow) {
  Context quiet;
  auto tracer = RayTracer::create(level(), "avx2", quiet, RayStructure::thorough, RayGeometry::drawn);
  ASSERT_TRUE(tracer);
  RenderRequest r = request(level(), nullptr, "cam_hall");
  r.width = 4096;
  r.height = 1;
  r.samples = 16;
  r.straight = r.centres = false;
  ASSERT_FALSE(r.lights.empty());
  r.lights.resize(40, r.lights.front());
  const test::CancelledWork work([&](Context& context) {
    const auto frame = renderCpu(*tracer, r, context);
    if (!frame) {
      EXPECT_EQ(frame.error().message, "cancelled");
    }
    return static_cast<bool>(frame);
  });
  EXPECT_LT(work.shareAfterCancel(0.3), 0.5);
}

}  // namespace
}  // namespace relume
