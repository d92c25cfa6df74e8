// SPDX-License-Identifier: MIT
// relume bake --plan, --shard and relume merge: what they write, what they leave alone, and how they end.
#include "tests/cli/cli_fixture.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <fstream>

namespace relume {
namespace {

class ShardsCli : public CliFixture {
 protected:
  // The arguments of a plan, with the options of bakeArguments().
  std::vector<std::string> planArguments(std::vector<std::string> more = {}) const {
    std::vector<std::string> list = bakeArguments(room_, "", std::move(more));
    const auto output = std::find(list.begin(), list.end(), "-o");
    *output = "--plan";
    *(output + 1) = at("plan.relume");
    return list;
  }
  ProgramResult shard(const std::string& number, const std::string& name, std::vector<std::string> more = {}) {
    std::vector<std::string> list = {"bake", room_, "--plan", at("plan.relume"), "--shard", number, "-o", at(name)};
    list.insert(list.end(), more.begin(), more.end());
    return run(list);
  }
  ProgramResult merge(const std::vector<std::string>& shards, std::vector<std::string> more = {}) {
    std::vector<std::string> list = {"merge", at("plan.relume")};
    for (const std::string& each : shards) list.push_back(at(each));
    list.insert(list.end(), {"-o", out_});
    list.insert(list.end(), more.begin(), more.end());
    return run(list);
  }
  void expectEnd(const ProgramResult& result, int status, const std::string& words) {
    EXPECT_EQ(result.status, status) << result.out << result.err;
    EXPECT_NE((result.out + result.err).find(words), std::string::npos)
        << "\"" << words << "\" in: " << result.out << result.err;
  }
  void makeAll() {
    ASSERT_EQ(run(planArguments()).status, 0);
    for (const char* number : {"1", "2", "3"}) {
      const ProgramResult made = shard(std::string(number) + "/3", std::string("s") + number);
      ASSERT_EQ(made.status, 0) << made.err;
    }
  }
};

TEST_F(ShardsCli, mergedShardsAreTheBake) {
  makeAll();
  const ProgramResult merged = merge({"s3", "s1", "s2"}, {"--report", at("merge.json")});
  expectEnd(merged, 0, "3 shards, ");
  const ProgramResult plain = run(bakeArguments(room_, at("plain.relume")));
  ASSERT_EQ(plain.status, 0) << plain.err;
  EXPECT_EQ(readAll(out_), readAll(at("plain.relume")));
  // What it costs a game, and how right it is: in the same words.
  const auto lastWords = [](const std::string& line) { return line.substr(line.find(" MiB, ") + 1); };
  EXPECT_NE(merged.out.find("ms a frame in a game, certified error "), std::string::npos) << merged.out;
  EXPECT_EQ(lastWords(merged.out), lastWords(plain.out));
  EXPECT_NE(readAll(at("merge.json")).find("\"stage\": \"links\""), std::string::npos);
  EXPECT_EQ(run({"validate", out_}).status, 0);
  EXPECT_EQ(run({"status", room_, out_}).status, 0);
}

TEST_F(ShardsCli, whatIsThereIsNotMadeAgain) {
  makeAll();
  const std::string plan = readAll(at("plan.relume")), first = readAll(at("s1"));
  expectEnd(run(planArguments()), 0, "plan.relume: up to date");
  expectEnd(shard("1/3", "s1"), 0, "s1: up to date, shard 1/3 of this plan");
  expectEnd(shard("1/3", "s1", {"--force"}), 0, "s1: shard 1/3, ");
  EXPECT_EQ(readAll(at("s1")), first);
  // Another shard of the plan, a damaged one, one of another plan: made again, saying why.
  expectEnd(shard("2/3", "s1"), 0, "shard 2/3 again: shard 1/3 of this plan is there");
  put("s1", first.substr(0, first.size() / 2));
  expectEnd(shard("1/3", "s1"), 0, "truncated");
  EXPECT_EQ(readAll(at("s1")), first);
  expectEnd(run(planArguments({"--seed", "2"})), 0, "planning: the plan there has other options");
  expectEnd(shard("1/3", "s1"), 0, "of another plan: of other options, seed 1 where the plan has 2");
  EXPECT_NE(readAll(at("s1")), first);
  // A plan made again of what it was made of is the same file: shards made before fit.
  expectEnd(run(planArguments({"--force", "--threads", "1"})), 0, "a plan of ");
  EXPECT_EQ(readAll(at("plan.relume")), plan);
  put("plan.relume", plan.substr(0, plan.size() - 1));
  expectEnd(run(planArguments()), 0, "planning: ");
  EXPECT_EQ(readAll(at("plan.relume")), plan);
}

// What was not made again is told as it was when it was made.
TEST_F(ShardsCli, whatIsThereIsCounted) {
  const std::string file = at("report.json");
  const auto report = [&](const std::vector<std::string>& words, bool upToDate) {
    const ProgramResult result = run(words);
    EXPECT_EQ(result.status, 0) << result.err;
    nlohmann::json read = nlohmann::json::parse(readAll(file));
    EXPECT_EQ(read["upToDate"], upToDate);
    const bool plan = std::find(words.begin(), words.end(), "--shard") == words.end();
    const std::string caches = " " + read["caches"].dump() + (plan ? " caches" : " of ");
    EXPECT_NE(result.out.find(caches), std::string::npos) << caches << " in: " << result.out;
    nlohmann::json sizes;
    for (const char* name : {"surfels", "nodes", "caches", "links", "rayTracer"}) sizes[name] = read[name];
    return sizes;
  };
  const std::vector<std::string> plan = planArguments({"--report", file});
  const nlohmann::json planned = report(plan, false);
  EXPECT_EQ(planned["surfels"], 256);
  EXPECT_GT(planned["caches"], 0);
  EXPECT_EQ(report(plan, true), planned);
  const std::vector<std::string> shard = {"bake", room_, "--plan", at("plan.relume"), "--shard",
                                          "1/3",  "-o",  at("s1"), "--report",        file};
  const nlohmann::json traced = report(shard, false);
  EXPECT_GT(traced["links"], 0);
  EXPECT_LT(traced["caches"], planned["caches"]);
  EXPECT_EQ(report(shard, true), traced);
}

// Ninja takes a depfile away once it is read: a run that has nothing to do writes it again.
TEST_F(ShardsCli, aDepfileNamesLevelAndPlan) {
  ASSERT_EQ(run(planArguments()).status, 0);
  for (const char* words : {"s1: shard 1/3", "s1: up to date"}) {
    expectEnd(shard("1/3", "s1", {"--depfile", at("s1.d")}), 0, words);
    const std::string text = readAll(at("s1.d"));
    EXPECT_TRUE(text.starts_with(at("s1") + ":")) << text;
    for (const char* name : {"room.gltf", "plan.relume"})
      EXPECT_NE(text.find("\n" + at(name) + ":\n"), std::string::npos) << name << " in: " << text;
    std::filesystem::remove(at("s1.d"));
  }
}

TEST_F(ShardsCli, aMergeThatCannotBeWritesNothing) {
  makeAll();
  expectEnd(run({"merge", at("plan.relume"), at("none"), "-o", ""}), 1, "-o: a file's name expected");
  const auto fails = [&](const std::vector<std::string>& shards, int status, const std::string& words) {
    expectEnd(merge(shards), status, words);
    EXPECT_EQ(filesIn(folder_ / "out"), 0u);
  };
  fails({"s1", "s3"}, 3, "missing: shard 2/3");
  fails({"s1", "s2", "s2", "s3"}, 3, "doubled: caches ");
  const std::string thrice = merge({"s1", "s2", "s2", "s2", "s3"}).err;
  EXPECT_NE(thrice.find(at("s2") + " (shard 2/3), given twice\n"), std::string::npos) << thrice;
  EXPECT_EQ(thrice.find("doubled"), thrice.rfind("doubled")) << thrice;
  std::filesystem::copy_file(at("s2"), at("copy"));
  fails({"s1", "s2", "copy", "s3"}, 3, " and in " + at("copy") + " (shard 2/3)\n");
  std::filesystem::create_symlink(at("s2"), at("link"));
  fails({"s1", "s2", "link", "s3"}, 3, " and in " + at("link") + " (shard 2/3), given twice\n");
  fails({"s1", "none", "s3"}, 2, "none: ");
  const std::string second = readAll(at("s2"));
  put("half", second.substr(0, second.size() / 2));
  fails({"s1", "half", "s3"}, 3, "half: file size: truncated");
  put("half", "");
  fails({"s1", "half", "s3"}, 3, "half: empty file");
  bake(room_, at("plain.relume"));
  fails({"s1", "plain.relume", "s3"}, 3, "found a Relume bake");
  fails({"s1", "plan.relume", "s3"}, 3, "found the plan of a bake");
  std::string flipped = second;
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 16);
  put("flipped", flipped);
  fails({"s1", "flipped", "s3"}, 3, "flipped: chunk ");
  // Over a bake that is there: it stays.
  put("out/room.relume", readAll(at("plain.relume")));
  expectEnd(merge({"s1"}), 3, "missing: shards 2/3, 3/3");
  EXPECT_EQ(readAll(out_), readAll(at("plain.relume")));
  EXPECT_EQ(filesIn(folder_ / "out"), 1u);
}

TEST_F(ShardsCli, optionsThatDoNotGoTogetherAreNamed) {
  expectEnd(run({"bake", room_, "--shard", "1/2", "-o", out_}), 1, "--shard: needs the plan");
  expectEnd(run({"bake", room_, "--plan", at("plan.relume"), "-o", out_}), 1, "-o: not with --plan alone");
  expectEnd(run(planArguments({"--verify"})), 1, "--verify: not with --plan");
  expectEnd(run(planArguments({"--export-glb", at("a.glb")})), 1, "--export-glb: not with --plan");
  EXPECT_FALSE(std::filesystem::exists(at("plan.relume")));
  expectEnd(shard("1/2", "s1"), 2, "plan.relume");
  ASSERT_EQ(run(planArguments()).status, 0);
  for (const char* number : {"0/2", "3/2", "1", "x", "1/2/3"})
    expectEnd(shard(number, "s1"), 1, "--shard: expected I/N");
  expectEnd(run({"bake", room_, "--plan", at("plan.relume"), "--shard", "1/2"}), 1, "-o: the name of the shard");
  expectEnd(shard("1/2", "s1", {"--rays", "128"}), 1,
            "links.raysPerCache: a shard has the options of its plan, which has 64, found 128");
  expectEnd(shard("1/2", "s1", {"--preset", "draft"}), 1, "a shard has the options of its plan");
  expectEnd(shard("1/2", "s1", {"--print-options"}), 0, "\"surfels\": {");
  EXPECT_FALSE(std::filesystem::exists(at("s1"))) << "options were to be printed, and nothing else done";
  expectEnd(shard("1/2", "s1", {"--rays", "64"}), 0, "shard 1/2");
  // Neither is written over what is something else.
  const std::string room = readAll(room_);
  expectEnd(shard("1/2", "room.gltf"), 1, "is the scene");
  expectEnd(shard("1/2", "plan.relume"), 1, "is the plan");
  put("other", "text");
  expectEnd(shard("1/2", "other"), 1, "exists and is not a shard of a bake");
  expectEnd(merge({"s1"}, {"--report", at("s1")}), 1, "is a shard");
  EXPECT_EQ(readAll(room_), room);
}

TEST_F(ShardsCli, aShardOfAnotherLevelSaysWhatChanged) {
  ASSERT_EQ(run(planArguments()).status, 0);
  GltfParts moved;
  moved.room.position[0][0] += 0.1f;
  put("room.gltf", makeGltf(moved));
  const ProgramResult result = shard("1/2", "s1");
  expectEnd(result, 3, "is not the one of the plan");
  EXPECT_NE(result.err.find("\"Room\""), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(at("s1")));
}

// The level is asked for whether or not there is something to trace: a merge would make a stale bake of such shards.
TEST_F(ShardsCli, aShardThatIsThereIsOfTheLevelToo) {
  makeAll();
  const std::string first = readAll(at("s1")), room = readAll(room_);
  GltfParts moved;
  moved.room.position[0][0] += 0.1f;
  put("room.gltf", makeGltf(moved));
  expectEnd(shard("1/3", "s1", {"--depfile", at("s1.d")}), 3, "is not the one of the plan");
  expectEnd(shard("1/3", "s1"), 3, "\"Room\"");
  EXPECT_FALSE(std::filesystem::exists(at("s1.d")));
  std::filesystem::remove(room_);
  expectEnd(shard("1/3", "s1"), 2, "room.gltf");
  EXPECT_EQ(readAll(at("s1")), first);
  put("room.gltf", room);
  expectEnd(shard("1/3", "s1"), 0, "s1: up to date");
}

// As a scheduler ends a job, and as a machine that loses its power does: no shard, and none that is half written.
TEST_F(ShardsCli, aShardThatIsEndedMidwayIsNotThere) {
  const std::string level = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";
  std::filesystem::create_directories(folder_ / "shards");
  ASSERT_EQ(run({"bake", level, "--plan", at("plan.relume"), "--preset", "draft", "--rays", "16384"}).status, 0);
  const std::string file = (folder_ / "shards" / "s1").string();
  for (const int signal : {SIGTERM, SIGKILL}) {
    int status = 0;
    for (int i = 0; i < 5 && status == 0; ++i) {  // again where this thread slept until the shard was done
      std::filesystem::remove(file);
      Program program({"bake", level, "--plan", at("plan.relume"), "--shard", "1/1", "-o", file, "--threads", "1",
                       "--progress", "json"},
                      folder_);
      EXPECT_TRUE(program.waitForStderr("\"links\""));
      program.send(signal);
      status = program.wait().status;
    }
    EXPECT_EQ(status, signal == SIGTERM ? 130 : 128 + SIGKILL);
    EXPECT_EQ(filesIn(folder_ / "shards"), 0u);
  }
}

// samples/cluster: names of files are what they are, whatever GNU parallel or a shell would make of them.
TEST_F(ShardsCli, theSampleScriptTakesAnyName) {
  if (std::system("command -v parallel >/dev/null 2>&1") != 0) GTEST_SKIP() << "GNU parallel is not installed";
  const std::string folder = at("a{}b{.}{#}{1} $x\"q\\ %d;&");
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(room_, folder + "/room.gltf");
  std::string options;
  const std::vector<std::string> list = bakeArguments(room_, "");
  for (std::size_t i = 4; i < list.size(); ++i) options += " " + list[i];
  const std::string command = "cd '" + folder +
                              "' && RELUME='" RELUME_BINARY "' '" RELUME_SOURCE_DIR
                              "/samples/cluster/parallel.sh' room.gltf room.relume 2" +
                              options + " >'" + at("log.txt") + "' 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << readAll(at("log.txt"));
  bake(room_, at("plain.relume"));
  EXPECT_EQ(readAll(folder + "/room.relume"), readAll(at("plain.relume")));
}

TEST_F(ShardsCli, theSampleScriptsNameACountThatIsNone) {
  for (const std::string script : {"parallel.sh", "slurm.sh"}) {
    for (const char* count : {"0", "-1", "x", "", "1.5", "08", "99999999999999999999"}) {
      const std::string command = "RELUME='" RELUME_BINARY "' '" RELUME_SOURCE_DIR "/samples/cluster/" + script +
                                  "' '" + room_ + "' '" + at("room.relume") + "' '" + count + "' >'" + at("log.txt") +
                                  "' 2>&1";
      const int status = std::system(command.c_str());
      EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1) << command;
      EXPECT_EQ(readAll(at("log.txt")),
                script + ": SHARDS: a whole number of 1..1000000 expected, \"" + count + "\" found\n");
      EXPECT_FALSE(std::filesystem::exists(at("room.relume.shards"))) << "nothing is planned";
    }
  }
}

TEST_F(ShardsCli, commandsOnBakesSayWhatAPlanIs) {
  makeAll();
  for (const char* name : {"plan.relume", "s1"}) {
    const std::string words = std::string("found ") + (*name == 'p' ? "the plan of a bake" : "a shard of a bake");
    expectEnd(run({"info", at(name)}), 3, words);
    expectEnd(run({"validate", at(name)}), 3, words);
    expectEnd(run({"render", room_, "--bake", at(name), "-o", at("a.exr"), "--size", "8x8"}), 3, words);
  }
}

}  // namespace
}  // namespace relume
