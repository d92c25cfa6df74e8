// SPDX-License-Identifier: MIT
// relume compare as CI meets it: exit status, JSON, and the page in a browser.
#include "relume/bake_file.h"
#include "tests/cli/check_schema.h"
#include "tests/cli/cli_fixture.h"

#include <cstdlib>

namespace relume {
namespace {

using Json = nlohmann::json;

class CompareCli : public CliFixture {
 protected:
  void SetUp() override {
    CliFixture::SetUp();
    GltfParts painted;
    painted.material = "{\"name\":\"wall\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.3,0.6,0.5,1]}}";
    bake(room_, at("a.relume"), {"--report", at("a.json")});
    bake(put("painted.gltf", makeGltf(painted)), at("b.relume"));
  }

  // The room with walls that shine, its node under that name.
  void bakeShining(const std::string& node, const std::string& name) {
    GltfParts lit;
    lit.material = "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.3,0.6,0.5,1]},\"emissiveFactor\":[1,1,1]}";
    std::string level = makeGltf(lit);
    level.replace(level.find("\"Room\""), 6, "\"" + node + "\"");
    bake(put("shining.gltf", level), at(name));
  }

  // samples/ci/check_bakes.sh with the folders "levels" and "accepted"; what it says is in ci.txt.
  int checkBakes(const std::string& out, const std::string& environment = "",
                 const std::string& accepted = "accepted") {
    const std::string command = "RELUME='" RELUME_BINARY "' PRESET=draft " + environment +
                                " '" RELUME_SOURCE_DIR "/samples/ci/check_bakes.sh' '" + at("levels") + "' '" +
                                at(accepted) + "' '" + at(out) + "' >'" + at("ci.txt") + "' 2>&1";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
};

TEST_F(CompareCli, sameBytesSaySoAndExitWith0) {
  std::filesystem::copy_file(at("a.relume"), at("copy.relume"));
  const ProgramResult same =
      run({"compare", at("a.relume"), at("copy.relume"), "--max-rmse", "0", "--max-cache-change", "0"});
  EXPECT_EQ(same.status, 0) << same.err;
  EXPECT_NE(same.out.find("same bytes"), std::string::npos) << same.out;
  const ProgramResult json = run({"compare", at("a.relume"), at("copy.relume"), "--json"});
  EXPECT_TRUE(Json::parse(json.out)["same"].get<bool>());
  EXPECT_EQ(Json::parse(json.out)["verdict"]["verdict"], "no bounds");
  const ProgramResult bound = run({"compare", at("a.relume"), at("copy.relume"), "--json", "--max-rmse", "0"});
  EXPECT_EQ(Json::parse(bound.out)["verdict"]["verdict"], "within bounds");
  EXPECT_EQ(run({"compare", at("a.relume"), at("copy.relume"), "--ignore", "moon"}).status, 1);
  EXPECT_EQ(run({"compare", at("a.relume"), at("copy.relume"), "--ignore", "node:"}).status, 1);
}

// A gate whose level is misspelt is told so before the day on which a bake differs.
TEST_F(CompareCli, aSceneThatIsNoneIsToldOfSameBytesToo) {
  for (const char* other : {"a.relume", "b.relume"}) {
    const auto status = [&](const std::string& scene) {
      const ProgramResult r = run({"compare", at("a.relume"), at(other), "--scene", scene, "--progress", "none"});
      EXPECT_EQ(r.status == 0, r.err.empty()) << r.err;
      return r.status;
    };
    EXPECT_EQ(status(at("none.gltf")), 2) << other;
    EXPECT_EQ(status(put("cut.gltf", readAll(room_).substr(0, 300))), 3) << other;
    EXPECT_EQ(status(at("a.relume")), 3) << other;
  }
  EXPECT_EQ(run({"compare", at("a.relume"), at("a.relume"), "--scene", room_}).status, 0);
}

TEST_F(CompareCli, numbersOutOfRangeAreTold) {
  const std::string a = at("a.relume");
  EXPECT_EQ(run({"compare", a, a, "--max-rmse", "1e308"}).status, 0) << "more than a float holds";
  const auto refusal = [&](const std::vector<std::string>& words) {
    const ProgramResult r = run(words);
    EXPECT_EQ(r.status, 1) << r.out;
    return r.err;
  };
  for (const char* value : {"1e999", "1e-400"})
    EXPECT_NE(refusal({"compare", a, a, "--max-rmse", value})
                  .find("\"" + std::string(value) + "\" found, a number out of range"),
              std::string::npos)
        << value;
  EXPECT_NE(refusal({"store", "gc", at("out"), "--limit", "99999999999G"}).find("out of range"), std::string::npos);
  for (const char* value : {"x", "", "-1", "1x"})
    EXPECT_EQ(refusal({"compare", a, a, "--max-rmse", value}).find("out of range"), std::string::npos) << value;
}

// A list of names may be of many levels.
TEST_F(CompareCli, ignoredNodesAndEmittersThatNoBakeHasAreTold) {
  const std::string node = readBake(at("a.relume"))->instances.front().node;
  for (const char* other : {"a.relume", "b.relume"}) {
    const ProgramResult known = run({"compare", at("a.relume"), at(other), "--ignore", "node:" + node});
    EXPECT_EQ(known.err.find("neither bake"), std::string::npos) << known.err;
    const ProgramResult unknown = run({"compare", at("a.relume"), at(other), "--ignore", "node:none"});
    EXPECT_EQ(unknown.status, 0) << unknown.err;
    EXPECT_NE(unknown.err.find("--ignore: neither bake has a node \"none\""), std::string::npos) << unknown.err;
    const ProgramResult emitter = run({"compare", at("a.relume"), at(other), "--ignore", "emitter lamp,emitter 2"});
    EXPECT_EQ(emitter.status, 0) << emitter.err;
    for (const char* name : {"lamp", "2"})
      EXPECT_NE(emitter.err.find("--ignore: neither bake has a lighting \"emitter " + std::string(name) + "\""),
                std::string::npos)
          << emitter.err;
    EXPECT_EQ(run({"compare", at("a.relume"), at(other), "--ignore", "emitter "}).status, 1) << "without a name";
  }
}

// Light that A lacks is no finite share of what A has.
TEST_F(CompareCli, lightInTheDarkExceedsAnyBound) {
  bakeShining("Lamp", "lit.relume");
  const auto compare = [&](const std::string& from, const std::string& to, std::vector<std::string> more) {
    more.insert(more.begin(), {"compare", at(from), at(to), "--progress", "none"});
    return run(more);
  };
  const ProgramResult text = compare("a.relume", "lit.relume",
                                     {"--max-rmse", "1e308", "--html", at("lit.html"), "--ignore", "sky,suns,points"});
  EXPECT_EQ(text.status, 7) << text.out;
  EXPECT_NE(text.out.find(" infinite, bound 1e+308: EXCEEDED"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find(" (dark in A)"), std::string::npos) << text.out;
  EXPECT_NE(readAll(at("lit.html")).find("emitter Lamp (dark in A)</td><td>infinite</td>"), std::string::npos);
  const ProgramResult json = compare("a.relume", "lit.relume", {"--json"});
  EXPECT_EQ(json.status, 0) << "without a bound nothing can be passed";
  const Json report = Json::parse(json.out);
  std::ifstream file(RELUME_SOURCE_DIR "/docs/compare.schema.json");
  EXPECT_EQ(SchemaCheck(Json::parse(file)).check(report), std::vector<std::string>{});
  EXPECT_EQ(report["light"]["maxRmse"], 1e9);
  EXPECT_EQ(compare("a.relume", "lit.relume", {"--max-rmse", "1.5", "--ignore", "emitters"}).status, 0);
  EXPECT_EQ(compare("lit.relume", "a.relume", {"--max-rmse", "1.5"}).status, 0) << "all that A has is gone: 1";
}

TEST_F(CompareCli, namesWithCommasAreIgnoredByArgumentsOfTheirOwn) {
  bakeShining("Room,sky", "comma.relume");
  const auto ignored = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"compare", at("a.relume"), at("comma.relume"), "--json", "--progress", "none"});
    const ProgramResult result = run(more);
    EXPECT_EQ(result.err, "");
    return Json::parse(result.out)["verdict"]["ignored"];
  };
  EXPECT_EQ(ignored({"--ignore", "node:Room,sky"}), Json({"node:Room,sky"}));
  EXPECT_EQ(ignored({"--ignore", "emitter Room,sky"}), Json({"emitter Room,sky"}));
  EXPECT_EQ(ignored({"--ignore", "node:Room,suns"}), Json({"node:Room", "suns"}));
  EXPECT_EQ(ignored({"--ignore", "suns,,sky", "--ignore", "node:Room,sky"}), Json({"suns", "sky", "node:Room,sky"}));
}

TEST_F(CompareCli, boundsDecideTheExitStatus) {
  const auto status = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"compare", at("a.relume"), at("b.relume"), "--progress", "none"});
    return run(more).status;
  };
  EXPECT_EQ(status({}), 0) << "without a bound nothing can be passed";
  EXPECT_EQ(status({"--max-rmse", "0.001"}), 7);
  EXPECT_EQ(status({"--max-rmse", "1000"}), 0);
  EXPECT_EQ(status({"--max-cache-change", "0.001"}), 7);
  EXPECT_EQ(status({"--max-cache-change", "1e8"}), 0);
  EXPECT_EQ(status({"--max-rmse", "0.001", "--ignore", "sky,suns,points,emitters"}), 0);
  EXPECT_EQ(status({"--max-receiver-change", "0.001"}), 7);
  EXPECT_EQ(status({"--max-receiver-change", "1e8"}), 0);
  for (const char* bound : {"--max-rmse", "--max-cache-change", "--max-receiver-change"}) {
    for (const char* value : {"-1", "nan", "-nan", "inf", "1e999", "-0.001", "x", ""})
      EXPECT_EQ(status({bound, value}), 1) << bound << " " << value;
  }
  EXPECT_EQ(status({"--ignore", "moon"}), 1);
}

