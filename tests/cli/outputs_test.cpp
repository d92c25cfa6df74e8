// SPDX-License-Identifier: MIT
// What commands write over, and what becomes of what they print: no input, no other output, nothing of another kind is
// lost; a standard output that takes nothing is an error.
#include "tests/cli/cli_fixture.h"

#include <sys/stat.h>

namespace relume {
namespace {

namespace fs = std::filesystem;

class Outputs : public CliFixture {
 protected:
  // The program by a shell, in the folder; `more` is redirections.
  ProgramResult shell(const std::string& arguments, const std::string& more) {
    ProgramResult result;
    const std::string command =
        "cd '" + folder_.string() + "' && '" RELUME_BINARY "' " + arguments + " 2>err.txt " + more;
    const int status = std::system(command.c_str());
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.err = readAll(at("err.txt"));
    return result;
  }
  void expectRefused(const std::vector<std::string>& arguments, const std::string& message, int status = 1) {
    const std::string scene = readAll(room_);
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.status, status) << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << "expected: " << message << "\nfound: " << result.err;
    EXPECT_EQ(readAll(room_), scene) << "the level was written over";
    EXPECT_EQ(result.err.find("surfels"), std::string::npos) << "found out only after work";
  }
  std::vector<std::string> render(const std::string& output, std::vector<std::string> more = {}) const {
    std::vector<std::string> list = {"render", room_, "--aov", "direct", "--size", "8x8", "-o", output};
    list.insert(list.end(), more.begin(), more.end());
    return list;
  }
};

TEST_F(Outputs, bakesRefuseToWriteOverWhatTheyRead) {
  const std::string options = put("options.json", "{}");
  fs::create_symlink("room.gltf", at("link.gltf"));
  fs::create_hard_link(room_, at("hard.gltf"));
  expectRefused(bakeArguments(room_, room_), "-o: \"" + room_ + "\" is the scene and would be written over");
  for (const char* other : {"link.gltf", "hard.gltf", "out/../room.gltf", "./room.gltf"})
    expectRefused(bakeArguments(room_, at(other), {"--force"}), "is the scene, \"" + room_ + "\",");
  expectRefused(bakeArguments(at("link.gltf"), room_), "is the scene");
  expectRefused(bakeArguments(room_, out_, {"--report", room_}), "--report: \"" + room_ + "\" is the scene");
  expectRefused(bakeArguments(room_, out_, {"--depfile", room_}), "--depfile: ");
  expectRefused(bakeArguments(room_, options, {"--options", options}), "is the file of --options");
}

TEST_F(Outputs, filesThatASceneNamesAreSafe) {
  std::string scene = makeGltf({});
  const std::size_t begin = scene.find("\"uri\":\"data:") + 7, end = scene.find('"', begin);
  const std::string uri = scene.substr(begin, end - begin), comma = "base64,";
  std::ofstream(at("encoded.txt")) << uri.substr(uri.find(comma) + comma.size());
  ASSERT_EQ(std::system(("base64 -d <'" + at("encoded.txt") + "' >'" + at("room.bin") + "'").c_str()), 0);
  scene.replace(begin, end - begin, "room.bin");
  const std::string level = put("external.gltf", scene), bytes = readAll(at("room.bin"));
  fs::create_symlink("room.bin", at("link.relume"));
  for (const std::string& output : {at("room.bin"), at("link.relume")}) {
    const ProgramResult result = run(bakeArguments(level, output, {"--force"}));
    EXPECT_EQ(result.status, 1) << result.err;
    EXPECT_NE(result.err.find("is a file of the scene"), std::string::npos) << result.err;
    EXPECT_EQ(readAll(at("room.bin")), bytes);
  }
  bake(level, at("a.relume"));
  bake(level, at("b.relume"), {"--seed", "2"});
  const ProgramResult page = run({"compare", at("a.relume"), at("b.relume"), "--scene", level, "--html", at("room.bin"),
                                  "--force", "--progress", "none"});
  EXPECT_EQ(page.status, 1) << page.err;
  EXPECT_NE(page.err.find("--html: \"" + at("room.bin") + "\" is a file of the scene"), std::string::npos) << page.err;
  EXPECT_EQ(readAll(at("room.bin")), bytes);
}

TEST_F(Outputs, outputsOfOneCommandAreApart) {
  expectRefused(bakeArguments(room_, out_, {"--report", out_}), "--report: \"" + out_ + "\" is what -o writes");
  expectRefused(bakeArguments(room_, out_, {"--depfile", at("out/../out/room.relume")}), "is what -o writes");
  fs::create_symlink("out/room.relume", at("dangling.json"));
  expectRefused(bakeArguments(room_, out_, {"--report", at("dangling.json")}), "is what -o writes");
  expectRefused(bakeArguments(room_, out_, {"--report", at("same.json"), "--depfile", at("same.json")}),
                "is what --report writes");
  EXPECT_EQ(filesIn(folder_ / "out"), 0u);
}

TEST_F(Outputs, filesOfAnotherKindAskForForce) {
  const std::string notes = put("notes.txt", "years of work");
  expectRefused(bakeArguments(room_, notes), "exists and is not a bake; choose another name, or --force");
  expectRefused(bakeArguments(room_, out_, {"--report", notes}), "is not a report of relume bake");
  expectRefused(bakeArguments(room_, out_, {"--depfile", notes}), "is not a depfile");
  EXPECT_EQ(readAll(notes), "years of work");
  const std::string picture = put("picture.png", "not a picture");
  expectRefused(render(picture), "is not a PNG image");
  expectRefused({"reference", room_, "-o", put("truth.exr", "x"), "--size", "8x8"}, "is not an OpenEXR image");
  bake(room_, notes, {"--force"});
  EXPECT_EQ(run({"validate", notes}).status, 0);

  // Of its own kind, or empty: as often as one likes.
  put("empty.relume", "");
  bake(room_, at("empty.relume"));
  for (int i = 0; i < 2; ++i) {
    bake(room_, at("empty.relume"), {"--seed", std::to_string(i), "--report", at("r.json"), "--depfile", at("r.d")});
    EXPECT_EQ(run(render(at("p.png"))).status, 0);
    EXPECT_EQ(run(render(at("p.exr"))).status, 0);
    const ProgramResult page =
        run({"compare", notes, at("empty.relume"), "--html", at("page.html"), "--progress", "none"});
    EXPECT_EQ(page.status, 0) << page.err;
  }
  const ProgramResult forced = run(render(picture, {"--force"}));
  EXPECT_EQ(forced.status, 0) << forced.err;
}

// A Makefile may begin as a depfile does.
TEST_F(Outputs, onlyWholeDepfilesAreWrittenOver) {
  const std::string depfile = at("room.d"), options = put("my=options.json", "{\"seed\": 3}");
  bake(room_, out_, {"--depfile", depfile, "--options", options});
  const std::string written = readAll(depfile);
  ASSERT_NE(written.find(room_ + ":\n"), std::string::npos) << written;
  const std::string makefiles[] = {"out/room.relume: \\\n  room.gltf\n\tbake room.gltf\n",
                                   "all: \\\n  room.gltf\n\nroom.gltf:\n\nclean:\n\trm -f out/room.relume\n",
                                   "all: \\\n  room.gltf\n\nroom.gltf:\n\tmake_room\n",
                                   "all: \\\n  a.c \\\n",
                                   written + "clean:\n",
                                   written + written};
  for (const std::string& makefile : makefiles) {
    const std::string path = put("Makefile", makefile);
    expectRefused(bakeArguments(room_, out_, {"--depfile", path, "--options", options}), "is not a depfile");
    EXPECT_EQ(readAll(path), makefile);
  }
  bake(room_, out_, {"--depfile", depfile, "--options", options});
  EXPECT_EQ(readAll(depfile), written);
}

TEST_F(Outputs, filesThatCannotBeReadAreNamed) {
  put("mine.relume", "a bake, perhaps");
  fs::permissions(at("mine.relume"), fs::perms::none);
  const ProgramResult output = runAsUser(bakeArguments(room_, at("mine.relume")));
  fs::permissions(room_, fs::perms::none);
  const ProgramResult level = runAsUser(bakeArguments(room_, out_));
  if (output.status == kNotDropped) GTEST_SKIP() << "root stays root here";
  EXPECT_EQ(output.status, 2) << output.err;
  EXPECT_NE(output.err.find("mine.relume\": exists and cannot be read: Permission denied"), std::string::npos)
      << output.err;
  EXPECT_EQ(level.status, 2) << level.err;
  EXPECT_NE(level.err.find(room_ + ": cannot be read: Permission denied"), std::string::npos) << level.err;
}

// The folder of what is up to date may be read-only; else that is found out before the bake.
TEST_F(Outputs, whatIsUpToDateMayStandInAReadOnlyFolder) {
  bake(room_, out_);
  const std::vector<std::string> plan = {"bake", room_, "--plan", at("out/plan.relume"), "--preset", "draft"},
                                 shard = {"bake", room_, "--plan", plan[3], "--shard", "1/2", "-o", at("out/1.relume")};
  ASSERT_EQ(run(plan).status, 0);
  ASSERT_EQ(run(shard).status, 0);
  fs::permissions(folder_ / "out", fs::perms(0555));
  for (const auto& command : {bakeArguments(room_, out_), plan, shard}) {
    const ProgramResult there = runAsUser(command);
    std::vector<std::string> forced = command;
    forced.push_back("--force");
    const ProgramResult again = runAsUser(forced);
    if (there.status == kNotDropped) break;
    EXPECT_EQ(there.status, 0) << there.err;
    EXPECT_NE(there.out.find("up to date"), std::string::npos) << there.out;
    EXPECT_EQ(again.status, 2) << again.err;
    EXPECT_NE(again.err.find("ermission denied"), std::string::npos) << again.err;
  }
  const ProgramResult other = runAsUser(bakeArguments(room_, out_, {"--seed", "2"}));
  fs::permissions(folder_ / "out", fs::perms(0755));
  if (other.status == kNotDropped) GTEST_SKIP() << "root stays root here";
  EXPECT_EQ(other.status, 2) << other.err;
  EXPECT_NE(other.err.find("cannot create a file in its folder: Permission denied"), std::string::npos) << other.err;
  EXPECT_EQ(other.err.find("surfels"), std::string::npos) << "found out only after work: " << other.err;
}

// Version control takes the permission to write from what is locked or not checked out; a rename does not ask for it.
TEST_F(Outputs, readOnlyFilesAskForForce) {
  const std::string report = at("r.json"), picture = at("p.png"), plan = at("plan.relume");
  const std::vector<std::string> planned = {"bake", room_, "--plan", plan, "--preset", "draft"};
  bake(room_, out_, {"--report", report});
  ASSERT_EQ(run(render(picture)).status, 0);
  ASSERT_EQ(run(planned).status, 0);
  for (const std::string& file : {out_, report, picture, plan}) fs::permissions(file, fs::perms(0444));
  fs::create_symlink("out/room.relume", at("link.relume"));
  const auto expectLocked = [&](std::vector<std::string> command, const std::string& file) {
    const std::string before = readAll(file);
    // By root as well where the tests are root's, whom no permission stops.
    for (const ProgramResult& result : {run(command), runAsUser(command)}) {
      if (result.status == kNotDropped) continue;
      EXPECT_EQ(result.status, 1) << result.out << result.err;
      EXPECT_NE(result.err.find("exists and is read-only"), std::string::npos) << result.err;
      EXPECT_NE(result.err.find("version control"), std::string::npos) << result.err;
      EXPECT_TRUE(readAll(file) == before) << file << " was written over";
    }
    command.push_back("--force");
    EXPECT_EQ(run(command).status, 0);
    EXPECT_EQ(fs::status(file).permissions(), fs::perms(0444));
  };
  const ProgramResult there = run(bakeArguments(room_, out_));
  EXPECT_EQ(there.status, 0) << "up to date: " << there.err;
  expectLocked(bakeArguments(room_, out_, {"--report", report}), report);  // with a bake that is up to date
  expectLocked(bakeArguments(room_, out_, {"--seed", "2"}), out_);
  expectLocked(bakeArguments(room_, at("link.relume"), {"--seed", "3"}), out_);
  expectLocked(render(picture), picture);
  expectLocked({"bake", room_, "--plan", plan, "--preset", "draft", "--seed", "2"}, plan);
}

// Where nothing is there yet, and where a file is empty or of the kind that is made, the name still says what it is
// not.
TEST_F(Outputs, namesOfOtherKindsAreRefused) {
  for (const char* name : {"x.png", "x.PNG", "x.glb", "x.gltf", "x.exr", "x.json", "x.relume.gz"}) {
    expectRefused(bakeArguments(room_, at(name)), "is to be a bake, and its name ends in .");
    expectRefused(bakeArguments(room_, at(name), {"--force"}), "one that ends in .relume expected");
    EXPECT_FALSE(fs::exists(at(name))) << name;
  }
  expectRefused(bakeArguments(room_, out_, {"--report", at("r.relume")}), "one that ends in .json expected");
  expectRefused(bakeArguments(room_, out_, {"--depfile", at("d.json")}), "one that ends in .d expected");
  expectRefused(bakeArguments(room_, out_, {"--export-glb", at("level.gltf")}), "one that ends in .glb expected");
  expectRefused({"bake", room_, "--plan", at("plan.png")}, "one that ends in .relume expected");
  for (const char* name : {"no_extension", "x.bake", "v1.2"}) {
    bake(room_, at(name));
    EXPECT_EQ(run({"validate", at(name)}).status, 0) << name;
  }
  bake(room_, out_);
  expectRefused({"export", room_, out_, "-o", at("level.png")}, "one that ends in .glb expected");
  expectRefused({"pack", out_, "-o", at("packed.png")}, "one that ends in .relume expected");
  expectRefused({"merge", out_, out_, "-o", at("merged.html")}, "one that ends in .relume expected");
  expectRefused({"compare", out_, out_, "--html", at("page.png")}, "one that ends in .html expected");
  expectRefused({"bench", "--bake", out_, "--markdown", at("page.html")}, "one that ends in .md expected");
  // Endings in upper case are the same.
  for (const std::string name : {"x.PNG", "x.Exr"}) {
    EXPECT_EQ(run(render(at(name))).status, 0) << name;
    const ProgramResult truth = run({"reference", room_, "-o", at("truth_" + name), "--size", "8x8", "--spp", "1"});
    EXPECT_EQ(truth.status, 0) << truth.err;
    EXPECT_TRUE(readAll(at("truth_" + name)).starts_with(name == "x.PNG" ? "\x89PNG" : "\x76\x2f\x31\x01")) << name;
  }
  EXPECT_EQ(run({"pack", out_, "-o", at("packed.relume.GZ")}).status, 0);
  EXPECT_TRUE(readAll(at("packed.relume.GZ")).starts_with("\x1f\x8b"));
}

TEST_F(Outputs, otherCommandsRefuseTheirInputs) {
  bake(room_, out_);
  const std::string bytes = readAll(out_);
  fs::create_symlink(out_, at("page.html"));
  expectRefused({"compare", out_, out_, "--html", at("page.html"), "--force"}, "--html: ");
  expectRefused({"compare", out_, out_, "--html", at("r.json"), "--report-a", at("r.json")},
                "is the file of --report-a");
  fs::create_symlink(out_, at("image.exr"));
  expectRefused({"render", room_, "--bake", out_, "--size", "8x8", "-o", at("image.exr"), "--force"}, "is the bake");
  expectRefused(render(at("lights.png"), {"--lights-file", at("lights.png")}), "is the file of --lights-file");
  fs::create_symlink(room_, at("full.exr"));
  expectRefused({"reference", room_, "-o", at("full.exr"), "--size", "8x8", "--force"}, "is the scene");
  fs::create_symlink(room_, at("frame.normal.exr"));
  expectRefused({"render", room_, "--aov", "direct,normal", "--size", "8x8", "-o", at("frame.exr")}, "is the scene");
  expectRefused({"bench", "--bake", out_, "--markdown", out_, "--force"}, "--markdown: ");
  EXPECT_EQ(readAll(out_), bytes);
}

TEST_F(Outputs, linksStayAndTheirTargetsAreReplaced) {
  bake(room_, at("real.relume"));
  const std::string before = readAll(at("real.relume"));
  fs::create_symlink("../real.relume", out_);
  bake(room_, out_, {"--seed", "2"});
  EXPECT_TRUE(fs::is_symlink(out_));
  EXPECT_NE(readAll(at("real.relume")), before);
  EXPECT_EQ(filesIn(folder_ / "out"), 1u);
  put("real.png", "");
  fs::create_symlink("real.png", at("p.png"));
  EXPECT_EQ(run(render(at("p.png"))).status, 0);
  EXPECT_TRUE(fs::is_symlink(at("p.png")));
  EXPECT_EQ(readAll(at("real.png")).substr(1, 3), "PNG");
}

TEST_F(Outputs, specialFilesAreRefusedByName) {
  ASSERT_EQ(::mkfifo(at("pipe.png").c_str(), 0600), 0);
  for (const std::string& special : {at("pipe.png"), std::string("/dev/null")})
    expectRefused(bakeArguments(room_, special, {"--force"}), special + ": is not a regular file", 2);
  expectRefused(render(at("pipe.png")), "is not a regular file", 2);
  struct stat status {};
  ASSERT_EQ(::stat(at("pipe.png").c_str(), &status), 0);
  EXPECT_TRUE(S_ISFIFO(status.st_mode)) << "the pipe was renamed over";

  expectRefused(bakeArguments(room_, "-"), "-o: a file's name expected", 1);

  const std::string toStdout = "bake room.gltf -o /dev/stdout --preset draft";
  const ProgramResult file = shell(toStdout, ">printed.txt"), pipe = shell(toStdout, "| cat >printed.txt; exit 2");
  EXPECT_EQ(file.status, 2) << file.err;
  EXPECT_NE(file.err.find("standard output"), std::string::npos) << file.err;
  EXPECT_EQ(pipe.status, 2) << pipe.err;
  const ProgramResult itself = shell("bake room.gltf -o itself.relume --preset draft", ">itself.relume");
  EXPECT_EQ(itself.status, 2) << itself.err;
  const ProgramResult descriptor = shell("bake room.gltf -o /dev/fd/5 --preset draft", "5>five.txt");
  EXPECT_EQ(descriptor.status, 2) << descriptor.err;
  EXPECT_NE(descriptor.err.find("open file of a process"), std::string::npos) << descriptor.err;
}

TEST_F(Outputs, fileSystemsWithoutLocksAreWrittenTo) {
  if (std::string(RELUME_SANITIZE) != "") GTEST_SKIP() << "built with " RELUME_SANITIZE ", which is to be loaded first";
  put("out/room.relume.4242-0.tmp", "of a neighbour, perhaps");
  const std::string old = put("out/room.relume.4242-1.tmp", "forgotten");
  fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(25));
  const ProgramResult result = runProgram(bakeArguments(room_, out_, {"--report", at("report.json")}), folder_,
                                          [] { ::setenv("LD_PRELOAD", RELUME_NO_FLOCK, 1); });
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(run({"validate", out_}).status, 0);
  const std::size_t told = result.err.find("has no locks");
  EXPECT_NE(told, std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("has no locks", told + 1), std::string::npos) << "said twice: " << result.err;
  EXPECT_EQ(filesIn(folder_ / "out"), 2u) << "the bake, and what a neighbour may be writing";
  EXPECT_FALSE(fs::exists(old));
}

