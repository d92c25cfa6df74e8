// SPDX-License-Identifier: MIT
// Lists of lights: what is written is read again, and nothing else is written over.
#include "tools/render/lights_file.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <gtest/gtest.h>

#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

namespace relume {
namespace {

namespace fs = std::filesystem;

class LightsFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_lights_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path at(const char* name) const { return folder_ / name; }
  fs::path put(const char* name, const std::string& bytes) const {
    std::ofstream(at(name), std::ios::binary) << bytes;
    return at(name);
  }
  static std::string bytesOf(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  fs::path folder_;
};

std::vector<SceneLight> manyLights() {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  std::vector<SceneLight> lights;
  for (int i = 0; i < 600; ++i) {
    SceneLight light;
    light.kind = static_cast<LightKind>(i % 3);
    light.name = i % 5 == 0 ? "" : "a \"light\"\\ \xc3\xa4\n" + std::to_string(i);
    const float scale = std::pow(10.0f, 9.0f * any(random));
    light.intensity = scale * glm::abs(glm::vec3(any(random), any(random), any(random)));
    if (i % 7 == 0) light.intensity.y = 0.0f;
    if (i % 11 == 0) light.intensity = glm::vec3(0.0f);
    light.positionWorld = 1e3f * glm::vec3(any(random), any(random), any(random));
    light.direction = glm::normalize(glm::vec3(any(random), any(random), any(random)));
    if (light.kind == LightKind::point) light.direction = {0, 0, -1};
    if (i % 2 == 0 && light.kind != LightKind::directional) light.range = 10.0f + any(random);
    if (light.kind == LightKind::spot) {
      light.outerConeRad = 0.8f + 0.7f * any(random);
      light.innerConeRad = 0.5f * light.outerConeRad;
    }
    lights.push_back(light);
  }
  lights[3].intensity = glm::vec3(1e20f, 1e-20f, std::numeric_limits<float>::denorm_min());
  return lights;
}

TEST_F(LightsFile, whatIsWrittenIsReadAgain) {
  const std::vector<SceneLight> lights = manyLights();
  ASSERT_TRUE(writeLightsFile(at("a.json"), lights));
  const auto read = readLightsFile(at("a.json"));
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), lights.size());
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const SceneLight &a = lights[i], &b = (*read)[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_EQ(a.intensity, b.intensity) << i;
    EXPECT_EQ(a.positionWorld, b.positionWorld) << i;
    EXPECT_LE(glm::distance(a.direction, b.direction), 2e-7f) << i;
    EXPECT_EQ(a.range, b.range);
    EXPECT_EQ(a.innerConeRad, b.innerConeRad);
    EXPECT_EQ(a.outerConeRad, b.outerConeRad);
  }
  ASSERT_TRUE(writeLightsFile(at("none.json"), {}));
  EXPECT_EQ(bytesOf(at("none.json")), "[]\n");
  EXPECT_TRUE(readLightsFile(at("none.json")));
}

TEST_F(LightsFile, numbersAreAsShortAsTheyCanBe) {
  SceneLight light;
  light.kind = LightKind::spot;
  light.name = "key";
  light.intensity = glm::vec3(300.0f, 150.0f, 60.0f);
  light.positionWorld = {0.1f, 1.5f, -2.0f};
  EXPECT_EQ(lightsFileText(std::vector{light}),
            "[\n  {\"type\": \"spot\", \"name\": \"key\", \"position\": [0.1, 1.5, -2], \"direction\": [0, 0, -1], "
            "\"color\": [1, 0.5, 0.2], \"intensity\": 300, \"innerConeAngle\": 0, \"outerConeAngle\": 0.7853982}\n]\n");
}

TEST_F(LightsFile, onlyAListOfLightsIsWrittenOver) {
  const std::vector<SceneLight> lights(2);
  for (const std::string bytes : {"glTF\2", "{\"asset\": {}}", "[{\"type\": \"point\"}]", "[1, 2", "notes"}) {
    const fs::path other = put("other", bytes);
    const Status refused = writeLightsFile(other, lights);
    ASSERT_FALSE(refused) << bytes;
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_NE(refused.error().message.find("is not a list of lights"), std::string::npos) << refused.error().message;
    EXPECT_EQ(bytesOf(other), bytes);
  }
  EXPECT_TRUE(writeLightsFile(put("empty", ""), lights));
  EXPECT_TRUE(writeLightsFile(put("list", "[]"), lights));
  EXPECT_EQ(readLightsFile(at("list"))->size(), 2u);

  EXPECT_EQ(writeLightsFile(folder_, lights).error().code, ErrorCode::io);
  EXPECT_EQ(writeLightsFile(at("nowhere") / "list", lights).error().code, ErrorCode::io);
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  EXPECT_EQ(writeLightsFile(at("pipe"), lights).error().code, ErrorCode::io);
  EXPECT_EQ(writeLightsFile(at("many"), std::vector<SceneLight>(4097)).error().code, ErrorCode::usage);
  EXPECT_FALSE(fs::exists(at("many")));
}

}  // namespace
}  // namespace relume
