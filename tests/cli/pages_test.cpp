// SPDX-License-Identifier: MIT
// Completion scripts complete, manual pages are well-formed, all say what --help says, and docs/reference is current.
#include "tests/cli/cli_fixture.h"

#include <algorithm>
#include <sstream>

namespace relume {
namespace {

namespace fs = std::filesystem;

class Pages : public CliFixture {
 protected:
  void SetUp() override {
    CliFixture::SetUp();
    const ProgramResult result = run({"pages", at("pages")});
    ASSERT_EQ(result.status, 0) << result.err;
    std::string out;
    if (hasViewer()) {
      ASSERT_EQ(shell(std::string("'") + RELUME_VIEW + "' --pages pages", out), 0) << out;
    }
  }

  static bool hasViewer() { return RELUME_VIEW[0] != '\0'; }

  std::string page(const std::string& name) const { return readAll(folder_ / "pages" / name); }

  // Exit status of a shell's line, its output in `out`.
  int shell(const std::string& line, std::string& out) const {
    const std::string file = at("shell.txt");
    const int status = std::system(("cd '" + folder_.string() + "' && { " + line + "\n} > " + file + " 2>&1").c_str());
    out = readAll(file);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  bool has(const std::string& program) const {
    std::string ignored;
    return shell("command -v " + program, ignored) == 0;
  }

  // What bash offers for these words, the last of which is being written; sorted.
  std::vector<std::string> complete(const std::vector<std::string>& words) {
    std::string function = "_" + words[0], script = "source pages/completion/bash/" + words[0] + "\nCOMP_WORDS=(";
    std::replace(function.begin(), function.end(), '-', '_');
    for (const std::string& word : words) script += "'" + word + "' ";
    script += ")\nCOMP_CWORD=" + std::to_string(words.size() - 1) + "\n" + function +
              "\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
    put("complete.sh", script);
    std::string out;
    EXPECT_EQ(shell("bash complete.sh", out), 0) << out;
    std::vector<std::string> offers;
    std::istringstream lines(out);
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty()) offers.push_back(line);
    }
    std::sort(offers.begin(), offers.end());
    return offers;
  }
};

using Words = std::vector<std::string>;

// "bake", "bench", ...: the commands that `relume --help` lists.
Words commandsOf(const std::string& help) {
  Words commands;
  std::istringstream lines(help.substr(help.find("Subcommands:")));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) {
    if (line[2] != ' ') commands.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return commands;
}

// "-o", "--output", ...: what --help lists at the beginnings of lines.
Words flagsOf(const std::string& help) {
  Words flags;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  -")) continue;
    std::istringstream names(line.substr(2, line.find(' ', 2) - 2));
    for (std::string name; std::getline(names, name, ',');) flags.push_back(name);
  }
  return flags;
}

TEST_F(Pages, bashCompletesCommandsFlagsAndValues) {
  if (!has("bash")) GTEST_SKIP() << "no bash";
  EXPECT_EQ(complete({"relume", "ba"}), (Words{"bake"}));
  EXPECT_EQ(complete({"relume", ""}), [&] {
    Words commands = commandsOf(run({"--help"}).out);
    std::sort(commands.begin(), commands.end());
    return commands;
  }());
  EXPECT_EQ(complete({"relume", "--ver"}), (Words{"--version"}));
  EXPECT_EQ(complete({"relume", "bake", "--pre"}), (Words{"--preset"}));
  EXPECT_EQ(complete({"relume", "bake", "--preset", ""}), (Words{"best", "draft", "high", "medium", "paper", "web"}));
  EXPECT_EQ(complete({"relume", "bake", "--preset", "=", "dr"}), (Words{"draft"}));
  EXPECT_EQ(complete({"relume", "bake", "--preset", "="}), (Words{"best", "draft", "high", "medium", "paper", "web"}));
  EXPECT_EQ(complete({"relume", "bake", "room.gltf", "--clustering", "a"}), (Words{"approximate"}));
  EXPECT_EQ(complete({"relume", "bake", "--surfels", ""}), Words{}) << "a number";
  EXPECT_EQ(complete({"relume", "render", "--light-unit", "p"}), (Words{"photometric"}));
  EXPECT_EQ(complete({"relume", "bench", "--preset", "draft,b"}), (Words{"draft,best"}));
  EXPECT_EQ(complete({"relume", "completion", "z"}), (Words{"zsh"}));
  EXPECT_EQ(complete({"relume", "render", "--aov", "full,b"}), (Words{"full,bounced"}));
}

