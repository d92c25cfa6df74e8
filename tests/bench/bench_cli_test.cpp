// SPDX-License-Identifier: MIT
// `relume bench`: what it prints can be read by machines and people, and it refuses what makes no sense.
#include "tests/cli/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace relume {
namespace {

const std::string kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

class Bench : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("relume_bench_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  ProgramResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "bench");
    arguments.insert(arguments.end(), {"--progress", "none"});
    return Program(arguments, folder_).wait();
  }
  std::filesystem::path folder_;
};

const std::vector<std::string> kSmall = {"--preset", "draft", "--surfels", "1000", "--rays",    "64",
                                         "--repeat", "3",     "--backend", "cpu",  "--threads", "1,2"};
std::vector<std::string> small(std::vector<std::string> more) {
  more.insert(more.begin(), kSmall.begin(), kSmall.end());
  return more;
}

TEST_F(Bench, lightsTheBandsItIsTold) {
  const ProgramResult result = run(small({kLevel, "--relight-bands", "Y3Co1Cg1", "--json"}));
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("settings").at(0).at("relight").at(0).at("bands"), "Y3Co1Cg1");
  EXPECT_EQ(run(small({kLevel, "--relight-bands", "Y1Co3Cg3"})).status, 1);
}

TEST_F(Bench, measuresLightWithoutABake) {
  const std::vector<std::string> live{kLevel,     "--live",      "--live-cells",
                                      "16",       "--live-rays", "16",
                                      "--repeat", "3",           "--bakes",
                                      "2",        "--threads",   "1,2",
                                      "--force",  "--markdown",  (folder_ / "live.md").string(),
                                      "--json",   "--backend",   "cpu"};
  const ProgramResult result = run(live);
  ASSERT_EQ(result.status, 0) << result.err;
  const nlohmann::json figures = nlohmann::json::parse(result.out).at("live");
  EXPECT_GT(figures.at("voxels").get<int>(), 1000);
  EXPECT_GT(figures.at("caches").get<int>(), 100);
  EXPECT_FALSE(figures.at("edited").get<std::string>().empty());
  ASSERT_EQ(figures.at("relight").size(), 2u);
  for (const nlohmann::json& times : figures.at("relight")) {
    for (const char* pass : {"voxelise", "direct", "bounce", "gather", "frame", "edit voxelise", "edit frame"})
      EXPECT_GT(times.at("passes").at(pass).at("minMs").get<double>(), 0.0) << pass;
    EXPECT_GT(times.at("bufferBytes").at("voxel sides").get<double>(), 0.0);
  }
  const std::string page = readAll(folder_ / "live.md");
  for (const char* words : {"## Light without a bake", "| voxelise |", "| **frame after an edit** |", "| **all** |"})
    EXPECT_NE(page.find(words), std::string::npos) << words << " in " << page;
  EXPECT_EQ(page.find("eye"), std::string::npos) << "one volume follows none";
  EXPECT_EQ(run({kLevel, "--live", "--surfels", "1000"}).status, 1);
  EXPECT_EQ(run({kLevel, "--live-cells", "16"}).status, 1);
}

TEST_F(Bench, jsonHoldsStagesPassesAndBuffers) {
  const ProgramResult result = run(small({kLevel, "--bakes", "2", "--json"}));
  ASSERT_EQ(result.status, 0) << result.err;
  const nlohmann::json report = nlohmann::json::parse(result.out);
  const nlohmann::json& setting = report.at("settings").at(0);
  EXPECT_EQ(setting.at("sizes").at("surfels"), 1000);
  const int max = setting.at("sizes").at("linksPerCache");  // of the fullest row; 64 is the mean
  EXPECT_GE(max, 64);
  EXPECT_LE(max, 8 * 64);

  // Each stage once, however many bakes; together no more than the fastest whole bake.
  double sum = 0.0;
  std::vector<std::string> stages;
  for (const nlohmann::json& stage : setting.at("bake").at("stages")) {
    stages.push_back(stage.at("stage"));
    sum += stage.at("seconds").get<double>();
  }
  const std::vector<std::string> expected = {"rays",   "play space", "surfels", "hierarchy",
                                             "caches", "test rays",  "links",   "receivers"};
  ASSERT_GE(stages.size(), expected.size());
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), stages.begin()));
  EXPECT_LE(sum, setting.at("bake").at("seconds").get<double>());
  EXPECT_GT(setting.at("bake").at("peakMemoryMiB").get<double>(), 1.0);

  ASSERT_EQ(setting.at("relight").size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const nlohmann::json& relight = setting.at("relight").at(i);
    EXPECT_EQ(relight.at("threads"), i + 1);
    double all = 0.0;
    for (const char* pass : {"surfels", "pull", "caches"}) {
      const nlohmann::json& figures = relight.at("passes").at(pass);
      EXPECT_GT(figures.at("minMs").get<double>(), 0.0) << pass;
      EXPECT_GE(figures.at("medianMs"), figures.at("minMs")) << pass;
      all += figures.at("minMs").get<double>();
    }
    EXPECT_GE(relight.at("passes").at("frame").at("minMs").get<double>(), 0.999 * all);
    EXPECT_GT(relight.at("bufferBytes").at("links").get<double>(), 0.0);
  }
}

