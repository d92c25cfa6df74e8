// SPDX-License-Identifier: MIT
// Sky maps: which texel is where, reading files, and the light of patches.
#include "tools/render/read_sky_map.h"

#include "relume/relighter.h"
#include "tests/long_tests.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

namespace fs = std::filesystem;

// A map whose texels are the directions of their centres, moved to 0..2, by arithmetic of its own.
SkyMap directionMap(std::uint32_t width, std::uint32_t height) {
  SkyMap map{width, height, {}};
  for (std::uint32_t y = 0; y < height; ++y) {
    const float polar = 3.14159265f * (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
    for (std::uint32_t x = 0; x < width; ++x) {
      const float azimuth = 6.2831853f * ((static_cast<float>(x) + 0.5f) / static_cast<float>(width) - 0.5f);
      map.texels.push_back(
          1.0f + glm::vec3(std::sin(polar) * std::sin(azimuth), std::cos(polar), -std::sin(polar) * std::cos(azimuth)));
    }
  }
  return map;
}

std::vector<glm::vec3> manyDirections() {
  std::vector<glm::vec3> directions{{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, 1, 0}, {0, -1, 0}};
  for (int i = 0; i < 200; ++i) {
    const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / 200.0f, r = std::sqrt(1.0f - z * z);
    const float turn = 2.3999632f * static_cast<float>(i);
    directions.emplace_back(r * std::cos(turn), z, r * std::sin(turn));
  }
  return directions;
}

Sky skyOf(SkyMap map, float rotationDeg = 0.0f) {
  return {{}, {}, std::make_shared<const SkyMap>(std::move(map)), rotationDeg};
}

TEST(SkyMap, ATexelIsWhereTheHeaderSays) {
  const Sky sky = skyOf(directionMap(256, 128));
  for (const glm::vec3& d : manyDirections()) EXPECT_LT(glm::distance(sky.along(d), 1.0f + d), 0.02f);
}

TEST(SkyMap, TurnsCounterClockwiseSeenFromAbove) {
  Sky sky = skyOf(directionMap(256, 128), 90.0f);
  // What was toward -Z is now toward -X.
  EXPECT_LT(glm::distance(sky.along({-1, 0, 0}), 1.0f + glm::vec3(0, 0, -1)), 0.02f);
  EXPECT_LT(glm::distance(sky.along({0, 0, -1}), 1.0f + glm::vec3(1, 0, 0)), 0.02f);
  sky.rotationDeg = -360.0f;
  EXPECT_LT(glm::distance(sky.along({0, 0, -1}), 1.0f + glm::vec3(0, 0, -1)), 0.02f);
}

TEST(SkyMap, OneTexelIsTheWholeSky) {
  const Sky sky = skyOf({1, 1, {glm::vec3(1, 2, 3)}}, 77.0f);
  const std::vector<glm::vec3> directions = manyDirections();
  for (const glm::vec3& d : directions) EXPECT_LT(glm::distance(sky.along(d), glm::vec3(1, 2, 3)), 1e-5f);
  for (const glm::vec3& patch : skyPatchesOf(sky, directions))
    EXPECT_LT(glm::distance(patch, glm::vec3(1, 2, 3)), 1e-5f);
}

TEST(SkyMap, PatchesFollowTheMapAndItsRotation) {
  const std::vector<glm::vec3> directions = manyDirections();
  const Sky sky = skyOf(directionMap(2048, 1024), 30.0f);
  const std::vector<glm::vec3> patches = skyPatchesOf(sky, directions);
  ASSERT_EQ(patches.size(), directions.size());
  // Patches are a few degrees wide.
  for (std::size_t i = 0; i < patches.size(); ++i)
    EXPECT_LT(glm::distance(patches[i], sky.along(directions[i])), 0.15f) << i;
}

TEST(SkyMap, AReducedMapKeepsTheMean) {
  const SkyMap map = directionMap(1000, 7), small = reducedSky(map, 300);
  EXPECT_EQ(small.width, 250u);
  EXPECT_EQ(small.height, 2u);
  EXPECT_EQ(reducedSky(map, 1000).texels, map.texels);
  for (const glm::vec3& texel : small.texels) {
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(texel[c] >= 0.0f && texel[c] <= 2.0f);
  }
}

class SkyMapFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("relume_sky_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  fs::path writeExrOf(const std::vector<glm::vec3>& texels, std::uint32_t width) const {
    ChannelImage image{width, static_cast<std::uint32_t>(texels.size()) / width, {}};
    image.setLayer("", texels);
    EXPECT_TRUE(writeExr(folder_ / "sky.exr", image));
    return folder_ / "sky.exr";
  }
  static std::string header(const std::string& size) { return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + size + "\n"; }
  void expectRefused(const fs::path& path, ErrorCode code, const std::string& words) const {
    const auto map = readSkyMap(path);
    ASSERT_FALSE(map);
    EXPECT_EQ(map.error().code, code) << map.error().message;
    EXPECT_NE(map.error().message.find(words), std::string::npos) << map.error().message;
    EXPECT_NE(map.error().message.find(path.filename().string()), std::string::npos) << map.error().message;
  }
  fs::path folder_;
};