TEST_F(Pages, bashCompletesFilesByWhatIsRead) {
  if (!has("bash")) GTEST_SKIP() << "no bash";
  for (const char* name : {"my level.glb", "room.relume", "room.txt"}) put(name, "");
  EXPECT_EQ(complete({"relume", "bake", "m"}), (Words{"my level.glb"}));
  EXPECT_EQ(complete({"relume", "bake", "room"}), (Words{"room.gltf"}));
  EXPECT_EQ(complete({"relume", "bake", "o"}), (Words{"out"})) << "folders lead to files";
  EXPECT_EQ(complete({"relume", "bake", "room.gltf", "-o", "room"}), (Words{"room.relume"}));
  EXPECT_EQ(complete({"relume", "validate", "--json", "room"}), (Words{"room.relume"}));
  EXPECT_EQ(complete({"relume", "bake", "--options", "room.t"}), (Words{"room.txt"}));
}

// Every value that completion offers for --aov is one that render takes.
TEST_F(Pages, completionOfAovOffersWhatRenderDraws) {
  if (!has("bash")) GTEST_SKIP() << "no bash";
  const Words offers = complete({"relume", "render", "--aov", ""});
  EXPECT_EQ(offers.size(), 12u);
  std::string all;
  for (const std::string& offer : offers) {
    if (offer != "voxels" && offer != "occlusion") all += (all.empty() ? "" : ",") + offer;
  }
  bake(room_, out_);
  const ProgramResult result = run({"render", room_, "--bake", out_, "--aov", all, "--exponent", "4", "--size", "16x16",
                                    "--samples", "1", "-o", at("aov.exr")});
  EXPECT_EQ(result.status, 0) << result.err;
  // Voxels are drawn with --live, and what cones find in them.
  const ProgramResult voxels = run({"render", room_, "--live", "--live-cells", "8", "--live-rays", "8", "--aov",
                                    "voxels,occlusion", "--size", "16x16", "--samples", "1", "-o", at("aov.exr")});
  EXPECT_EQ(voxels.status, 0) << voxels.err;
  for (const std::string& offer : offers) EXPECT_TRUE(fs::exists(at("aov." + offer + ".exr"))) << offer;
}

TEST_F(Pages, viewerHasCompletionAndAManualPage) {
  if (!hasViewer()) GTEST_SKIP() << "relume-view is not built";
  std::string help;
  ASSERT_EQ(shell(std::string("'") + RELUME_VIEW + "' --help", help), 0) << help;
  EXPECT_EQ(help.find("--pages"), std::string::npos) << "hidden";
  std::string manual = page("man/man1/relume-view.1");
  std::erase(manual, '\\');
  const Words flags = flagsOf(help);
  EXPECT_GE(flags.size(), 15u) << help;
  for (const std::string& flag : flags) {
    for (const std::string& text : {manual, page("reference/relume-view.md"), page("completion/bash/relume-view"),
                                    page("completion/zsh/_relume-view")})
      EXPECT_NE(text.find(flag), std::string::npos) << flag;
  }
  if (!has("bash")) GTEST_SKIP() << "no bash";
  for (const char* name : {"my level.glb", "room.relume", "room.txt"}) put(name, "");
  EXPECT_EQ(complete({"relume-view", "my"}), (Words{"my level.glb"}));
  EXPECT_EQ(complete({"relume-view", "room.gltf", "--bake", "room"}), (Words{"room.relume"}));
  EXPECT_EQ(complete({"relume-view", "room.gltf", "--view", "l"}), (Words{"links"}));
  EXPECT_EQ(complete({"relume-view", "room.gltf", "--overlay", "caches,s"}), (Words{"caches,surfels"}));
  EXPECT_EQ(complete({"relume-view", "room.gltf", "--head"}), (Words{"--headless"}));
}

TEST_F(Pages, completionPrintsWhatIsInstalled) {
  EXPECT_EQ(run({"completion", "bash"}).out, page("completion/bash/relume"));
  EXPECT_EQ(run({"completion", "zsh"}).out, page("completion/zsh/_relume"));
  EXPECT_EQ(run({"completion", "fish"}).out, page("completion/fish/relume.fish"));
  EXPECT_EQ(run({"completion", "csh"}).status, 1);
}

