// SPDX-License-Identifier: MIT
// The command line as a user meets it: exit status and message of each kind of bad input, what a good run leaves
// behind, and Ctrl-C.
#include "tests/cli/make_gltf.h"
#include "tests/cli/run_program.h"

#include <gtest/gtest.h>

#include <fcntl.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <map>

namespace relume {
namespace {

namespace fs = std::filesystem;

class Cli : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_cli_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "out");
    room_ = put("room.gltf", makeGltf({}));
    out_ = (folder_ / "out" / "room.relume").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string put(const std::string& name, const std::string& text) {
    const fs::path path = folder_ / name;
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }
  ProgramResult run(const std::vector<std::string>& arguments) { return runProgram(arguments, folder_); }

  // The smallest options that bake the room.
  std::vector<std::string> bakeArguments(const std::string& scene, std::vector<std::string> more = {}) const {
    std::vector<std::string> list = {
        "bake",   scene, "-o",      out_,   "--surfels",         "256", "--links", "32",
        "--rays", "64",  "--walks", "1000", "--lightmap-caches", "64",  "--grid",  "2,2,2"};
    list.insert(list.end(), more.begin(), more.end());
    return list;
  }
  void expectFailure(const ProgramResult& result, int status, const std::string& message) {
    EXPECT_EQ(result.status, status) << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << "expected: " << message << "\nfound: " << result.err;
    EXPECT_TRUE(fs::is_empty(folder_ / "out")) << "something was left behind";
  }

  fs::path folder_;
  std::string room_, out_;
};

std::string smallBake(Cli*, const ProgramResult& result, const std::string& path) {
  EXPECT_EQ(result.status, 0) << result.err;
  return readAll(path);
}

TEST_F(Cli, bakesAndDescribesAndValidates) {
  const ProgramResult baked = run(bakeArguments(room_, {"--report", (folder_ / "report.json").string()}));
  const std::string bytes = smallBake(this, baked, out_);
  EXPECT_GT(bytes.size(), 10000u);
  EXPECT_NE(baked.out.find("256 surfels"), std::string::npos) << baked.out;
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "out"), fs::directory_iterator{}), 1);

  const std::string report = readAll(folder_ / "report.json");
  for (const char* stage : {"import", "surfels", "hierarchy", "caches", "links", "write"})
    EXPECT_NE(report.find("\"stage\": \"" + std::string(stage) + "\""), std::string::npos) << stage;

  const ProgramResult valid = run({"validate", out_});
  EXPECT_EQ(valid.status, 0) << valid.out << valid.err;
  const ProgramResult info = run({"info", out_});
  EXPECT_EQ(info.status, 0);
  EXPECT_NE(info.out.find("link.cone"), std::string::npos);
  const ProgramResult json = run({"info", out_, "--json"});
  EXPECT_EQ(json.status, 0);
  EXPECT_NE(json.out.find("\"spacingMinM\""), std::string::npos);
}

