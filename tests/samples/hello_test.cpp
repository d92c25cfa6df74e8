// SPDX-License-Identifier: MIT
// samples/01_hello_relight on a bake of the sample level: it prints light, and valgrind finds no error and no leak in
// it.
#include "tests/cli/make_gltf.h"
#include "tests/cli/run_program.h"

#include <gtest/gtest.h>

#include <array>
#include <fstream>

namespace relume {
namespace {

namespace fs = std::filesystem;

class Hello : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_hello_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const ProgramResult baked = runProgram(
        {"bake", RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", "-o", bake(), "--preset", "draft", "--surfels",
         "512", "--lightmap-caches", "200", "--links", "64", "--rays", "64", "--walks", "5000", "--progress", "none"},
        folder_);
    ASSERT_EQ(baked.status, 0) << baked.err;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string bake() const { return (folder_ / "level.relume").string(); }
  // Exit status of a shell command; its output goes to log().
  int shell(const std::string& command) const {
    const int status = std::system((command + " >'" + (folder_ / "log.txt").string() + "' 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  std::string log() const { return readAll(folder_ / "log.txt"); }

  fs::path folder_;
};

TEST_F(Hello, printsSixteenFramesOfLight) {
  ASSERT_EQ(shell("'" RELUME_HELLO "' '" + bake() + "'"), 0) << log();
  EXPECT_NE(log().find("frame 15: irradiance at"), std::string::npos) << log();
  EXPECT_EQ(log().find("nan"), std::string::npos) << log();
  EXPECT_EQ(shell("'" RELUME_HELLO "' /no/such/level.relume"), 2) << log();
}

TEST_F(Hello, takesAPointOfThreeNumbers) {
  ASSERT_EQ(shell("'" RELUME_HELLO "' '" + bake() + "' 1 1.5 -2e0"), 0) << log();
  EXPECT_NE(log().find("irradiance at (1.00 1.50 -2.00)"), std::string::npos) << log();
  for (const std::string point : {"a b c", "1 1 x", "1 1 1m", "1 '' 1", "1 nan 1", "1 1e99 1", "1 1"}) {
    EXPECT_EQ(shell("'" RELUME_HELLO "' '" + bake() + "' " + point), 1) << point << '\n' << log();
    EXPECT_NE(log().find("usage: hello_relight"), std::string::npos) << point << '\n' << log();
  }
}

TEST_F(Hello, saysThatThereIsNoGrid) {
  const ProgramResult baked = runProgram(
      {"bake", RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", "-o", bake(), "--preset", "draft", "--force",
       "--surfels", "512", "--lightmap-caches", "200", "--grid-caches", "0", "--progress", "none"},
      folder_);
  ASSERT_EQ(baked.status, 0) << baked.err;
  EXPECT_EQ(shell("'" RELUME_HELLO "' '" + bake() + "'"), 1) << log();
  EXPECT_NE(log().find("level.relume: no grid"), std::string::npos) << log();
}

// Two passages that meet in a corner: the middle of what is baked is behind the walls, where no light comes.
TEST_F(Hello, looksWhereTheLevelIs) {
  GltfParts parts;
  BoxRoom& room = parts.room;
  room = {};
  using Corner = std::array<float, 3>;
  const auto quad = [&](const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
    const auto first = static_cast<std::uint16_t>(room.position.size());
    room.position.insert(room.position.end(), {a, b, c, d});
    for (const int i : {0, 1, 2, 0, 2, 3}) room.index.push_back(static_cast<std::uint16_t>(first + i));
  };
  constexpr float kWide = 4.0f, kLong = 20.0f, kHigh = 4.0f;
  const std::array<std::array<float, 2>, 6> outline{
      {{0, 0}, {0, kLong}, {kWide, kLong}, {kWide, kWide}, {kLong, kWide}, {kLong, 0}}};
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto& [ax, az] = outline[i];
    const auto& [bx, bz] = outline[(i + 1) % outline.size()];
    quad({bx, 0, bz}, {ax, 0, az}, {ax, kHigh, az}, {bx, kHigh, bz});
  }
  for (const auto& [width, near, depth] : {std::array{kWide, kWide, kLong}, std::array{kLong, 0.0f, kWide}}) {
    quad({0, 0, near}, {0, 0, depth}, {width, 0, depth}, {width, 0, near});
    quad({0, kHigh, near}, {width, kHigh, near}, {width, kHigh, depth}, {0, kHigh, depth});
  }
  const fs::path level = folder_ / "corner.gltf";
  std::ofstream(level) << makeGltf(parts);
  const ProgramResult baked = runProgram({"bake", level.string(), "-o", bake(), "--preset", "draft", "--force",
                                          "--surfels", "512", "--lightmap-caches", "200", "--progress", "none"},
                                         folder_);
  ASSERT_EQ(baked.status, 0) << baked.err;
  ASSERT_EQ(shell("'" RELUME_HELLO "' '" + bake() + "'"), 0) << log();
  EXPECT_EQ(log().find("facing up: 0.0000"), std::string::npos) << log();
}

TEST_F(Hello, valgrindFindsNoErrorAndNoLeak) {
  if (std::string(RELUME_SANITIZE) != "") GTEST_SKIP() << "built with " RELUME_SANITIZE ", which valgrind cannot run";
  if (std::system("command -v valgrind >/dev/null 2>&1") != 0) GTEST_SKIP() << "valgrind is not installed";
  EXPECT_EQ(
      shell("valgrind --error-exitcode=99 --leak-check=full --errors-for-leak-kinds=definite '" RELUME_HELLO "' '" +
            bake() + "'"),
      0)
      << log();
  EXPECT_NE(log().find("ERROR SUMMARY: 0 errors"), std::string::npos) << log();
  EXPECT_NE(log().find("frame 15"), std::string::npos) << log();
}

}  // namespace
}  // namespace relume