TEST_F(Pages, zshReadsItsScript) {
  if (!has("zsh")) GTEST_SKIP() << "no zsh";
  for (const auto& entry : fs::directory_iterator(folder_ / "pages/completion/zsh")) {
    std::string out;
    EXPECT_EQ(shell("zsh -n '" + entry.path().string() + "'", out), 0) << out;
    EXPECT_EQ(out, "");
  }
}

TEST_F(Pages, fishCompletes) {
  if (!has("fish")) GTEST_SKIP() << "no fish";
  std::string out;
  std::string script = "pages/completion/fish/relume.fish";
  const auto offers = [&](const std::string& words) {
    EXPECT_EQ(shell("HOME=. fish -c 'source " + script + "; complete -C \"" + words + "\"'", out), 0);
    return out;
  };
  EXPECT_TRUE(offers("relume ba").starts_with("bake\t")) << out;
  EXPECT_TRUE(offers("relume bake --preset d").starts_with("draft")) << out;
  EXPECT_TRUE(offers("relume bake --surf").starts_with("--surfels\t")) << out;
  script = "pages/completion/fish/relume-view.fish";
  if (!fs::exists(folder_ / script)) return;
  EXPECT_TRUE(offers("relume-view --light-unit p").starts_with("photometric\t")) << out;
}

TEST_F(Pages, manualPagesAreWellFormed) {
  const bool groff = has("groff"), mandoc = has("mandoc");
  if (!groff && !mandoc) GTEST_SKIP() << "neither groff nor mandoc";
  int count = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "pages/man/man1")) {
    const std::string file = "'" + entry.path().string() + "'";
    std::string out;
    if (groff) {
      EXPECT_EQ(shell("groff -man -ww -z " + file, out), 0) << file;
      EXPECT_EQ(out, "") << file;
    }
    if (mandoc) {
      EXPECT_EQ(shell("mandoc -T lint -W error " + file, out), 0) << file << out;
    }
    ++count;
  }
  EXPECT_GE(count, 10);
}

TEST_F(Pages, everyOptionOfHelpIsOnEveryPage) {
  const Words commands = commandsOf(run({"--help"}).out);
  EXPECT_GE(commands.size(), 10u);
  EXPECT_EQ(std::count(commands.begin(), commands.end(), "pages"), 0) << "hidden";
  const std::string reference = page("reference/commands.md"), bash = page("completion/bash/relume"),
                    zsh = page("completion/zsh/_relume"), fish = page("completion/fish/relume.fish");
  for (const std::string& command : commands) {
    std::string manual = page("man/man1/relume-" + command + ".1");
    std::erase(manual, '\\');
    EXPECT_NE(manual.find("relume " + command), std::string::npos) << command;
    const Words flags = flagsOf(run({command, "--help"}).out);
    EXPECT_GE(flags.size(), 2u) << command;
    for (const std::string& flag : flags) {
      EXPECT_NE(manual.find(flag), std::string::npos) << command << " " << flag;
      for (const std::string* text : {&reference, &bash, &zsh})
        EXPECT_NE(text->find(flag), std::string::npos) << command << " " << flag;
      const std::string plain = (flag.starts_with("--") ? " -l " : " -s ") + flag.substr(flag.find_first_not_of('-'));
      EXPECT_NE(fish.find("__fish_seen_subcommand_from " + command + "'"), std::string::npos);
      EXPECT_NE(fish.find(plain), std::string::npos) << command << " " << flag;
    }
  }
}

TEST_F(Pages, referenceIsCurrent) {
  for (const char* name : {"commands.md", "options.md", "relume-view.md"}) {
    if (!fs::exists(folder_ / "pages/reference" / name)) continue;  // relume-view is not built
    EXPECT_TRUE(page(std::string("reference/") + name) ==
                readAll(fs::path(RELUME_SOURCE_DIR) / "docs/reference" / name))
        << "docs/reference/" << name << " is not what the program says of itself now. To write it: cmake --build "
        << "build/release --target relume_pages && cp build/release/pages/reference/*.md docs/reference/";
  }
}

}  // namespace
}  // namespace relume