TEST_F(CompareCli, jsonFollowsTheSchemaAndNamesTheMaterial) {
  const ProgramResult result = run({"compare", at("a.relume"), at("b.relume"), "--json", "--progress", "none"});
  ASSERT_EQ(result.status, 0) << result.err;
  const Json report = Json::parse(result.out);
  std::ifstream file(RELUME_SOURCE_DIR "/docs/compare.schema.json");
  EXPECT_EQ(SchemaCheck(Json::parse(file)).check(report), std::vector<std::string>{});
  EXPECT_NE(result.out.find("material was"), std::string::npos) << report["baked"].dump(2);
  EXPECT_GT(report["light"]["maxRmse"].get<double>(), 0.01);
}

// The schema as users validate with it: python3-jsonschema resolves it without any other file.
TEST_F(CompareCli, jsonValidatesWithPythonsJsonschema) {
  if (std::system("python3 -c 'import jsonschema' >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "python3-jsonschema is not installed";
  const ProgramResult differs =
      run({"compare", at("a.relume"), at("b.relume"), "--json", "--progress", "none", "--max-receiver-change", "0.1"});
  const ProgramResult same = run({"compare", at("a.relume"), at("a.relume"), "--json"});
  const std::string script = put("check.py",
                                 "import json, sys, jsonschema\n"
                                 "schema = json.load(open(sys.argv[1]))\n"
                                 "jsonschema.Draft202012Validator.check_schema(schema)\n"
                                 "validator = jsonschema.Draft202012Validator(schema)\n"
                                 "validator.validate(json.load(open(sys.argv[2])))\n"
                                 "validator.validate(json.load(open(sys.argv[3])))\n"
                                 "broken = json.load(open(sys.argv[2]))\n"
                                 "broken['light']['worst'].append({})\n"
                                 "assert not validator.is_valid(broken)\n");
  const std::string command = "python3 '" + script + "' '" RELUME_SOURCE_DIR "/docs/compare.schema.json' '" +
                              put("differs.json", differs.out) + "' '" + put("same.json", same.out) + "' >'" +
                              at("python.txt") + "' 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << readAll(at("python.txt"));
}

TEST_F(CompareCli, brokenAndMissingBakesAreRefused) {
  const std::string broken = put("broken.relume", readAll(at("a.relume")).substr(0, 500));
  EXPECT_EQ(run({"compare", at("a.relume"), broken}).status, 3);
  EXPECT_EQ(run({"compare", at("none.relume"), at("a.relume")}).status, 2);
  EXPECT_EQ(run({"compare", at("a.relume")}).status, 1);
  for (const std::string& report : {broken, put("other.json", "{\"a\":1}"), put("text.json", "{\"stages\":\"x\"}")})
    EXPECT_EQ(run({"compare", at("a.relume"), at("b.relume"), "--report-a", report}).status, 3) << report;
  EXPECT_EQ(run({"compare", at("a.relume"), at("b.relume"), "--html", at("none/x.html")}).status, 2);
}

// samples/ci/check_bakes.sh: a level without an accepted bake, with the same one, and with one of other light.
TEST_F(CompareCli, theSampleScriptOfACiBakesValidatesAndCompares) {
  namespace fs = std::filesystem;
  for (const char* folder : {"levels", "accepted"}) fs::create_directories(at(folder));
  fs::copy_file(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", at("levels/two_rooms.glb"));
  const auto check = [&](const std::string& out) { return checkBakes(out, "MAX_RMSE=0.0001"); };
  fs::rename(at("levels/two_rooms.glb"), at("two_rooms.glb"));
  EXPECT_EQ(check("empty"), 0) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("ci.txt")).find("no levels"), std::string::npos);
  fs::copy_file(room_, at("levels/room.gltf"));
  EXPECT_EQ(check("text"), 0) << readAll(at("ci.txt"));
  EXPECT_TRUE(fs::exists(at("text/room.relume"))) << readAll(at("ci.txt"));
  fs::copy_file(at("two_rooms.glb"), at("levels/room.glb"));
  EXPECT_EQ(check("twins"), 1) << "two levels of one name";
  EXPECT_NE(readAll(at("ci.txt")).find("rename one"), std::string::npos) << readAll(at("ci.txt"));
  for (const char* file : {"room.gltf", "room.glb"}) fs::remove(at("levels") + "/" + file);
  fs::rename(at("two_rooms.glb"), at("levels/two_rooms.glb"));
  EXPECT_EQ(check("first"), 0) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("ci.txt")).find("no accepted bake"), std::string::npos);
  fs::copy_file(at("first/two_rooms.relume"), at("accepted/two_rooms.relume"));
  EXPECT_EQ(check("second"), 0) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("ci.txt")).find("up to date"), std::string::npos) << "an accepted bake saves the work";
  EXPECT_NE(readAll(at("ci.txt")).find("same bytes"), std::string::npos);
  ASSERT_EQ(run({"bake", at("levels/two_rooms.glb"), "-o", at("accepted/two_rooms.relume"), "--preset", "draft",
                 "--seed", "2", "--progress", "none"})
                .status,
            0);
  EXPECT_EQ(check("third"), 7) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("third/two_rooms.html")).find(">EXCEEDED<"), std::string::npos);
  const std::string good = readAll(at("accepted/two_rooms.relume"));
  EXPECT_EQ(check("accepted"), 1) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("ci.txt")).find("another folder than ACCEPTED"), std::string::npos) << readAll(at("ci.txt"));
  EXPECT_EQ(readAll(at("accepted/two_rooms.relume")), good);
  put("accepted/two_rooms.relume", "version https://git-lfs.github.com/spec/v1\n");
  EXPECT_EQ(check("fourth"), 3) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("ci.txt")).find("the accepted bake " + at("accepted/two_rooms.relume")), std::string::npos)
      << readAll(at("ci.txt"));
  EXPECT_FALSE(fs::exists(at("fourth/two_rooms.relume"))) << "nothing broken stays, which would outlive the repair";
}