TEST_F(Cli, sceneInfoReportsMeshes) {
  GltfParts parts;
  parts.room.index.insert(parts.room.index.end(), {0, 1, 2, 5, 5, 6});  // a duplicate and a degenerate triangle
  const std::string scene = put("faulty.gltf", makeGltf(parts));
  const ProgramResult info = run({"info", scene});
  EXPECT_EQ(info.status, 0) << info.err;
  EXPECT_NE(info.out.find("node \"Room\""), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("degenerate"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("duplicate"), std::string::npos) << info.out;
  const ProgramResult baked = run(bakeArguments(scene));
  EXPECT_EQ(baked.status, 0) << baked.err;
  EXPECT_NE(baked.err.find("mesh report: degenerate"), std::string::npos) << baked.err;
  EXPECT_NE(baked.err.find("mesh report: repaired triangle: 1 in 1 meshes"), std::string::npos) << baked.err;
}

TEST_F(Cli, helpShowsDefaultsRangesAndUnits) {
  EXPECT_EQ(run({"--help"}).status, 0);
  const ProgramResult help = run({"bake", "--help"});
  EXPECT_EQ(help.status, 0);
  for (const char* text : {"--surfels [131072]", "[2..16777216]", "halton|relaxed|eliminated", "--grid [0,0,0]",
                           " texel]", "--threads", "--play-space", "--cut-key", "--sky-patches", "--pull"})
    EXPECT_NE(help.out.find(text), std::string::npos) << text << "\n" << help.out;
  const ProgramResult preview = run({"preview", "--help"});
  for (const char* text : {"FLOAT in [0.02 - 2]", "FLOAT in [10 - 175]", "INT in [2 - 256]"})
    EXPECT_NE(preview.out.find(text), std::string::npos) << text << "\n" << preview.out;
}

TEST_F(Cli, helpIsACommandAsWell) {
  for (const char* command : {"render", "bake", "store"}) {
    const ProgramResult help = run({"help", command});
    EXPECT_EQ(help.status, 0) << help.err;
    EXPECT_EQ(help.out, run({command, "--help"}).out);
  }
  for (const std::vector<std::string>& words : {std::vector<std::string>{"help"}, {"help", "help"}}) {
    const ProgramResult help = run(words);
    EXPECT_EQ(help.status, 0) << help.err;
    EXPECT_EQ(help.out, run({"--help"}).out);
  }
  expectFailure(run({"help", "bale"}), 1, "unknown command \"bale\"; did you mean \"bake\"? (see relume --help)");
  expectFailure(run({"help", "zzz", "bake"}), 1, "unknown command \"zzz\" (see");
  expectFailure(run({"help", "--x"}), 1, "unknown option \"--x\"");
}

TEST_F(Cli, usageErrors) {
  expectFailure(run({}), 1, "a command is required: bake");
  expectFailure(run({"bale"}), 1, "bale");
  expectFailure(run({"bake", room_}), 1, "-o is missing; expected: relume bake SCENE -o FILE (see relume bake --help)");
  expectFailure(run({"bake"}), 1, "SCENE is missing; expected: relume bake SCENE -o FILE");
  expectFailure(run({"bale", "--x"}), 1, "unknown command \"bale\"; did you mean \"bake\"? (see relume --help)");
  expectFailure(run({"comapre"}), 1, "did you mean \"compare\"?");
  expectFailure(run({"zzz"}), 1, "unknown command \"zzz\" (see");
  expectFailure(run(bakeArguments(room_, {"--surfel", "9"})), 1,
                "relume bake: unknown option \"--surfel\"; did you mean \"--surfels\"?");
  expectFailure(run(bakeArguments(room_, {"--raysp=9"})), 1, "unknown option \"--raysp\"; did you mean \"--rays\"?");
  const std::string picture = (folder_ / "picture.png").string();
  expectFailure(
      run({"render", room_, "--aov", "direct", "-o", picture, "--sky", "1,1"}), 1,
      "--sky: R,G,B, or R,G,B,R,G,B for overhead and underfoot, numbers of 0 to 1e9, expected, \"1,1\" found");
  expectFailure(run({"render", room_, "-o", out_, "--samples", "99"}), 1,
                "--samples: a whole number of 1..16 expected, \"99\" found");
  expectFailure(run({"render", room_, "-o", out_, "--backend", "dx"}), 1, "--backend: a value of cpu, gl expected");
  expectFailure(run(bakeArguments(room_, {"--threads", "9999"})), 1, "--threads: a whole number of 0..1024 expected");
  expectFailure(run({"compare", out_, out_, "--max-rmse", "x"}), 1, "--max-rmse: a number");
  expectFailure(run({"info", room_, "--json=x"}), 1, "--json takes no value");
  expectFailure(run({"info", room_, room_}), 1, "relume info: argument \"" + room_ + "\" is one too many");
  expectFailure(run(bakeArguments(room_, {"--frobnicate"})), 1, "--frobnicate");
  expectFailure(run(bakeArguments(room_, {"--preset", "ultra"})), 1, "ultra");
  expectFailure(run({"validate"}), 1, "FILE");
}

// A list is one word with commas: what comes after it is the command's.
TEST_F(Cli, listsDoNotTakeTheArgumentsBehindThem) {
  const std::string none = (folder_ / "none.glb").string(), picture = (folder_ / "p.png").string();
  expectFailure(run({"render", "--aov", "direct,normal", none, "-o", picture}), 2, "none.glb");
  expectFailure(run({"render", "--aov", "direct", "--lights", "all", none, "-o", picture}), 2, "none.glb");
  expectFailure(run({"preview", "--aov", "direct", none, "-o", picture}), 2, "none.glb");
  expectFailure(run({"compare", "--ignore", "sky,suns", none, room_}), 2, "none.glb");
}

TEST_F(Cli, endsOfRangesAreInThem) {
  const std::string none = (folder_ / "none.glb").string(), picture = (folder_ / "p.png").string();
  for (const char* accuracy : {"0.02", "2"})
    expectFailure(run({"preview", none, "-o", picture, "--accuracy", accuracy}), 2, "none.glb");
  for (const char* accuracy : {"0.0199", "2.001", ""})
    expectFailure(run({"preview", none, "-o", picture, "--accuracy", accuracy}), 1, "--accuracy: a number");
}

// No comparison with NaN is true, and -1 of 64 bits without a sign is the largest number there is.
TEST_F(Cli, numbersThatAreNoneAreRefused) {
  const std::string none = (folder_ / "none.glb").string(), picture = (folder_ / "p.png").string();
  for (const char* value : {"nan", "-nan", "inf", "-1", "1e999", ""}) {
    expectFailure(run({"render", none, "-o", picture, "--live", "--aov", "occlusion", "--occlusion-falloff", value}), 1,
                  "--occlusion-falloff: a number of 0..1e+06 expected");
    expectFailure(run({"render", none, "-o", picture, "--edit-reach", value}), 1, "--edit-reach: a number of 0..1e+08");
    expectFailure(run({"render", none, "-o", picture, "--live", "--presence", value}), 1,
                  "--presence: a number of 0..100 expected");
    expectFailure(run({"diff", picture, picture, "--max-rmse", value}), 1, "--max-rmse: a number of >= 0 expected");
  }
  for (const char* value : {"-1", "18446744073709551616", "99999999999999999999", "x", ""}) {
    for (const char* command : {"reference", "preview"})
      expectFailure(run({command, none, "-o", picture, "--seed", value}), 1, "--seed: a whole number expected");
    expectFailure(run({"store", "gc", (folder_ / "out").string(), "--limit", value}), 1, "--limit: a ");
    expectFailure(run({"info", none, "--max-memory", value}), 1, "--max-memory: a ");
    expectFailure(run(bakeArguments(none, {"--store-limit", value})), 1, "--store-limit: a ");
  }
  expectFailure(run({"reference", none, "-o", picture, "--seed", "18446744073709551615"}), 2, "none.glb");
  expectFailure(run({"info", none, "--max-memory", "8 G"}), 2, "none.glb");
}

TEST_F(Cli, aBarIsDrawnWhereATerminalCanClearIt) {
  for (const char* kind : {"xterm", "dumb", ""}) {
    const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0) GTEST_SKIP() << "no terminal can be made here";
    const std::string name = ::ptsname(master);
    const ProgramResult result = runProgram(bakeArguments(room_), folder_, [&] {
      ::setenv("TERM", kind, 1);
      ::dup2(::open(name.c_str(), O_RDWR | O_NOCTTY), STDERR_FILENO);
    });
    EXPECT_EQ(result.status, 0) << kind;
    std::string drawn(1 << 16, '\0');
    const ssize_t got = ::read(master, drawn.data(), drawn.size());
    drawn.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    ::close(master);
    EXPECT_EQ(drawn.find("\x1b[K") != std::string::npos, std::string(kind) == "xterm") << kind << ": " << drawn;
  }
}

