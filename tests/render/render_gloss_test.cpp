// SPDX-License-Identifier: MIT
// Glossy light in pictures of the shipped level and of rooms made for it: beside paths, in furnaces, and the same in
// OpenGL.
#include "bake/import/make_tangents.h"
#include "bake/reference/path_tracer.h"
#include "tests/rays/make_scene.h"
#include "tests/render/pictures.h"
#include "tools/render/render_cpu.h"
#ifdef RELUME_RENDER_GL
#include "tools/render/render_gl.h"
#endif

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

// Glossy light beside that of paths through the same pixels.
struct Compared {
  double energy = 0.0;                    // ours over theirs
  double apart = 1.0, albedoApart = 1.0;  // relative RMS of blocks of pixels
};

// A picture 64 pixels wide.
Compared compare(const RayTracer& tracer, const RenderRequest& r, const ReferenceOptions& options) {
  Context context;
  const auto frame = renderCpu(tracer, r, context);
  const auto truth = renderReference(tracer, r.camera, r.lights, options, context);
  EXPECT_TRUE(frame && truth);
  if (!frame || !truth) return {};
  std::vector<glm::vec3> paths;
  for (std::size_t i = 0; i < frame->glossy.size(); ++i)
    paths.push_back(truth->glossyDirect[i] + truth->glossyIndirect[i]);
  return {total(frame->glossy) / total(paths), relativeRms(blocks(paths, 64), blocks(frame->glossy, 64)),
          relativeRms(blocks(truth->albedo, 64), blocks(frame->albedo, 64))};
}

// Lobes that the bands carry, of a draft.
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
    const Compared compared = compare(*tracer, r, options);
    EXPECT_NEAR(compared.energy, 1.0, 0.05) << exponent;
    EXPECT_LT(compared.apart, 0.12) << exponent;
    RecordProperty("exponent" + std::to_string(static_cast<int>(exponent)), std::to_string(compared.apart));
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
    const Compared compared = compare(*tracer, r, options);
    EXPECT_NEAR(compared.energy, 1.0, 0.05) << roughness;
    EXPECT_LT(compared.albedoApart, 0.02) << roughness;
    EXPECT_LT(compared.apart, 0.15) << roughness;
    RecordProperty("roughness" + std::to_string(static_cast<int>(10.0f * roughness)), std::to_string(compared.apart));
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

#ifdef RELUME_RENDER_GL
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
    const auto drawn = drawTwice(scene, r);
    if (!drawn) return;
    const RenderedFrame &cpu = drawn->cpu, &gl = drawn->gl;
    EXPECT_LT(relativeRms(cpu.normal, gl.normal), 0.03) << isMirrored;
    EXPECT_LT(relativeRms(cpu.albedo, gl.albedo), 0.05) << isMirrored;
    EXPECT_LT(relativeRms(composeAov(cpu, Aov::glossy), composeAov(gl, Aov::glossy)), 0.08) << isMirrored;
    EXPECT_NEAR(total(gl.glossy) / total(cpu.glossy), 1.0, 0.02) << isMirrored;
    EXPECT_LT(relativeRms(composeAov(cpu, Aov::full), composeAov(gl, Aov::full)), 0.05) << isMirrored;
    // The map is seen: without it the floor's normals are those of its triangles.
    RenderRequest plain = r;
    plain.gloss = false;
    const auto flat = drawCpu(scene, plain);
    EXPECT_GT(relativeRms(flat->normal, cpu.normal), 0.1) << isMirrored;
  }
}
#endif

}  // namespace
}  // namespace relume
