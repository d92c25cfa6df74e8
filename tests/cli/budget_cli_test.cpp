// SPDX-License-Identifier: MIT
// Budgets on the command line: what they go with, and what is printed.
#include "tests/cli/cli_fixture.h"

#include <nlohmann/json.hpp>

namespace relume {
namespace {

class BudgetCli : public CliFixture {
 protected:
  // The room with a budget, whose counts are its affair.
  std::vector<std::string> budgeted(std::vector<std::string> more) const {
    std::vector<std::string> list = {"bake", room_, "-o", out_, "--preset", "draft", "--walks", "1000", "--rays", "64"};
    list.insert(list.end(), more.begin(), more.end());
    return list;
  }
  void expectUsage(const ProgramResult& result, const std::string& words) {
    EXPECT_EQ(result.status, 1) << result.out << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(out_));
  }
};

TEST_F(BudgetCli, bakesWithinItAndSaysSo) {
  const ProgramResult result = run(budgeted({"--budget-mb", "1"}));
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NE(result.out.find("ms a frame in a game"), std::string::npos) << result.out;
  const ProgramResult again = run(budgeted({"--budget-mb", "1"}));
  EXPECT_NE(again.out.find("up to date"), std::string::npos) << again.out;
  const ProgramResult other = run(budgeted({"--budget-mb", "0.75"}));
  EXPECT_EQ(other.out.find("up to date"), std::string::npos) << other.out;

  const ProgramResult info = run({"info", out_, "--json"});
  ASSERT_EQ(info.status, 0) << info.err;
  const auto json = nlohmann::json::parse(info.out);
  EXPECT_LE(json["atRunTime"]["memoryMiB"].get<double>(), 0.75);
  EXPECT_GT(json["atRunTime"]["memoryMiB"].get<double>(), 0.4);
  EXPECT_GT(json["atRunTime"]["frameMs"].get<double>(), 0.0);
  EXPECT_EQ(json["options"]["budget"]["memoryMiB"].get<double>(), 0.75);
}

TEST_F(BudgetCli, countsBesideItAreRefused) {
  expectUsage(run(budgeted({"--budget-mb", "1", "--surfels", "500"})), "surfels.count is 500");
  expectUsage(run(budgeted({"--budget-ms", "1", "--links", "50"})), "links.linksPerCache is 50");
  expectUsage(run(budgeted({"--max-error", "0.1", "--lightmap-caches", "50"})), "caches.lightmapCaches is 50");
  expectUsage(run(budgeted({"--budget-mb", "1", "--links-total", "5000"})), "links.linksTotal (--links-total)");
  expectUsage(run(budgeted({"--budget-mb", "1", "--grid", "2,2,2"})), "caches.gridResolution (--grid)");
  expectUsage(run(budgeted({"--budget-mb", "-1"})), "budget.memoryMiB (--budget-mb)");
  expectUsage(run(budgeted({"--budget-mb", "nan"})), "budget.memoryMiB (--budget-mb)");
  expectUsage(run(budgeted({"--budget-ms", "1e9"})), "budget.frameMs (--budget-ms)");
  expectUsage(run(budgeted({"--max-error", "2"})), "budget.maxError (--max-error)");
  expectUsage(run({"bake", room_, "--plan", at("p.plan"), "--max-error", "0.1"}), "not for a plan");
  // A grid or a light map that is switched off is no count.
  EXPECT_EQ(run(budgeted({"--budget-mb", "1", "--grid-caches", "0"})).status, 0);
}

TEST_F(BudgetCli, countsOfAnOptionsFileBesideItAreRefused) {
  const auto from = [&](const std::string& json, std::vector<std::string> more) {
    more.insert(more.end(), {"--options", put("o.json", json)});
    return run(budgeted(more));
  };
  expectUsage(from("{\"surfels\": {\"count\": 500}}", {"--budget-mb", "1"}),
              "o.json: option surfels.count is 500, and a budget chooses it (--budget-mb");
  expectUsage(from("{\"links.linksPerCache\": 50}", {"--max-error", "0.1"}),
              "o.json: option links.linksPerCache is 50");
  expectUsage(from("{\"caches\": {\"lightmapCaches\": 50}, /**/ \"budget\": {\"frameMs\": 1}}", {}),
              "o.json: option caches.lightmapCaches is 50");
  EXPECT_EQ(from("{\"surfels\": {\"count\": 500}}", {"--print-options"}).status, 0) << "no budget";
  EXPECT_EQ(from("{}", {"--budget-mb", "1", "--print-options"}).status, 0);
  EXPECT_EQ(from("{\"caches\": {\"gridCaches\": 0}}", {"--budget-mb", "1", "--print-options"}).status, 0);
}

// What --print-options wrote has all counts: those of the preset say nothing, others are told not to be used.
TEST_F(BudgetCli, writtenOptionsAreReadBesideIt) {
  const std::string file = put("all.json", run(budgeted({"--budget-mb", "1", "--print-options"})).out);
  const ProgramResult same = run(budgeted({"--options", file, "--print-options"}));
  EXPECT_EQ(same.status, 0) << same.err;
  EXPECT_EQ(same.out, readAll(file));
  EXPECT_EQ(same.err, "");
  const ProgramResult other = run({"bake", "--preset", "medium", "--options", file, "--print-options"});
  EXPECT_EQ(other.status, 0) << other.err;
  EXPECT_NE(other.err.find("all.json: option surfels.count is "), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("the file's is not used"), std::string::npos) << other.err;
}

TEST_F(BudgetCli, anErrorThatCannotBeHadLeavesTheOldBake) {
  ASSERT_EQ(run(budgeted({"--budget-mb", "0.5"})).status, 0);
  const auto before = std::filesystem::last_write_time(out_);
  const ProgramResult result = run(budgeted({"--budget-mb", "0.5", "--max-error", "0.00001"}));
  EXPECT_EQ(result.status, 4) << result.err;
  EXPECT_NE(result.err.find("--max-error"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("of the sizes tried, up to 0.5 MiB, the best certifies "), std::string::npos) << result.err;
  EXPECT_EQ(std::filesystem::last_write_time(out_), before);
  EXPECT_EQ(filesIn(folder_ / "out"), 1u);
}

}  // namespace
}  // namespace relume
