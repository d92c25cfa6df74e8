// SPDX-License-Identifier: MIT
// A folder of its own with a small level, and the command line run in it.
#pragma once

#include "tests/cli/make_gltf.h"
#include "tests/cli/run_program.h"

#include <gtest/gtest.h>

#include <sys/prctl.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace relume {

class CliFixture : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              ("relume_" + std::string(info->test_suite_name()) + "_" + info->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "out");
    room_ = put("room.gltf", makeGltf({}));
    out_ = (folder_ / "out" / "room.relume").string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string put(const std::string& name, const std::string& text) {
    const std::filesystem::path path = folder_ / name;
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  ProgramResult run(const std::vector<std::string>& arguments) { return runProgram(arguments, folder_); }

  // As a user whom permissions stop, which root is not. Status kNotDropped: a root who cannot become one.
  static constexpr int kNotDropped = 99;
  ProgramResult runAsUser(const std::vector<std::string>& arguments) {
    return runProgram(arguments, folder_, [] {
      for (const unsigned long power : {1ul, 2ul}) {  // CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        if (::prctl(PR_CAPBSET_DROP, power, 0, 0, 0) != 0 && ::geteuid() == 0) ::_exit(kNotDropped);
      }
    });
  }

  // The smallest options that bake the room.
  std::vector<std::string> bakeArguments(const std::string& scene, const std::string& output,
                                         std::vector<std::string> more = {}) const {
    std::vector<std::string> list = {
        "bake",   scene, "-o",      output, "--surfels",         "256", "--links", "32",
        "--rays", "64",  "--walks", "1000", "--lightmap-caches", "64",  "--grid",  "2,2,2"};
    list.insert(list.end(), more.begin(), more.end());
    return list;
  }
  void bake(const std::string& scene, const std::string& output, std::vector<std::string> more = {}) {
    const ProgramResult result = run(bakeArguments(scene, output, std::move(more)));
    ASSERT_EQ(result.status, 0) << result.err;
  }
  std::size_t filesIn(const std::filesystem::path& folder) const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
  }

  std::filesystem::path folder_;
  std::string room_, out_;
};

}  // namespace relume