TEST_F(Outputs, aStandardOutputThatTakesNothingIsAnError) {
  bake(room_, out_);
  const std::string other = at("other.relume");
  bake(room_, other, {"--seed", "2"});
  const std::string differing = "compare out/room.relume other.relume --progress none --max-rmse 0";
  for (const std::string& command :
       {std::string("--help"), std::string("--version"), std::string("info room.gltf"),
        std::string("info out/room.relume"), std::string("info out/room.relume --json"),
        std::string("validate out/room.relume"), std::string("validate --json out/room.relume"),
        std::string("validate --json room.gltf"), std::string("status room.gltf out/room.relume"),
        std::string("status room.gltf out/room.relume --json"), std::string("compare out/room.relume other.relume"),
        std::string("compare out/room.relume out/room.relume --json"), differing, std::string("bake --print-options"),
        std::string("bake --help"),
        std::string("bench --bake out/room.relume --backend cpu --repeat 1 --progress none"),
        std::string("render room.gltf --aov direct --size 8x8 --json -o p.png")}) {
    for (const char* where : {">/dev/full", ">&-"}) {
      const ProgramResult result = shell(command, where);
      EXPECT_EQ(result.status, 2) << command << " " << where << "\n" << result.err;
      EXPECT_NE(result.err.find("standard output cannot be written"), std::string::npos) << command << "\n"
                                                                                         << result.err;
    }
  }
  // Nothing was printed into the files that were opened instead of what was closed.
  EXPECT_EQ(
      shell("bake room.gltf -o third.relume --preset draft --surfels 256 --links 32 --rays 64", "1>&- 0<&-").status, 2);
  EXPECT_EQ(run({"validate", at("third.relume")}).status, 0);
  EXPECT_EQ(shell("validate third.relume", ">printed.txt 0<&-").status, 0);
}

