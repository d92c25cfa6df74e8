// SPDX-License-Identifier: MIT
#include "tests/accuracy/compare_images.h"

#include "bake/base/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace relume {
namespace {

// A wall seen straight on, 1 m away: albedo 0.5, every pixel valid, reference light of one value.
ChannelImage wall(std::uint32_t width, std::uint32_t height, float light) {
  ChannelImage image{width, height, {}};
  const std::size_t n = std::size_t{width} * height;
  std::vector<glm::vec3> position(n);
  for (std::size_t i = 0; i < n; ++i) position[i] = glm::vec3(i % width, i / width, 0.0f) * 0.01f;
  image.setLayer("DiffInd", std::vector<glm::vec3>(n, glm::vec3(light)));
  image.setLayer("DiffCol", std::vector<glm::vec3>(n, glm::vec3(0.5f)));
  image.setLayer("Emit", std::vector<glm::vec3>(n, glm::vec3(0.0f)));
  image.setLayer("Position", position, "XYZ");
  image.setLayer("Normal", std::vector<glm::vec3>(n, glm::vec3(0, 0, 1)), "XYZ");
  image.channels["Depth.Z"].assign(n, 1.0f);
  return image;
}

ChannelImage plain(std::uint32_t width, std::uint32_t height, float light) {
  ChannelImage image{width, height, {}};
  image.setLayer("", std::vector<glm::vec3>(std::size_t{width} * height, glm::vec3(light)));
  return image;
}

TEST(CompareImages, equalImagesDifferByNothing) {
  const auto d = compareImages(wall(16, 8, 2.0f), plain(16, 8, 2.0f), {});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->rmse, 0.0);
  EXPECT_EQ(d->rmseTrimmed, 0.0);
  EXPECT_EQ(d->energy, 1.0);
  EXPECT_EQ(d->validShare, 1.0);
  EXPECT_EQ(d->mean, 2.0);
  EXPECT_EQ(d->blockP95, 0.0);
}

TEST(CompareImages, aConstantFactorShowsInEveryFigure) {
  const auto d = compareImages(wall(16, 8, 2.0f), plain(16, 8, 2.5f), {});
  ASSERT_TRUE(d);
  EXPECT_NEAR(d->rmse, 0.25, 1e-9);
  EXPECT_NEAR(d->rmseClean, 0.25, 1e-9);
  EXPECT_NEAR(d->rmseTrimmed, 0.25, 1e-9);
  EXPECT_NEAR(d->energy, 1.25, 1e-9);
  EXPECT_NEAR(d->energyRgb[2], 1.25, 1e-9);
  EXPECT_NEAR(d->blockRmse, 0.25, 1e-9);
  EXPECT_NEAR(d->blockP50, 0.5 / (2.0 + 0.1), 1e-9);
}

TEST(CompareImages, theReferencesOwnNoiseIsRemoved) {
  // Reference = truth + noise of standard deviation s; its halves differ so that half their difference has it, too.
  const float s = 0.2f;
  ChannelImage reference = wall(160, 90, 1.0f);
  for (const char* c : {"R", "G", "B"}) {
    auto& light = reference.channels[std::string("DiffInd.") + c];
    auto& error = reference.channels[std::string("DiffIndErr.") + c];
    error.resize(light.size());
    for (std::size_t i = 0; i < light.size(); ++i) {
      RandomStream random(1, static_cast<std::uint32_t>(c[0]), i);
      const auto gauss = [&] {  // Irwin-Hall
        float sum = -6.0f;
        for (int k = 0; k < 12; ++k) sum += random.uniform();
        return sum;
      };
      light[i] += s * gauss();
      error[i] = s * gauss();
    }
  }
  const auto perfect = compareImages(reference, plain(160, 90, 1.0f), {});
  ASSERT_TRUE(perfect);
  EXPECT_NEAR(perfect->rmse, s, 0.01);
  EXPECT_NEAR(perfect->noise, s, 0.01);
  EXPECT_LT(perfect->rmseClean, 0.03);
  EXPECT_NEAR(perfect->blockRmse, s / 4, 0.005);
  EXPECT_NEAR(perfect->blockNoise, s / 4, 0.005);
  const auto off = compareImages(reference, plain(160, 90, 1.1f), {});
  EXPECT_NEAR(off->rmseClean, 0.1, 0.02);
}

TEST(CompareImages, trimmingDropsTheWorstHundredth) {
  ChannelImage candidate = plain(20, 10, 1.0f);
  candidate.channels["R"][57] = 11.0f;
  candidate.channels["G"][123] = 3.0f;
  const auto d = compareImages(wall(20, 10, 1.0f), candidate, {});
  ASSERT_TRUE(d);
  EXPECT_NEAR(d->rmseClean, std::sqrt((100.0 + 4.0) / 600.0), 1e-6);
  EXPECT_NEAR(d->rmseTrimmed, 0.0, 1e-9);  // 2 of 200 pixels
}

