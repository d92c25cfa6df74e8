// SPDX-License-Identifier: MIT
// Mip levels and the footprint that selects them.
#include "bake/import/read_images.h"
#include "formats/color.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <random>

namespace relume {
namespace {

using namespace relume::testing;
using Bytes = std::vector<std::uint8_t>;

glm::dvec3 linearMean(const Image::Level& level) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < level.rgba.size(); i += 4) {
    for (int c = 0; c < 3; ++c)
      sum[c] += srgbToLinear(static_cast<float>(level.rgba[i + static_cast<std::size_t>(c)]) / 255.0f);
  }
  return sum / static_cast<double>(level.rgba.size() / 4);
}

Image noise(std::uint32_t width, std::uint32_t height) {
  std::mt19937 random(7);
  Image image;
  image.levels.push_back({width, height, {}});
  for (std::uint32_t i = 0; i < 4 * width * height; ++i)
    image.levels[0].rgba.push_back(static_cast<std::uint8_t>(random() % 256));
  return image;
}

TEST(MipLevels, keepTheLinearMeanAtAnySize) {
  const std::uint32_t sizes[][2] = {{64, 64}, {63, 17}, {1, 9}, {31, 1}, {3, 3}};
  for (const auto& size : sizes) {
    Image image = noise(size[0], size[1]);
    const glm::dvec3 mean = linearMean(image.levels[0]);
    buildMipLevels(image, false);
    ASSERT_EQ(image.levels.back().width, 1u);
    ASSERT_EQ(image.levels.back().height, 1u);
    for (const Image::Level& level : image.levels) {
      EXPECT_EQ(level.rgba.size(), 4u * level.width * level.height);
      EXPECT_LT(glm::length(linearMean(level) - mean), 0.006) << level.width << " x " << level.height;
    }
  }
}

TEST(MipLevels, ofAMaskLeaveOutTheColourThatIsCutAway) {
  Image image;
  image.levels.push_back({2, 1, {200, 100, 50, 255, 0, 0, 0, 0}});
  Image plain = image;
  buildMipLevels(image, true);
  buildMipLevels(plain, false);
  EXPECT_EQ(image.levels[1].rgba, (Bytes{200, 100, 50, 128}));
  EXPECT_LT(plain.levels[1].rgba[0], 200);
}

TEST(MipLevels, aWhollyTransparentBlockKeepsItsPlainMean) {
  Image image;
  image.levels.push_back({2, 1, {100, 100, 100, 0, 100, 100, 100, 0}});
  buildMipLevels(image, true);
  EXPECT_EQ(image.levels[1].rgba, (Bytes{100, 100, 100, 0}));
}

// A 4 m wide quad under a 64 x 64 checker of single texels, black and white.
GltfBuilder checkerQuad() {
  Bytes rgba;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const std::uint8_t v = (x + y) % 2 ? 255 : 0;
      rgba.insert(rgba.end(), {v, v, v, 255});
    }
  }
  GltfBuilder b;
  const int texture = b.texture(png(64, 64, rgba), {{"magFilter", 9728}});
  const int quad =
      b.quad({{"material", b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}})}});
  b.root["nodes"][static_cast<std::size_t>(quad)]["scale"] = {4, 4, 4};
  return b;
}

TEST(Footprint, widerThanATexelSeesTheMean) {
  const Result<Scene> scene = checkerQuad().import();
  ASSERT_TRUE(scene) << scene.error().message;
  const SurfacePoint p{0, 0, {0.31f, 0.22f}};
  const float texel = 4.0f / 64.0f;
  const float sharp = albedoAt(*scene, p, 0.0f).r;
  EXPECT_TRUE(sharp == 0.0f || sharp == 1.0f);
  EXPECT_EQ(albedoAt(*scene, p, 0.5f * texel).r, sharp);  // never finer than the image
  for (const float wide : {2.0f, 3.0f, 8.0f, 64.0f, 1e6f})
    EXPECT_NEAR(albedoAt(*scene, p, wide * texel).r, 0.5f, 0.005f) << wide;
}

TEST(Footprint, isMeasuredInTheWorldNotInTheMesh) {
  // Half red, half green: at a footprint of half the quad both instances must see the same blur at the same place.
  GltfBuilder b;
  const int texture = b.texture(png(2, 1, {255, 0, 0, 255, 0, 255, 0, 255}), {{"wrapS", 33071}});
  b.quad({{"material", b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}})}});
  b.node({{"mesh", 0}, {"scale", {10, 10, 10}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  for (const float share : {0.1f, 0.6f, 0.9f, 3.0f}) {
    const glm::vec3 small = albedoAt(*scene, {0, 0, {0.2f, 0.05f}}, share);
    const glm::vec3 large = albedoAt(*scene, {1, 0, {0.2f, 0.05f}}, 10.0f * share);
    EXPECT_LT(glm::length(small - large), 1e-5f) << share;
  }
}

TEST(Footprint, meanOverTheSurfaceDoesNotDependOnIt) {
  GltfBuilder b;
  Image image = noise(32, 32);
  for (std::size_t i = 3; i < image.levels[0].rgba.size(); i += 4) image.levels[0].rgba[i] = 255;
  const glm::dvec3 mean = linearMean(image.levels[0]);
  const int texture = b.texture(png(32, 32, image.levels[0].rgba));
  b.quad({{"material", b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}})}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  for (const float footprint : {0.0f, 0.05f, 0.2f, 1.0f}) {
    glm::dvec3 sum(0.0);
    const int side = 128;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const float u = (static_cast<float>(x) + 0.5f) / side, v = (static_cast<float>(y) + 0.5f) / side;
        sum += albedoAt(*scene, u >= v ? SurfacePoint{0, 0, {u - v, v}} : SurfacePoint{0, 1, {u, v - u}}, footprint);
      }
    }
    EXPECT_LT(glm::length(sum / static_cast<double>(side * side) - mean), 0.006) << footprint;
  }
}

TEST(Sampling, coordinatesOfAnySizeStayInTheImage) {
  GltfBuilder b;
  const int texture = b.texture(png(3, 5, Bytes(60, 255)));
  json primitive = {
      {"attributes", {{"TEXCOORD_0", b.floats({1e30f, -1e30f, -1e9f, 1e9f, 16777217.0f, 0.5f, -3.0f, 7.25f}, "VEC2")}}},
      {"material", b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}})}};
  b.quad(primitive);
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  for (std::uint32_t t = 0; t < 2; ++t) {
    for (const float x : {0.0f, 0.3f, 1.0f}) EXPECT_EQ(albedoAt(*scene, {0, t, {x, 0.0f}}, x), glm::vec3(1.0f));
  }
}

}  // namespace
}  // namespace relume