TEST_F(Bench, pageHasATableForEachThing) {
  const std::filesystem::path page = folder_ / "page.md";
  const ProgramResult result =
      run(small({kLevel, "--markdown", page.string(), "--curve-surfels", "500,1000", "--curve-caches", "100,200"}));
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(result.out.empty()) << result.out;
  const std::string text = readAll(page);
  for (const char* part :
       {"# Performance", "| links |", "(4) light the caches", "CPU, 2 threads", "## With the number of surfels",
        "## With the number of caches", "a tenfold costs", "--curve-surfels 500,1000"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part;
  }
  // No folder of this machine.
  EXPECT_EQ(text.find(RELUME_SOURCE_DIR), std::string::npos);
}

TEST_F(Bench, relightsAFinishedBake) {
  const std::string bake = (folder_ / "level.relume").string();
  ASSERT_EQ(Program({"bake", kLevel, "-o", bake, "--preset", "draft", "--surfels", "1000", "--rays", "64", "--progress",
                     "none"},
                    folder_)
                .wait()
                .status,
            0);
  const ProgramResult result = run({"--bake", bake, "--repeat", "2", "--backend", "cpu", "--threads", "1", "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  const nlohmann::json setting = nlohmann::json::parse(result.out).at("settings").at(0);
  EXPECT_FALSE(setting.contains("bake"));
  EXPECT_EQ(setting.at("sizes").at("surfels"), 1000);
  EXPECT_EQ(setting.at("relight").size(), 1u);
}

TEST_F(Bench, measuresVolumesThatFollowTheEye) {
  const std::vector<std::string> few{kLevel,    "--live", "--live-cells",    "8", "--live-rays", "8", "--repeat", "2",
                                     "--bakes", "1",      "--live-cascades", "2", "--json"};
  const ProgramResult result = run(few);
  ASSERT_EQ(result.status, 0) << result.err;
  const nlohmann::json report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report.at("live").at("cascades"), 2);
  const nlohmann::json& passes = report.at("live").at("relight").at(0).at("passes");
  for (const char* pass : {"eye voxelise", "eye cells", "eye frame"})
    EXPECT_GT(passes.at(pass).at("minMs").get<double>(), 0.0) << pass;
}

TEST_F(Bench, measuresLightWithoutABakeInOpenGl) {
  std::vector<std::string> few{kLevel,    "--live", "--live-cells",    "8", "--live-rays", "8",  "--repeat", "3",
                               "--bakes", "1",      "--live-cascades", "2", "--backend",   "gl", "--json"};
  const ProgramResult result = run(few);
  if (result.status == 5) GTEST_SKIP() << result.err;
  ASSERT_EQ(result.status, 0) << result.err;
  const nlohmann::json report = nlohmann::json::parse(result.out);
  EXPECT_FALSE(report.at("renderer").get<std::string>().empty());
  EXPECT_GT(report.at("live").at("caches").get<int>(), 10);
  ASSERT_EQ(report.at("live").at("relight").size(), 1u);
  const nlohmann::json& times = report.at("live").at("relight").at(0);
  EXPECT_EQ(times.at("backend"), "gl");
  for (const char* pass : {"voxelise", "direct", "bounce", "gather", "frame", "edit cells", "eye cells", "eye frame"})
    EXPECT_GT(times.at("passes").at(pass).at("minMs").get<double>(), 0.0) << pass;
  EXPECT_GT(times.at("bufferBytes").at("OpenGL: cell light").get<double>(), 0.0);
  few.back() = "--live";  // in place of JSON
  few[13] = "cpu,gl";
  const ProgramResult both = run(few);
  ASSERT_EQ(both.status, 0) << both.err;
  for (const char* words : {"| OpenGL |", "| **all of OpenGL** |", "without shadows"})
    EXPECT_NE(both.out.find(words), std::string::npos) << words << " in " << both.out;
}

TEST_F(Bench, refusesWhatMakesNoSense) {
  struct Case {
    std::vector<std::string> arguments;
    int status;
    const char* message;
  };
  const std::vector<Case> cases = {
      {{}, 1, "either a scene or --bake"},
      {{kLevel, "--bake", "x.relume"}, 1, "either a scene or --bake"},
      {{"--bake", "x.relume", "--surfels", "100"}, 1, "need a scene"},
      {{"--bake", "x.relume", "--curve"}, 1, "need a scene"},
      {{"--bake", "/nowhere/x.relume"}, 2, "/nowhere/x.relume"},
      {{"/nowhere/x.glb", "--backend", "cpu"}, 2, "/nowhere/x.glb"},
      {{kLevel, "--surfels", "0"}, 1, "surfels"},
      {{kLevel, "--repeat", "0"}, 1, "--repeat"},
      {{kLevel, "--threads", "0"}, 1, "--threads"},
      {{kLevel, "--backend", "gpu"}, 1, "--backend"},
      {{kLevel, "--preset", "ultra"}, 1, "--preset"},
      {{kLevel, "--markdown", "/nowhere/page.md"}, 2, "/nowhere"},
  };
  for (const Case& each : cases) {
    const ProgramResult result = run(each.arguments);
    EXPECT_EQ(result.status, each.status) << each.message << "\n" << result.err;
    EXPECT_NE(result.err.find(each.message), std::string::npos) << each.message << "\n" << result.err;
    EXPECT_TRUE(result.out.empty()) << each.message;
  }
}

}  // namespace
}  // namespace relume