TEST(CompareImages, skyDarkAlbedoEmittersAndBrokenPixelsDoNotCount) {
  ChannelImage reference = wall(10, 10, 1.0f);
  CompareOptions options;
  options.keepEdges = true;
  reference.channels["Depth.Z"][0] = 0.0f;     // sky
  reference.channels["DiffCol.R"][1] = 0.01f;  // one channel too dark
  reference.channels["Emit.B"][2] = 1.0f;      // an emitter
  ChannelImage candidate = plain(10, 10, 1.0f);
  candidate.channels["G"][3] = std::numeric_limits<float>::quiet_NaN();
  for (const std::size_t i : {0u, 2u}) candidate.channels["R"][i] = 100.0f;
  candidate.channels["R"][1] = 100.0f;
  const auto d = compareImages(reference, candidate, options);
  ASSERT_TRUE(d);
  EXPECT_EQ(d->rmse, 0.0);
  EXPECT_EQ(d->nonfinite, 1u);
  EXPECT_NEAR(d->validShare, 0.98, 1e-9);
  options.keepEmitters = true;
  EXPECT_GT(compareImages(reference, candidate, options)->rmse, 1.0);
}

TEST(CompareImages, edgesOfDepthAndNormalAreMaskedOnBothSides) {
  ChannelImage reference = wall(8, 4, 1.0f);
  for (std::size_t y = 0; y < 4; ++y) {
    for (std::size_t x = 4; x < 8; ++x) reference.channels["Position.Z"][y * 8 + x] = -0.05f;  // a step of 5 % of depth
  }
  const auto edge = edgePixels(reference);
  for (std::size_t i = 0; i < edge.size(); ++i) EXPECT_EQ(edge[i], i % 8 == 3 || i % 8 == 4 ? 1 : 0);

  ChannelImage bent = wall(8, 4, 1.0f);
  bent.channels["Normal.Z"][10] = 0.8f;
  bent.channels["Normal.X"][10] = 0.6f;
  const auto around = edgePixels(bent);
  for (std::size_t i = 0; i < around.size(); ++i)
    EXPECT_EQ(around[i], i == 2 || i == 9 || i == 10 || i == 11 || i == 18 ? 1 : 0) << i;
}

TEST(CompareImages, layersAreSummed) {
  ChannelImage reference = wall(8, 8, 1.0f);
  reference.setLayer("DiffDir", std::vector<glm::vec3>(64, glm::vec3(3.0f)));
  CompareOptions options;
  options.layers = {"DiffDir", "DiffInd"};
  const auto d = compareImages(reference, plain(8, 8, 4.0f), options);
  ASSERT_TRUE(d);
  EXPECT_EQ(d->rmse, 0.0);
  EXPECT_EQ(d->mean, 4.0);
}

TEST(CompareImages, missingLayersOtherSizesAndNothingValidAreErrors) {
  CompareOptions options;
  EXPECT_FALSE(compareImages(wall(8, 8, 1.0f), plain(8, 4, 1.0f), options));
  options.layers = {"Nothing"};
  EXPECT_FALSE(compareImages(wall(8, 8, 1.0f), plain(8, 8, 1.0f), options));
  options = {};
  options.candidateLayer = "Other";
  EXPECT_FALSE(compareImages(wall(8, 8, 1.0f), plain(8, 8, 1.0f), options));
  ChannelImage sky = wall(8, 8, 1.0f);
  sky.channels["Depth.Z"].assign(64, 0.0f);
  const auto nothing = compareImages(sky, plain(8, 8, 1.0f), {});
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::invalidFile);
}

TEST(ImageIo, exrKeepsChannelsAndPngRefusesWrongSizes) {
  const auto folder = std::filesystem::temp_directory_path() / "relume_image_io_test";
  std::filesystem::create_directories(folder);
  ChannelImage image = wall(7, 5, 0.123f);
  image.channels["Depth.Z"][34] = 1e30f;
  ASSERT_TRUE(writeExr(folder / "a.exr", image));
  const auto back = readExr(folder / "a.exr");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->width, 7u);
  EXPECT_EQ(back->channels, image.channels);

  ASSERT_TRUE(writeExr(folder / "h.exr", image, /*half=*/true));
  const auto narrow = readExr(folder / "h.exr");
  ASSERT_TRUE(narrow);
  EXPECT_EQ(narrow->channels.at("Depth.Z"), image.channels.at("Depth.Z"));
  EXPECT_NEAR(narrow->channels.at("DiffInd.R")[9], 0.123f, 1e-4f);

  EXPECT_FALSE(writeImage(folder / "a.bmp", 7, 5, image.layer("DiffInd")));
  EXPECT_FALSE(writePng(folder / "a.png", 7, 6, image.layer("DiffInd")));
  EXPECT_TRUE(writePng(folder / "a.png", 7, 5, image.layer("DiffInd")));
  EXPECT_EQ(writeExr(folder / "no" / "such" / "a.exr", image).error().code, ErrorCode::io);
  EXPECT_EQ(readExr(folder / "none.exr").error().code, ErrorCode::io);
  EXPECT_EQ(readExr(folder / "a.png").error().code, ErrorCode::invalidFile);
  std::filesystem::resize_file(folder / "a.exr", std::filesystem::file_size(folder / "a.exr") / 2);
  EXPECT_EQ(readExr(folder / "a.exr").error().code, ErrorCode::invalidFile);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace relume