TEST_F(Cli, helpSaysWhatIsRequired) {
  const ProgramResult help = run({"bake", "--help"});
  EXPECT_NE(help.out.find("[OPTIONS] SCENE\n"), std::string::npos) << help.out;
  EXPECT_NE(help.out.find("-o,--output FILE REQUIRED"), std::string::npos) << help.out;
  EXPECT_EQ(run({"bake", "--print-options"}).status, 0) << "needs neither";
}

TEST_F(Cli, versionNamesFormatAndCommit) {
  const ProgramResult version = run({"--version"});
  EXPECT_EQ(version.status, 0);
  for (const char* text : {"relume ", "bake format ", "algorithm version ", "commit "})
    EXPECT_NE(version.out.find(text), std::string::npos) << version.out;
}

TEST_F(Cli, sceneInfoListsLights) {
  const ProgramResult info = run({"info", RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"});
  EXPECT_NE(info.out.find("lights: 3\n"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("point \"lamp\": 3 2.16 1.26 W/sr, at 4.5 1.7 0.55 m"), std::string::npos) << info.out;
}

TEST_F(Cli, absurdOptionsNameOptionRangeAndValue) {
  const auto with = [&](const std::string& flag, const std::string& value) {
    return run({"bake", room_, "-o", out_, "--preset", "draft", flag, value});
  };
  expectFailure(with("--surfels", "0"), 1, "surfels.count (--surfels) is 0, expected 2..16777216");
  expectFailure(with("--surfels", "1000000000"), 1, "surfels.count (--surfels) is 1000000000, expected 2..16777216");
  expectFailure(with("--surfels", "-5"), 1,
                "surfels.count (--surfels): expected a whole number, 2..16777216, found -5");
  expectFailure(with("--surfels", "many"), 1, "found \"many\"");
  expectFailure(with("--bands", "9"), 1, "links.bands (--link-bands) is 9, expected 1..8");
  expectFailure(with("--links", "9000"), 1, "links.linksPerCache (--links) is 9000, expected at most surfels.count");
  expectFailure(with("--links", "0"), 1, "(--links) is 0, expected 1..65535");
  expectFailure(with("--rays", "1"), 1, "(--rays) is 1, expected 16..1048576");
  expectFailure(with("--grid", "2,2"), 1, "(--grid): expected three whole numbers");
  expectFailure(with("--grid", "2000,1,1"), 1, "(--grid) is [2000,1,1], expected 0..1024 each");
  expectFailure(with("--grid", "1024,1024,1024"), 1, "1073741824 points");
  expectFailure(with("--chroma-bands", "4"), 1, "chromaBands (--chroma-bands) is 4, expected at most lumaBands");
  expectFailure(with("--placement", "random"), 1, "one of halton|relaxed|eliminated, found \"random\"");
  expectFailure(with("--isa", "foo"), 1, "(--isa) is \"foo\", expected one of \"\"|sse2|");
  expectFailure(with("--threads", "-1"), 1, "--threads");
  expectFailure(with("--grid-spacing", "nan"), 1, "--grid-spacing");
  expectFailure(with("--lightmap", "7"), 1, "(--lightmap) is 7, expected 0 or 16..16384");
  // What needs more than the machine has is in its range.
  expectFailure(with("--lightmap-caches", "100000000"), 4, "light map needs about ");
  expectFailure(with("--grid-spacing", "1e-9"), 4, " needs about ");
}

TEST_F(Cli, optionsFilesAreReadAndUnknownKeysRefused) {
  const ProgramResult printed = run({"bake", "--preset", "medium", "--print-options"});
  EXPECT_EQ(printed.status, 0);
  EXPECT_NE(printed.out.find("// n_S, surfels that send light [2..16777216]"), std::string::npos) << printed.out;
  const std::string file = put("options.json", printed.out);
  const ProgramResult again = run({"bake", "--preset", "best", "--options", file, "--print-options"});
  EXPECT_EQ(again.out, printed.out) << again.err;
  const ProgramResult over = run({"bake", "--options", file, "--surfels", "77777", "--print-options"});
  EXPECT_NE(over.out.find("\"count\": 77777"), std::string::npos) << over.err;

  const auto refused = [&](const std::string& json, const std::string& message) {
    expectFailure(run({"bake", room_, "-o", out_, "--options", put("bad.json", json)}), 1, message);
  };
  refused("{\"surfels\":{\"cuont\":5}}", "unknown key \"surfels.cuont\"");
  refused("{\"surfels\":5}", "\"surfels\" must be an object");
  refused("{\"surfels\":{\"count\":\"x\"}}", "surfels.count (--surfels): expected a whole number");
  refused("{\"seed\":", "not JSON");
  refused("[]", "expected a JSON object");
  refused(std::string(20000, '['), "JSON nested more than 128 deep");
  expectFailure(run({"bake", room_, "-o", out_, "--options", "nowhere.json"}), 2, "nowhere.json: cannot be opened");
}

TEST_F(Cli, unwritableOutputsFailBeforeTheBake) {
  const auto to = [&](const std::string& output) { return run({"bake", room_, "-o", output}); };
  expectFailure(to(folder_.string()), 2, "Is a directory");
  expectFailure(to((folder_ / "missing" / "x.relume").string()), 2, "No such file or directory");
  expectFailure(to("/dev/full"), 2, "is not a regular file");
  expectFailure(to("/proc/x.relume"), 2, "/proc/x.relume: cannot");
  if (::geteuid() != 0) {
    fs::create_directories(folder_ / "locked");
    fs::permissions(folder_ / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    expectFailure(to((folder_ / "locked" / "x.relume").string()), 2, "Permission denied");
  }
}

TEST_F(Cli, brokenBakesAreRefusedByNameWithStatus3) {
  smallBake(this, run(bakeArguments(room_)), out_);
  const std::string good = readAll(out_);
  fs::remove(out_);
  const auto refused = [&](const std::string& bytes, int status, const std::string& message) {
    const std::string file = put("bad.relume", bytes);
    for (const char* command : {"validate", "info"}) expectFailure(run({command, file}), status, message);
    const ProgramResult json = run({"validate", file, "--json"});
    EXPECT_EQ(json.status, status);
    EXPECT_NE(json.out.find("\"valid\": false"), std::string::npos) << json.out;
  };
  refused("", 3, "empty file");
  refused(good.substr(0, 40), 3, "truncated");
  refused(good.substr(0, good.size() / 2), 3, "truncated");
  refused("not a bake at all, but long enough to hold the header of one, so it seems", 3, "header magic");
  // Whose file is not a bake by its name meant a level, and learns what levels are.
  expectFailure(run({"info", put("level.blend", "BLENDER-v304, an editor's own file")}), 3,
                "levels are read as .glb or .gltf");
  EXPECT_EQ(run({"info", put("bad.relume", "BLENDER-v304")}).err.find(".gltf"), std::string::npos);
  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 16);
  refused(flipped, 3, "checksum");
  std::string enormous = good;
  for (int i = 0; i < 8; ++i) enormous[64 + 24 + i] = static_cast<char>(0x7F);
  refused(enormous, 3, "chunk scalars size");
  std::string newer = good;
  newer[8] = 99;
  refused(newer, 5, "format version 99");
  expectFailure(run({"validate", (folder_ / "none.relume").string()}), 2, "No such file");
}

TEST_F(Cli, malformedScenesAreRefusedByName) {
  const auto refused = [&](const std::string& name, const std::string& text, int status, const std::string& message) {
    SCOPED_TRACE(name);
    expectFailure(run(bakeArguments(put(name, text))), status, message);
  };
  refused("empty.gltf", "", 3, "empty.gltf");
  refused("text.glb", "hello", 3, "text.glb");
  refused("deep.gltf", std::string(20000, '[') + std::string(20000, ']'), 3, "deep.gltf");
  GltfParts far;
  far.room.index[7] = 9999;
  refused("index.gltf", makeGltf(far), 3, "9999");
  GltfParts many;
  many.indexCount = 2147483646;
  refused("many.gltf", makeGltf(many), 3, "accessor");
  GltfParts wide;
  wide.byteLength = 1000000;
  refused("wide.gltf", makeGltf(wide), 3, "ufferView");
  GltfParts extension;
  extension.extraTop = "\"extensionsRequired\":[\"EXT_unheard_of\"],\"extensionsUsed\":[\"EXT_unheard_of\"],";
  refused("extension.gltf", makeGltf(extension), 5, "EXT_unheard_of");
  GltfParts nan;
  nan.room.position[3][1] = std::numeric_limits<float>::quiet_NaN();
  refused("nan.gltf", makeGltf(nan), 3, "finite");
  const std::string none = (folder_ / "none.glb").string();
  expectFailure(run(bakeArguments(none)), 2, "error: " + none + ": no such file\n");
}

TEST_F(Cli, infoPrintsFloatsInFewDigits) {
  GltfParts parts;
  for (auto& p : parts.room.position) {
    for (float& c : p) c *= 0.65f;
  }
  const std::string level = put("odd.gltf", makeGltf(parts));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"info", level}, std::vector<std::string>{"info", level, "--json"}}) {
    const std::string out = run(command).out;
    const std::size_t bounds = out.find("boundsMaxM");
    ASSERT_NE(bounds, std::string::npos) << out;
    std::size_t digits = 0;
    for (const char c : out.substr(bounds)) {
      digits = c >= '0' && c <= '9' ? digits + 1 : 0;
      ASSERT_LT(digits, 10u) << out;
    }
  }
}