TEST_F(Outputs, namesDoNotReachTheTerminalAsCommands) {
  // An escape sequence, C1 and a mark that turns writing round, as JSON has them; a line end with a false message.
  const std::string evil = "a\\u001b[31mb\\u009b2Jc\\u202ed\\u007fe\\nrelume: error: false";
  const std::string shown = "a\\x1b[31mb\\u009b2Jc\\u202ed\\x7fe\\nrelume: error: false";
  GltfParts parts;
  parts.room.index.insert(parts.room.index.end(), {0, 1, 2, 5, 5, 6});
  std::string text = makeGltf(parts);
  text.replace(text.find("\"Room\""), 6, "\"" + evil + "\"");
  const std::string level = put("evil.gltf", text);
  const auto expectClean = [&](const ProgramResult& result, bool named) {
    const std::string all = result.out + result.err;
    for (const char* raw : {"\x1b", "\xc2\x9b", "\xe2\x80\xae", "\x7f", "\nrelume: error: false"})
      EXPECT_EQ(all.find(raw), std::string::npos) << all;
    EXPECT_TRUE(!named || all.find(shown) != std::string::npos) << all;
  };
  expectClean(run({"info", level}), true);
  const ProgramResult json = run({"info", level, "--json"});
  expectClean(json, false);
  EXPECT_NE(json.out.find(evil), std::string::npos) << "JSON keeps the name, escaped: " << json.out;
  expectClean(run(bakeArguments(level, out_)), true);
  expectClean(run(bakeArguments(level, at("j.relume"), {"--progress", "json"})), false);
  expectClean(run({"info", out_}), false);
  bake(room_, at("plain.relume"));
  expectClean(run({"status", room_, out_}), true);
  expectClean(run({"status", level, at("plain.relume")}), true);
  expectClean(run({"compare", out_, at("plain.relume"), "--progress", "none"}), true);
  expectClean(run({"render", level, "--bake", at("plain.relume"), "--size", "8x8", "-o", at("p.png")}), true);
  expectClean(run({"info", at("no\x1b[31m.gltf")}), false);
  std::string names(1, '\x9b');
  expectClean(run({"bake", names}), false);
}

// A collection goes on past what this user may not remove, and ends as one that could not write where the limit is
// missed by that.
TEST_F(Outputs, collectionsSayWhatTheyMayNotRemove) {
  const fs::path store = folder_ / "store";
  bake(room_, out_, {"--store", store.string()});
  const fs::path closed = *fs::directory_iterator(store);
  fs::permissions(closed, fs::perms(0555));
  const ProgramResult gc = runAsUser({"store", "gc", store.string(), "--limit", "0"});
  const ProgramResult held = runAsUser({"store", "gc", store.string(), "--limit", "1G"});
  fs::permissions(closed, fs::perms(0755));
  if (gc.status == kNotDropped) GTEST_SKIP() << "root cannot become a user";
  EXPECT_EQ(gc.status, 2) << gc.err;
  EXPECT_NE(gc.out.find("store: 1 entries ("), std::string::npos) << gc.out;
  EXPECT_NE(gc.out.find(", 1 may not be removed\n"), std::string::npos) << gc.out;
  EXPECT_NE(gc.err.find(" more than the limit; entries that may not be removed: 1; the first: " + closed.string()),
            std::string::npos)
      << gc.err;
  EXPECT_EQ(held.status, 0) << held.err;
}

}  // namespace
}  // namespace relume