// samples/ci/check_bakes.sh: the options of a level beside it, over the preset.
TEST_F(CompareCli, theSampleScriptTakesALevelsOptions) {
  namespace fs = std::filesystem;
  for (const char* folder : {"levels", "accepted"}) fs::create_directories(at(folder));
  fs::copy_file(room_, at("levels/room.gltf"));
  const std::string options = put("levels/room.options.json",
                                  "{\"surfels\":{\"count\":256},\"links\":{\"linksPerCache\":32},"
                                  "\"caches\":{\"lightmapCaches\":64}}");
  ASSERT_EQ(run({"bake", at("levels/room.gltf"), "-o", at("accepted/room.relume"), "--preset", "draft", "--options",
                 options, "--progress", "none"})
                .status,
            0);
  EXPECT_EQ(checkBakes("new"), 0) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("ci.txt")).find("up to date"), std::string::npos) << readAll(at("ci.txt"));
  EXPECT_NE(readAll(at("ci.txt")).find("same bytes"), std::string::npos) << readAll(at("ci.txt"));
}

// samples/ci/check_bakes.sh: what would switch the gate off, or for a level without a lamp of the list abort it.
TEST_F(CompareCli, theSampleScriptSaysWhatItHasNotCompared) {
  namespace fs = std::filesystem;
  for (const char* folder : {"levels", "accepted"}) fs::create_directories(at(folder));
  const auto said = [&](const std::string& words) { return readAll(at("ci.txt")).find(words) != std::string::npos; };
  for (const char* accepted : {"acepted", "a.relume"}) {
    EXPECT_EQ(checkBakes("new", "", accepted), 1) << accepted;
    EXPECT_TRUE(said("ACCEPTED: a folder expected, \"" + at(accepted) + "\" is none: an empty one is the first run"))
        << readAll(at("ci.txt"));
    EXPECT_FALSE(fs::exists(at("new")));
  }
  fs::copy_file(at("a.relume"), at("accepted/gone room.relume"));
  const std::string gone = "no level for the accepted bake " + at("accepted/gone room.relume");
  EXPECT_EQ(checkBakes("new"), 0);
  EXPECT_TRUE(said("no levels") && said(gone)) << readAll(at("ci.txt"));
  fs::copy_file(room_, at("levels/room.gltf"));
  ASSERT_EQ(
      run({"bake", at("levels/room.gltf"), "-o", at("accepted/room.relume"), "--preset", "draft", "--progress", "none"})
          .status,
      0);
  EXPECT_EQ(checkBakes("new", "IGNORE='emitter lamp,node:banner'"), 0) << readAll(at("ci.txt"));
  EXPECT_TRUE(said(gone) && said("neither bake has a lighting \"emitter lamp\"")) << readAll(at("ci.txt"));
  EXPECT_FALSE(said("no level for the accepted bake " + at("accepted/room.relume"))) << readAll(at("ci.txt"));
}