TEST_F(Cli, scenesWithNothingToBakeFailByName) {
  GltfParts ignored;
  ignored.nodeExtras = "\"extras\":{\"relume\":{\"bake\":\"dynamic\"}},";
  expectFailure(run(bakeArguments(put("dynamic.gltf", makeGltf(ignored)))), 4, "has no triangle to bake");
  const std::string empty = "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{}]}";
  const std::string none = put("none.gltf", empty);
  expectFailure(run(bakeArguments(none)), 4, "has no triangle to bake");
  expectFailure(run({"bench", none}), 4, "has no triangle to");
  expectFailure(run({"bench", none, "--live"}), 4, "has no triangle to draw");
  const std::string picture = (folder_ / "black.png").string();
  for (const std::vector<std::string>& command : {std::vector<std::string>{"render", none, "--live"},
                                                  {"render", none, "--aov", "direct"},
                                                  {"reference", none},
                                                  {"preview", none}}) {
    std::vector<std::string> words = command;
    words.insert(words.end(), {"--size", "8x8", "-o", picture});
    expectFailure(run(words), 4, "has no triangle to draw");
    EXPECT_FALSE(fs::exists(picture)) << command[0];
  }
  // What moves is drawn, though nothing is baked.
  EXPECT_EQ(
      run({"reference", (folder_ / "dynamic.gltf").string(), "--size", "8x8", "--spp", "1", "-o", picture}).status, 0);
  GltfParts flat;
  for (auto& p : flat.room.position) p = {1.0f, 1.0f, 1.0f};
  const ProgramResult degenerate = run(bakeArguments(put("degenerate.gltf", makeGltf(flat))));
  EXPECT_EQ(degenerate.status, 4) << degenerate.err;
  EXPECT_NE(degenerate.err.find("relume: error: "), std::string::npos);
}

