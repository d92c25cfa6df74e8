// SPDX-License-Identifier: MIT
// What holds for options of all commands: names that are empty, options given again, values that are wrong, and what a
// program reads that asks for JSON lines.
#include "tests/cli/cli_fixture.h"

#include <nlohmann/json.hpp>

#include <sstream>

namespace relume {
namespace {

using Json = nlohmann::json;

class OptionRules : public CliFixture {
 protected:
  void expectRefused(const std::vector<std::string>& arguments, const std::string& message, int status = 1) {
    std::string call;
    for (const std::string& word : arguments) call += " '" + word + "'";
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.status, status) << call << "\n" << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << call << "\nexpected: " << message << "\n" << result.err;
  }
};

// The last of lines that are all objects of JSON.
Json lastOfLines(const std::string& text) {
  std::istringstream lines(text);
  Json last;
  for (std::string line; std::getline(lines, line);) {
    last = Json::parse(line, nullptr, false);
    EXPECT_TRUE(last.is_object()) << line;
  }
  return last;
}

TEST_F(OptionRules, namesOfFilesAreNotEmpty) {
  const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> commands = {
      {{"bake", room_, "-o", out_},
       {"-o", "--plan", "--options", "--report", "--export-glb", "--depfile", "--store", "SCENE"}},
      {{"merge", "plan", "shard", "-o", out_}, {"-o", "--report", "PLAN", "SHARD"}},
      {{"store", "gc", "folder"}, {}},
      {{"bench", room_}, {"--bake", "--markdown", "SCENE"}},
      {{"info", room_}, {"FILE"}},
      {{"validate", out_}, {"FILE"}},
      {{"compare", out_, out_}, {"--scene", "--html", "--report-a", "--report-b", "A", "B"}},
      {{"status", room_, out_}, {"SCENE", "BAKE"}},
      {{"export", room_, out_, "-o", at("a.glb")}, {"-o", "SCENE", "BAKE"}},
      {{"pack", out_, "-o", at("p.relume")}, {"-o", "BAKE"}},
      {{"render", room_, "-o", at("p.png")}, {"-o", "--bake", "--edited-from", "--lights-file", "--sky-map", "SCENE"}},
      {{"preview", room_, "-o", at("p.png")}, {"-o", "--bake", "--lights-file", "--sky-map", "SCENE"}},
      {{"reference", room_, "-o", at("p.png")}, {"-o", "--lights-file", "--sky-map", "SCENE"}},
      {{"diff", at("a.png"), at("b.png")}, {"-o", "IMAGE", "REFERENCE"}},
  };
  for (const auto& [command, names] : commands) {
    std::size_t positional = 0;
    for (const std::string& name : names) {
      std::vector<std::string> words = command;
      if (name.starts_with('-'))
        words.insert(words.end(), {name, ""});
      else
        words[++positional] = "";
      const std::string thing = name == "--store" ? "folder" : "file";
      expectRefused(words, name + ": a " + thing + "'s name expected, \"\" found");
    }
  }
  expectRefused({"store", "gc", ""}, "DIR: a folder's name expected, \"\" found");
  for (const char* url : {"http://a:s3cr3t@b/c", "http:/a:s3cr3t@b/c", "a:s3cr3t@b/c"})
    expectRefused({"store", "gc", url}, "store gc: a folder expected, a URL found; ");
  EXPECT_EQ(filesIn(folder_ / "out"), 0u) << "nothing was baked";
}

TEST_F(OptionRules, anOptionCountsAsItIsGivenLast) {
  const std::string printed = run({"bake", "--print-options", "--preset", "draft", "--surfels", "300"}).out;
  EXPECT_EQ(
      run({"bake", "--print-options", "--preset", "best", "--surfels", "9", "--preset", "draft", "--surfels", "300"})
          .out,
      printed);
  EXPECT_NE(printed.find("300"), std::string::npos) << printed;
  bake(room_, at("first.relume"), {"--progress", "none", "--max-memory", "1M", "-o", out_, "--max-memory", "4G"});
  EXPECT_TRUE(std::filesystem::exists(out_));
  EXPECT_FALSE(std::filesystem::exists(at("first.relume")));
  // As samples/cluster/parallel.sh calls it: options of its own before those it was given.
  const ProgramResult plan = run({"bake", room_, "--plan", at("plan.relume"), "--progress", "none", "--preset", "high",
                                  "--preset", "draft", "--walks", "1000", "--progress", "plain"});
  EXPECT_EQ(plan.status, 0) << plan.err;
}

TEST_F(OptionRules, wrongValuesAreQuotedAsTheyWereTyped) {
  expectRefused({"bake", room_, "-o", out_, "--preset", "draft", "--preset", "ultra"}, "expected, \"ultra\" found");
  expectRefused({"bake", room_, "-o", out_, "--progress", "none", "--progress", "x"}, "expected, \"x\" found");
  expectRefused({"bench", room_, "--preset", "draft,foo"}, "expected, \"draft,foo\" found");
  expectRefused({"validate", room_, "--max-memory", "17179869184G"},
                "--max-memory: a whole number of 1M..17179869183G expected, \"17179869184G\" found");
  expectRefused({"validate", room_, "--max-memory", "1K"}, "expected, \"1K\" found");
}

// The warning of an options file comes before there is any progress.
TEST_F(OptionRules, jsonLinesTellOfCountsBesideABudget) {
  const std::string file = put("all.json", run({"bake", "--preset", "draft", "--print-options"}).out);
  const ProgramResult result = run(
      {"bake", "--preset", "medium", "--options", file, "--budget-mb", "1", "--progress", "json", "--print-options"});
  EXPECT_EQ(result.status, 0) << result.err;
  const Json last = lastOfLines(result.err);
  EXPECT_EQ(last["severity"], "warning") << result.err;
  const std::string text = last["text"].get<std::string>();
  EXPECT_NE(text.find("a budget chooses it (--budget-mb, --budget-ms, --max-error); the file's is not used"),
            std::string::npos)
      << text;
}

// What a failed command ends with is a line like the others, whatever is wrong with it.
TEST_F(OptionRules, jsonLinesEndInJson) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> calls = {
      {{"bake", at("none.gltf"), "-o", out_}, "none.gltf"},
      {{"bake", room_, "-o", out_, "--preset", "ultra"}, "\"ultra\" found"},
      {{"bake", room_, "-o", room_}, "is the scene"},
      {{"compare", at("none.relume"), out_}, "none.relume"}};
  for (auto [words, message] : calls) {
    words.insert(words.begin() + 1, {"--progress", "json"});
    const ProgramResult result = run(words);
    EXPECT_NE(result.status, 0);
    const Json last = lastOfLines(result.err);
    EXPECT_EQ(last["event"], "message") << result.err;
    EXPECT_EQ(last["severity"], "error") << result.err;
    EXPECT_NE(last["text"].get<std::string>().find(message), std::string::npos) << result.err;
  }
}