// What no receiver can be placed on is not judged by a bound, and reports without one say so.
TEST_F(CompareCli, bakesWithoutCoordinatesLeaveTheLightMapOut) {
  ASSERT_EQ(run({"pack", at("a.relume"), "-o", at("web.relume"), "--profile", "web"}).status, 0);
  const std::vector<std::string> words = {"compare", at("a.relume"), at("web.relume"), "--progress", "none"};
  const auto compare = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return run(more);
  };
  const ProgramResult bounded = compare({"--max-receiver-change", "0.5"});
  EXPECT_EQ(bounded.status, 1) << bounded.out;
  EXPECT_NE(bounded.err.find("--max-receiver-change: " + at("web.relume") + ": its light-map coordinates"),
            std::string::npos)
      << bounded.err;
  const ProgramResult text = compare({"--html", at("web.html"), "--max-rmse", "1e6"});
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("surfaces on the light map are not compared"), std::string::npos) << text.out;
  EXPECT_NE(readAll(at("web.html")).find("Surfaces on the light map are not compared"), std::string::npos);
  const Json report = Json::parse(compare({"--json"}).out);
  std::ifstream file(RELUME_SOURCE_DIR "/docs/compare.schema.json");
  EXPECT_EQ(SchemaCheck(Json::parse(file)).check(report), std::vector<std::string>{});
  EXPECT_EQ(report["light"]["receivers"]["lightMapLeftOut"], true);
  ASSERT_EQ(run({"pack", at("a.relume"), "-o", at("kept.relume"), "--profile", "web", "--keep-coordinates"}).status, 0);
  const ProgramResult kept =
      run({"compare", at("a.relume"), at("kept.relume"), "--max-receiver-change", "1e6", "--progress", "none"});
  EXPECT_EQ(kept.status, 0) << kept.err;
  EXPECT_EQ(kept.out.find("are not compared:"), std::string::npos) << kept.out;
}

