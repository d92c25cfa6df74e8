// SPDX-License-Identifier: MIT
// Whether a bake is up to date: relume status, relume bake that does nothing, dependency files, --verify.
#include "tests/cli/cli_fixture.h"

#include <nlohmann/json.hpp>

namespace relume {
namespace {

namespace fs = std::filesystem;

class StatusCli : public CliFixture {};

GltfParts movedRoom() {
  GltfParts parts;
  parts.nodeExtras = "\"translation\":[0,0.25,0],";
  return parts;
}

TEST_F(StatusCli, namesWhatChanged) {
  bake(room_, out_);
  EXPECT_EQ(run({"status", room_, out_}).status, 0);
  EXPECT_NE(run({"status", room_, out_}).out.find("up to date"), std::string::npos);

  const auto changed = [&](const GltfParts& parts, const std::string& sentence) {
    const ProgramResult result = run({"status", put("now.gltf", makeGltf(parts)), out_});
    EXPECT_EQ(result.status, 7) << result.err;
    EXPECT_NE(result.out.find(sentence), std::string::npos) << result.out;
    // Nothing else is named: one line for the file, one for the change.
    EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 2) << result.out;
  };
  changed(movedRoom(), "node \"Room\" moved");
  GltfParts reshaped;
  reshaped.room.position[0][0] += 0.01f;
  changed(reshaped, "node \"Room\": geometry of mesh");
  // Positions as a morph target of their own: a weight makes the room larger.
  auto bent = nlohmann::json::parse(makeGltf({}));
  nlohmann::json& primitive = bent["meshes"][0]["primitives"][0];
  primitive["targets"] = {{{"POSITION", primitive["attributes"]["POSITION"]}}};
  for (const double weight : {0.0, 0.01}) {
    bent["nodes"][0]["weights"] = {weight};
    const ProgramResult result = run({"status", put("bent.gltf", bent.dump()), out_});
    EXPECT_EQ(result.status, weight == 0.0 ? 0 : 7) << result.err;
    EXPECT_EQ(result.out.find("node \"Room\": geometry of mesh") == std::string::npos, weight == 0.0) << result.out;
  }
  GltfParts painted;
  painted.material = "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.7,0.6,0.4,1]}}";
  changed(painted, "node \"Room\": material \"material0\" changed");
  GltfParts tuned;
  tuned.nodeExtras = "\"extras\":{\"relume\":{\"texelDensity\":2}},";
  changed(tuned, "node \"Room\": extras.relume");