TEST_F(SkyMapFiles, ReadsBothFormats) {
  const std::vector<glm::vec3> texels{{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {9, 10, 1e9f}};
  const auto exr = readSkyMap(writeExrOf(texels, 2));
  ASSERT_TRUE(exr) << exr.error().message;
  EXPECT_EQ(exr->texels, texels);
  EXPECT_EQ(exr->width, 2u);

  // Mantissas over 256, times two to the exponent less 128.
  const auto hdr =
      readSkyMap(write("sky.hdr", header("-Y 1 +X 2") + std::string("\x80\x40\x20\x81\x00\x00\x00\x00", 8)));
  ASSERT_TRUE(hdr) << hdr.error().message;
  EXPECT_EQ(hdr->texels, (std::vector<glm::vec3>{{1.0f, 0.5f, 0.25f}, {0, 0, 0}}));
}

TEST_F(SkyMapFiles, RefusesWhatIsNoRadianceByItsPlace) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::vector<glm::vec3> texels(6, glm::vec3(1.0f));
  texels[4].y = std::numeric_limits<float>::quiet_NaN();
  expectRefused(writeExrOf(texels, 3), ErrorCode::invalidFile, "texel (1, 1) is NaN");
  texels[4].y = -0.5f;
  expectRefused(writeExrOf(texels, 3), ErrorCode::invalidFile, "texel (1, 1) is negative");
  texels[4].y = kInfinity;
  expectRefused(writeExrOf(texels, 3), ErrorCode::invalidFile, "texel (1, 1) is over 1e9");
}

TEST_F(SkyMapFiles, RefusesFilesThatAreNone) {
  expectRefused(folder_ / "none.exr", ErrorCode::io, "");
  expectRefused(write("empty.hdr", ""), ErrorCode::invalidFile, "");
  expectRefused(write("text.hdr", "hello"), ErrorCode::invalidFile, "neither");
  expectRefused(write("cut.exr", std::string("\x76\x2f\x31\x01\x02", 5)), ErrorCode::invalidFile, "");
  expectRefused(write("cut.hdr", header("-Y 8 +X 16") + std::string(20, '\x10')), ErrorCode::invalidFile,
                "ends before its last texel");
  expectRefused(write("huge.hdr", header("-Y 8192 +X 16384") + std::string(64, '\x10')), ErrorCode::invalidFile,
                "claims");
  expectRefused(write("wide.hdr", header("-Y 1 +X 100000") + std::string(64, '\x10')), ErrorCode::invalidFile,
                "100000 x 1 texels; expected at most 16384 x 16384");
  expectRefused(write("negative.hdr", header("-Y -1 +X 4") + std::string(64, '\x10')), ErrorCode::invalidFile, "");
  ChannelImage grey{1, 1, {{"Y", {1.0f}}}};
  ASSERT_TRUE(writeExr(folder_ / "grey.exr", grey));
  expectRefused(folder_ / "grey.exr", ErrorCode::invalidFile, "channels R, G and B");
}

// 16,384 x 8192 texels, in runs of one colour: half a minute and 3 GiB at most, the mean as it is.
TEST_F(SkyMapFiles, ReadsTheLargestThatAreMade) {
  if (!test::longTests()) GTEST_SKIP() << "long: RELUME_LONG_TESTS=1 runs it";
  constexpr std::uint32_t kWidth = 16384, kHeight = 8192;
  std::string row{2, 2, kWidth >> 8, 0};
  for (const char value : {'\x80', '\x80', '\x80', '\x81'}) {
    for (std::uint32_t left = kWidth; left > 0;) {
      const std::uint32_t run = std::min(left, 127u);
      row += {static_cast<char>(128 + run), value};
      left -= run;
    }
  }
  std::string text = header("-Y 8192 +X 16384");
  for (std::uint32_t y = 0; y < kHeight; ++y) text += row;
  const auto map = readSkyMap(write("large.hdr", text));
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(glm::uvec2(map->width, map->height), glm::uvec2(kWidth, kHeight));
  const SkyMap small = reducedSky(*map, 64);
  for (const glm::vec3& texel : small.texels) EXPECT_EQ(texel, glm::vec3(1.0f));
}

TEST_F(SkyMapFiles, AsksForMemoryBeforeItIsTaken) {
  const auto refuse = [](double bytes, const std::string& what) -> Status {
    return Error{ErrorCode::memory, what + ": " + std::to_string(bytes)};
  };
  const auto map = readSkyMap(write("sky.hdr", header("-Y 1 +X 2") + std::string(8, '\x80')), refuse);
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::memory);
}

}  // namespace
}  // namespace relume