// The page in headless Chromium: it loads without an error and every panel is laid out, also as wide as a phone.
TEST_F(CompareCli, pageOpensInABrowserWithoutErrors) {
  if (std::system("command -v chromium >/dev/null 2>&1") != 0) GTEST_SKIP() << "chromium is not installed";
  const ProgramResult written = run({"compare", at("a.relume"), at("b.relume"), "--html", at("page.html"), "--report-a",
                                     at("a.json"), "--progress", "none"});
  ASSERT_EQ(written.status, 0) << written.err;
  for (const char* width : {"1200", "390"}) {
    const std::string command =
        "timeout 600 chromium --headless --no-sandbox --disable-gpu --enable-logging=stderr "
        "--user-data-dir='" +
        at("profile") + "' --window-size=" + width + ",2000 --screenshot='" + at("page.png") + "' --dump-dom 'file://" +
        at("page.html") + "' >'" + at("dom.txt") + "' 2>'" + at("log.txt") + "'";
    const int status = std::system(command.c_str());
    const std::string log = readAll(at("log.txt"));
    ASSERT_EQ(status, 0) << log;
    EXPECT_EQ(log.find("CONSOLE"), std::string::npos) << log;
    const std::string dom = readAll(at("dom.txt"));
    for (const char* id :
         {"verdict", "plan", "maps", "histograms", "receivers", "light", "baked", "sizes", "arrays", "stages"})
      EXPECT_NE(dom.find("<section id=\"" + std::string(id) + "\">"), std::string::npos) << id;
  }
}

}  // namespace
}  // namespace relume