  std::string camera = makeGltf({});
  camera.replace(camera.find("[2,2,3.5]"), 9, "[2,2,3.0]");
  const ProgramResult views = run({"status", put("now.gltf", camera), out_, "--json"});
  EXPECT_EQ(views.status, 7);
  EXPECT_NE(views.out.find("cameras or play volumes changed"), std::string::npos) << views.out;
  EXPECT_NE(views.out.find("\"upToDate\": false"), std::string::npos);
  EXPECT_EQ(run({"status", room_, at("none.relume")}).status, 2);
}

TEST_F(StatusCli, bakeDoesNothingWhenUpToDate) {
  bake(room_, out_);
  const std::string bytes = readAll(out_);
  const auto past = fs::file_time_type::clock::now() - std::chrono::hours(1);
  fs::last_write_time(out_, past);
  const ProgramResult again = run(bakeArguments(room_, out_, {"--report", at("report.json")}));
  EXPECT_EQ(again.status, 0) << again.err;
  EXPECT_NE(again.out.find("up to date"), std::string::npos) << again.out;
  EXPECT_EQ(again.err.find("links"), std::string::npos) << "baked all the same: " << again.err;
  EXPECT_EQ(readAll(out_), bytes);
  EXPECT_GT(fs::last_write_time(out_), past) << "a build system would ask again and again";
  const auto report = nlohmann::json::parse(readAll(at("report.json")));
  EXPECT_EQ(report["upToDate"], true);
  const auto info = nlohmann::json::parse(run({"info", "--json", out_}).out);
  EXPECT_EQ(report["surfels"], info["surfels"]["count"]);
  EXPECT_EQ(report["nodes"], info["hierarchy"]["nodes"]);
  EXPECT_EQ(report["caches"], info["caches"]["count"]);
  EXPECT_EQ(report["links"], info["links"]["count"]);
  EXPECT_NE(again.out.find("up to date, 256 surfels, "), std::string::npos) << again.out;

  const auto bakes = [&](const std::string& scene, std::vector<std::string> more, const std::string& why) {
    const ProgramResult result = run(bakeArguments(scene, out_, std::move(more)));
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_NE(result.out.find("peak memory"), std::string::npos) << result.out;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
  };
  bakes(room_, {"--force"}, "");
  EXPECT_EQ(readAll(out_), bytes);
  bakes(room_, {"--seed", "5"}, "option seed was 1, is 5");
  bakes(put("moved.gltf", makeGltf(movedRoom())), {"--seed", "5"}, "node \"Room\" moved");
  std::ofstream(out_, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  bakes(room_, {}, "baking: ");
  std::string newer = bytes;
  newer[8] = 100;
  std::ofstream(out_, std::ios::binary) << newer;
  bakes(room_, {}, "format version 100");
  EXPECT_EQ(readAll(out_), bytes);
}

TEST_F(StatusCli, aPackedBakeIsNotWhatIsBaked) {
  bake(room_, out_);
  const std::string bytes = readAll(out_), packed = at("packed.relume");
  for (const char* profile : {"lossless", "web"}) {
    ASSERT_EQ(run({"pack", out_, "-o", packed, "--profile", profile}).status, 0);
    ASSERT_NE(readAll(packed), bytes);
    const ProgramResult again = run(bakeArguments(room_, packed));
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_EQ(again.out.find("up to date"), std::string::npos) << again.out;
    EXPECT_NE(again.err.find("packed.relume\" is a packed bake (relume pack) and will be a plain one"),
              std::string::npos)
        << again.err;
    EXPECT_EQ(readAll(packed), bytes);
  }
}

TEST_F(StatusCli, depfileNamesSceneAndOptions) {
  const std::string options = put("my options.json", "{\"seed\": 3}");
  const std::string depfile = at("room.d");
  for (int round = 0; round < 2; ++round) {  // baked, then up to date
    bake(room_, out_, {"--options", options, "--depfile", depfile});
    const std::string text = readAll(depfile);
    EXPECT_EQ(text.substr(0, out_.size() + 1), out_ + ":") << text;
    EXPECT_NE(text.find("room.gltf"), std::string::npos) << text;
    EXPECT_NE(text.find("my\\ options.json"), std::string::npos) << text;
    fs::remove(depfile);
  }
}

// By the name that the level has: what a build system makes is known to it under no other.
TEST_F(StatusCli, depfileNamesFilesBesideTheLevelAsTheLevel) {
  std::string scene = readAll(room_);
  const std::size_t begin = scene.find("\"uri\":\"data:") + 7, end = scene.find('"', begin);
  const std::string uri = scene.substr(begin, end - begin), comma = "base64,";
  put("encoded.txt", uri.substr(uri.find(comma) + comma.size()));
  ASSERT_EQ(std::system(("base64 -d <'" + at("encoded.txt") + "' >'" + at("real.bin") + "'").c_str()), 0);
  fs::create_symlink("real.bin", at("room.bin"));
  put("linked.gltf", scene.replace(begin, end - begin, "room.bin"));
  for (const std::string& level : {std::string("linked.gltf"), at("linked.gltf")}) {
    const ProgramResult baked = runProgram(bakeArguments(level, "out/room.relume", {"--depfile", "room.d"}), folder_,
                                           [&] { std::filesystem::current_path(folder_); });
    ASSERT_EQ(baked.status, 0) << baked.err;
    const std::string folder = level.substr(0, level.size() - std::string("linked.gltf").size());
    const std::string first =
        "out/room.relume: \\\n  " + level + " \\\n  " + folder + "room.bin \\\n  " + folder + "real.bin\n\n";
    EXPECT_EQ(readAll(at("room.d")).substr(0, first.size()), first);
  }
}

// What Make and Ninja read is the name of the file, whatever is in it: one that is touched asks for the bake. What
// Ninja cannot read is written with a word on that, and Make reads it.
TEST_F(StatusCli, depfilesHoldOddNames) {
  for (const char* tool : {"make --version", "ninja --version"}) {
    if (std::system((std::string(tool) + " >/dev/null 2>&1").c_str()) != 0) GTEST_SKIP() << tool << " does not run";
  }
  const auto call = [&](const std::string& command) {
    const int status = std::system(("cd '" + folder_.string() + "' && " + command).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  put("Makefile", "out/room.relume:\n\ttouch $@\ninclude room.d\n");
  put("build.ninja",
      "rule bake\n  command = cp room.d copy.d && touch out/room.relume\n  depfile = copy.d\n  deps = gcc\n"
      "build out/room.relume: bake\n");
  constexpr struct {
    const char* name;
    bool byMake, byNinja;
  } kOdd[] = {{"a b.json", true, true},  {"c:d.json", true, true},  {"e#f.json", true, true},
              {"g$h.json", true, true},  {"i\\j.json", true, true}, {"k\\ l.json", true, true},
              {"m%n.json", true, true},  {"o=p.json", true, true},  {"q (r)", false, true},
              {"s*t.json", true, false}, {"u?v.json", true, false}, {"w&x.json", true, false},
              {"y'z.json", true, false}};
  for (const auto& [name, byMake, byNinja] : kOdd) {
    const std::string options = put(name, "{\"seed\": 3}");
    const ProgramResult baked =
        runProgram(bakeArguments("room.gltf", "out/room.relume", {"--force", "--options", name, "--depfile", "room.d"}),
                   folder_, [&] { std::filesystem::current_path(folder_); });
    ASSERT_EQ(baked.status, 0) << baked.err;
    const bool isUpToDate = call("make -q out/room.relume >make.txt 2>&1") == 0;
    fs::last_write_time(options, fs::last_write_time(out_) + std::chrono::seconds(10));
    EXPECT_EQ(isUpToDate && call("make -q out/room.relume >make.txt 2>&1") == 1, byMake)
        << name << ": " << readAll(at("make.txt"));
    for (const char* log : {".ninja_deps", ".ninja_log"}) fs::remove(at(log));
    call("ninja out/room.relume >ninja.txt 2>&1; ninja -t deps >ninja.txt");
    EXPECT_EQ(readAll(at("ninja.txt")).find("\n    " + std::string(name) + "\n") != std::string::npos, byNinja)
        << name << ": " << readAll(at("ninja.txt"));
    EXPECT_EQ(baked.err.find("which Ninja cannot read from a depfile") == std::string::npos, byNinja) << baked.err;
    EXPECT_EQ(baked.err.find("which Make cannot read from a depfile") == std::string::npos, byMake) << baked.err;
  }
  const ProgramResult target = run(bakeArguments(room_, at("r=s.relume"), {"--depfile", at("room.d")}));
  EXPECT_EQ(target.status, 0) << target.err;
  EXPECT_NE(target.err.find("a \"=\" in the name, which Make cannot read"), std::string::npos) << target.err;
}

TEST_F(StatusCli, depfilesOfNamesThatNobodyCanReadAreRefused) {
  for (const char* name : {"a;b.json", "c|d.json", "e\nf.json", "j\\", "k&"}) {
    const std::string options = put(name, "{\"seed\": 3}");
    const ProgramResult result = run(bakeArguments(room_, out_, {"--options", options, "--depfile", at("room.d")}));
    EXPECT_EQ(result.status, 1) << name;
    EXPECT_NE(result.err.find("--depfile: "), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("which Make and Ninja cannot read"), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(at("room.d")));
    EXPECT_FALSE(fs::exists(out_));
    EXPECT_EQ(run(bakeArguments(room_, out_, {"--options", options})).status, 0) << "without a depfile";
    fs::remove(out_);
  }
}

TEST_F(StatusCli, verifyBakesTwice) {
  const ProgramResult result = run(bakeArguments(room_, out_, {"--verify", "--progress", "json"}));
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_NE(result.out.find("verified"), std::string::npos) << result.out;
  EXPECT_NE(result.err.find("verify: links"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace relume
