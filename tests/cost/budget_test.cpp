// SPDX-License-Identifier: MIT
// Options within their range that ask for more memory than the budget are refused by name, before it is allocated; a
// budget changes no byte of what fits into it; and estimates are near what is measured.
#include "tests/cli/cli_fixture.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace relume {
namespace {

class Budget : public CliFixture {
 protected:
  ProgramResult bakeWith(std::vector<std::string> more) { return run(bakeArguments(room_, out_, std::move(more))); }
  void expectRefused(const ProgramResult& result, const std::string& stage, const std::string& remedy) {
    EXPECT_TRUE(result.status == 1 || result.status == 4) << result.status;
    for (const std::string& part :
         {stage + " needs about ", std::string("the budget is "), remedy, std::string("--max-memory")})
      EXPECT_NE(result.err.find(part), std::string::npos) << part << " in: " << result.err;
    EXPECT_FALSE(std::filesystem::exists(out_));
    // Sanitizers hold more.
    if (std::string(RELUME_SANITIZE).empty()) {
      EXPECT_LT(result.peakBytes, std::size_t{512} << 20);
    }
  }
};

TEST_F(Budget, namesTheLightMap) {
  expectRefused(bakeWith({"--lightmap", "16384", "--max-memory", "2G"}), "light map", "lower --lightmap");
  expectRefused(bakeWith({"--lightmap-caches", "100000000", "--max-memory", "2G"}), "light map",
                "lower --lightmap-caches");
}

TEST_F(Budget, namesTheLeastChart) {
  const std::string options = put("options.json", R"({"caches": {"minChartTexels": 1000000}})");
  expectRefused(bakeWith({"--options", options, "--max-memory", "2G"}), "light map", "caches.minChartTexels");
}

TEST_F(Budget, namesTheGrid) {
  expectRefused(bakeWith({"--grid", "0,0,0", "--grid-spacing", "1e-4", "--max-memory", "2G"}), "grid",
                "raise --grid-spacing");
  expectRefused(bakeWith({"--grid", "512,512,512", "--max-memory", "2G"}), "grid", "lower --grid");
}

TEST_F(Budget, namesSurfelsAndWalks) {
  expectRefused(bakeWith({"--surfels", "16777216", "--link-kind", "cone", "--max-memory", "1G"}), "surfels",
                "lower --surfels");
  expectRefused(bakeWith({"--walks", "1000000000", "--max-memory", "1G"}), "play space", "lower --walks");
}

TEST_F(Budget, namesTheImageThatIsDrawn) {
  const ProgramResult result =
      run({"render", room_, "--size", "16384x16384", "-o", at("out/a.png"), "--aov", "albedo", "--max-memory", "2G"});
  expectRefused(result, "render", "lower --size");
  expectRefused(run({"reference", room_, "--size", "16384x16384", "-o", at("out/a.exr"), "--max-memory", "2G"}),
                "reference", "lower --size");
}

TEST_F(Budget, namesTheBakeThatIsLookedAt) {
  ASSERT_EQ(bakeWith({}).status, 0);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"validate", out_}, {"info", out_}, {"compare", out_, out_}}) {
    EXPECT_EQ(run(command).status, 0) << command[0];
    std::vector<std::string> poor = command;
    poor.insert(poor.end(), {"--max-memory", "1M"});
    const ProgramResult result = run(poor);
    EXPECT_EQ(result.status, 4) << result.err;
    EXPECT_NE(result.err.find(command[0] + " needs about "), std::string::npos) << result.err;
    EXPECT_EQ(result.out, "");
  }
}

TEST_F(Budget, isReadWithUnits) {
  EXPECT_EQ(bakeWith({"--max-memory", "1K"}).status, 1);
  EXPECT_EQ(bakeWith({"--max-memory", "much"}).status, 1);
  expectRefused(bakeWith({"--max-memory", "1M"}), "rays", "extras.relume");
}

TEST_F(Budget, changesNoByte) {
  bake(room_, out_, {"--max-memory", "4G"});
  bake(room_, at("out/free.relume"));
  EXPECT_EQ(readAll(out_), readAll(at("out/free.relume")));
}

// The greatest estimate of a bake is within a factor of two of the peak that was measured.
TEST_F(Budget, isEstimatedNearWhatIsMeasured) {
  if (!std::string(RELUME_SANITIZE).empty()) GTEST_SKIP() << "sanitizers hold several times as much";
  const std::filesystem::path sponza = std::filesystem::path(RELUME_SHARED_DIR) / "scenes/sponza/sponza.glb";
  if (!std::filesystem::exists(sponza)) GTEST_SKIP() << "no " << sponza;
  const ProgramResult result =
      run({"bake", sponza.string(), "-o", out_, "--preset", "draft", "--report", at("r.json")});
  ASSERT_EQ(result.status, 0) << result.err;
  const nlohmann::json report = nlohmann::json::parse(readAll(at("r.json")));
  double estimate = 0.0;
  for (const nlohmann::json& stage : report["stages"])
    estimate = std::max(estimate, stage["figures"].value("memory_estimate_mib", 0.0));
  const double peak = report["peakMemoryMiB"];
  EXPECT_GT(estimate, 0.5 * peak);
  EXPECT_LT(estimate, 2.0 * peak);
}

}  // namespace
}  // namespace relume
