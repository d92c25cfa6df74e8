// SPDX-License-Identifier: MIT
// `relume render` on the shipped level and a draft bake of it, for tests.
#pragma once

#include "tests/cli/run_program.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace relume::test {

namespace fs = std::filesystem;
inline const std::string kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

class RenderCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("relume_render_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    bake_ = (folder_ / "level.relume").string();
    const ProgramResult made = runProgram(
        {"bake", kLevel, "-o", bake_, "--preset", "draft", "--surfels", "2000", "--progress", "none"}, folder_);
    ASSERT_EQ(made.status, 0) << made.err;
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  // Render the level with these further arguments, to image.exr unless they say otherwise.
  static ProgramResult render(std::vector<std::string> more) {
    std::vector<std::string> arguments{"render", kLevel, "--size", "32x18", "--samples", "1", "--progress", "none"};
    if (std::find(more.begin(), more.end(), "-o") == more.end()) {
      arguments.push_back("-o");
      arguments.push_back(image());
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram(arguments, folder_);
  }
  static std::string image() { return (folder_ / "image.exr").string(); }
  static void expectRefused(const ProgramResult& r, int status, const std::vector<std::string>& words) {
    EXPECT_EQ(r.status, status) << r.err;
    for (const std::string& word : words)
      EXPECT_NE(r.err.find(word), std::string::npos) << "\"" << word << "\" in: " << r.err;
  }

  static inline fs::path folder_;
  static inline std::string bake_;
};

}  // namespace relume::test