TEST_F(Cli, ctrlCCancelsAndLeavesTheOldFileAlone) {
  std::ofstream(out_) << "old";
  // Enough rays for minutes, so that the signal comes in the middle.
  Program bake(
      bakeArguments(room_, {"--rays", "1048576", "--lightmap-caches", "20000", "--progress", "plain", "--force"}),
      folder_);
  ASSERT_TRUE(bake.waitForStderr("links"));
  bake.send(SIGINT);
  const ProgramResult result = bake.wait();
  EXPECT_EQ(result.status, 130) << result.err;
  EXPECT_NE(result.err.find("cancelled"), std::string::npos) << result.err;
  EXPECT_EQ(readAll(out_), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "out"), fs::directory_iterator{}), 1);
}

// As when a terminal is closed, which sends the signal twice; not behind nohup, nor Ctrl-C behind a shell's &.
TEST_F(Cli, aClosedTerminalCancelsUnlessThatIsIgnored) {
  Program bake(bakeArguments(room_, {"--rays", "1048576", "--lightmap-caches", "20000"}), folder_);
  ASSERT_TRUE(bake.waitForHandler(SIGTERM)) << "the last of the signals";
  bake.send(SIGHUP);
  bake.send(SIGHUP);
  const ProgramResult result = bake.wait();
  EXPECT_EQ(result.status, 130) << result.err;
  EXPECT_NE(result.err.find("cancelled"), std::string::npos) << result.err;
  EXPECT_TRUE(fs::is_empty(folder_ / "out"));
  Program ignoring(bakeArguments(room_), folder_, [] {
    ::signal(SIGHUP, SIG_IGN);
    ::signal(SIGINT, SIG_IGN);
  });
  ASSERT_TRUE(ignoring.waitForHandler(SIGTERM));
  ignoring.send(SIGHUP);
  ignoring.send(SIGINT);
  const ProgramResult whole = ignoring.wait();
  EXPECT_EQ(whole.status, 0) << whole.err;
}

