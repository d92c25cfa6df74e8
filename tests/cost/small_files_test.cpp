// SPDX-License-Identifier: MIT
// Small files that ask for much (make_levels.py) bake within bounds of processor time, memory and work. Time is
// measured by what the sample level takes here. The bounds are several times what the levels take: what they catch is
// the square of a count.
#include "tests/cli/cli_fixture.h"
#include "tests/long_tests.h"

#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <cmath>
#include <cstdlib>

namespace relume {
namespace {

struct Costly {
  const char* level;
  rlim_t bakes;      // of the sample level, which take as much processor time
  rlim_t mebibytes;  // of address space
  bool isLong = false;
};

void PrintTo(const Costly& costly, std::ostream* out) { *out << costly.level; }

class CostlyLevels : public CliFixture {
 protected:
  void make(const std::string& level) {
    if (std::string(RELUME_PYTHON).empty()) GTEST_SKIP() << "no Python to write the level with";
    const std::string command =
        std::string(RELUME_PYTHON) + " " + RELUME_MAKE_LEVELS + " \"" + folder_.string() + "\" " + level;
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
};

// [s] Of the processor.
double secondsOfTheSample(const std::filesystem::path& folder) {
  static const double seconds = [&] {
    const ProgramResult result =
        runProgram({"bake", RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", "-o", (folder / "sample.relume").string(),
                    "--preset", "draft", "--threads", "2"},
                   folder);
    EXPECT_EQ(result.status, 0) << result.err;
    return result.cpuSeconds;
  }();
  return seconds;
}

class SmallFiles : public CostlyLevels, public testing::WithParamInterface<Costly> {};

// A figure of a report's stage; not a number where it has none.
double figureOf(const std::string& report, const std::string& name) {
  const nlohmann::json whole = nlohmann::json::parse(report);
  for (const nlohmann::json& stage : whole["stages"]) {
    if (stage["figures"].contains(name)) return stage["figures"][name];
  }
  return std::nan("");
}

TEST_P(SmallFiles, bakeWithinBounds) {
  const Costly& costly = GetParam();
  if (costly.isLong && !test::longTests()) GTEST_SKIP() << "a long test: set RELUME_LONG_TESTS=1";
  make(costly.level);
  if (HasFatalFailure() || IsSkipped()) return;

  // Sanitizers reserve terabytes of addresses.
  const bool sanitized = !std::string(RELUME_SANITIZE).empty();
  const double sample = secondsOfTheSample(folder_);
  const ProgramResult result =
      runProgram({"bake", at(std::string(costly.level) + ".glb"), "-o", out_, "--preset", "draft", "--threads", "2"},
                 folder_, [&] {
                   const auto seconds = static_cast<rlim_t>(std::ceil(static_cast<double>(costly.bakes) * sample));
                   const rlimit time{seconds, seconds};
                   ::setrlimit(RLIMIT_CPU, &time);
                   const rlimit memory{costly.mebibytes << 20, costly.mebibytes << 20};
                   if (!sanitized) ::setrlimit(RLIMIT_AS, &memory);
                 });
  EXPECT_EQ(result.status, 0) << result.err;
}

// Thousands of full texels within one texel of each other: a trial of the search for the texel size that opens far more
// caches than asked for is given up, before each of 230,000 texels has asked 10,000 others.
TEST_F(CostlyLevels, aStarIsNotCounted) {
  if (!test::longTests()) GTEST_SKIP() << "a long test: set RELUME_LONG_TESTS=1";
  make("star");
  if (HasFatalFailure() || IsSkipped()) return;
  const ProgramResult result =
      run({"bake", at("star.glb"), "-o", out_, "--preset", "draft", "--threads", "2", "--report", at("report.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  const std::string report = readAll(at("report.json"));
  EXPECT_LT(figureOf(report, "search_texel_pairs"), 2e9);
  EXPECT_LT(figureOf(report, "lightmap_caches"), 8.0 * 768.0);
}

// A chart that is much longer than wide makes the light map wide, not square with nothing in most of its rows.
TEST_F(CostlyLevels, aFenceMakesAWideLightmap) {
  make("fence");
  if (HasFatalFailure() || IsSkipped()) return;
  const ProgramResult result =
      run({"bake", at("fence.glb"), "-o", out_, "--preset", "draft", "--threads", "2", "--report", at("report.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  const std::string report = readAll(at("report.json"));
  const double width = figureOf(report, "lightmap_width"), height = figureOf(report, "lightmap_height");
  EXPECT_GE(width, 4.0 * height) << width << " x " << height;
}

INSTANTIATE_TEST_SUITE_P(cost, SmallFiles,
                         testing::Values(Costly{"coincident_instances", 30, 1024}, Costly{"one_extension", 30, 1024},
                                         Costly{"layer_nodes", 30, 1024}, Costly{"layers", 90, 1536, true},
                                         Costly{"big_image", 30, 1536}, Costly{"needle", 10, 2048},
                                         Costly{"strip", 10, 2048}, Costly{"sheet", 10, 2048}),
                         [](const auto& costly) { return std::string(costly.param.level); });

}  // namespace
}  // namespace relume