// Another level where a bake stands: each change on a line of its own, or one string of JSON.
TEST_F(OptionRules, changesOfALevelAreLines) {
  bake(room_, out_, {"--progress", "none"});
  GltfParts other;
  other.room = makeBoxRoom(5.0f);
  std::string text = makeGltf(other);
  text.replace(text.find("\"Room\""), 6, "\"a\\nb\"");
  text.replace(text.find("[2,2,3.5]"), 9, "[2,2,2.5]");
  const std::string level = put("other.gltf", text);
  const ProgramResult json = run(bakeArguments(level, out_, {"--progress", "json"}));
  EXPECT_EQ(json.status, 0) << json.err;
  EXPECT_NE(json.err.find("\\n  cameras or play volumes changed\"}"), std::string::npos) << "one string: " << json.err;
  const ProgramResult plain = run(bakeArguments(room_, out_, {"--progress", "plain"}));
  EXPECT_EQ(plain.status, 0) << plain.err;
  const std::size_t begin = plain.err.find("relume: info: baking: ");
  ASSERT_NE(begin, std::string::npos) << plain.err;
  EXPECT_NE(plain.err.find("\n  cameras or play volumes changed\n", begin), std::string::npos) << plain.err;
  EXPECT_EQ(plain.err.find("\\n  "), std::string::npos) << plain.err;
  EXPECT_NE(plain.err.find("a\\nb"), std::string::npos) << "a line end of a name stays one word: " << plain.err;
}

}  // namespace
}  // namespace relume