TEST_F(Cli, killedBakesLeaveTheOldFileAndTheNextRunCleansUp) {
  std::ofstream(out_) << "old";
  std::ofstream(out_ + ".4242-0.tmp") << "left by a killed run";
  Program bake(
      bakeArguments(room_, {"--rays", "1048576", "--lightmap-caches", "20000", "--progress", "plain", "--force"}),
      folder_);
  ASSERT_TRUE(bake.waitForStderr("links"));
  bake.send(SIGKILL);
  EXPECT_EQ(bake.wait().status, 128 + SIGKILL);
  EXPECT_EQ(readAll(out_), "old");
  EXPECT_EQ(run(bakeArguments(room_, {"--force"})).status, 0);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "out"), fs::directory_iterator{}), 1);
}

TEST_F(Cli, awayFromATerminalEachLongStageIsOneLine) {
  const ProgramResult result = run(bakeArguments(room_, {"--rays", "4096", "--lightmap-caches", "4000"}));
  EXPECT_EQ(result.status, 0) << result.err;
  std::map<std::string, int> lines;
  for (std::size_t at = 0; at < result.err.size();) {
    const std::size_t end = result.err.find('\n', at), done = result.err.find(": done in ", at);
    if (done < end) {
      ++lines[result.err.substr(at, done - at)];
      EXPECT_GE(std::stod(result.err.substr(done + 10)), 0.1) << result.err;
    }
    EXPECT_EQ(result.err.substr(at, end - at).find(" 40 %"), std::string::npos) << result.err;
    at = end + 1;
  }
  EXPECT_EQ(lines["relume: links"], 1) << result.err;
  for (const auto& [stage, count] : lines) EXPECT_EQ(count, 1) << stage;
}

TEST_F(Cli, progressAsJsonLinesIsJson) {
  const ProgramResult result = run(bakeArguments(room_, {"--progress", "json"}));
  EXPECT_EQ(result.status, 0) << result.err;
  std::size_t lines = 0;
  for (std::size_t at = 0; at < result.err.size(); ++lines) {
    const std::size_t end = result.err.find('\n', at);
    ASSERT_NE(end, std::string::npos);
    EXPECT_EQ(result.err[at], '{') << result.err.substr(at, end - at);
    EXPECT_EQ(result.err[end - 1], '}');
    at = end + 1;
  }
  EXPECT_GT(lines, 6u);
  EXPECT_NE(result.err.find("\"overall\":1.0"), std::string::npos) << result.err;
  EXPECT_EQ(run(bakeArguments(room_, {"--force", "--progress", "none"})).err, "");
}

}  // namespace
}  // namespace relume
