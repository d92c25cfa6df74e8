// SPDX-License-Identifier: MIT
// Bakes and side files made to break the commands that read them: each ends with a status of its own and a sentence.
#include "relume/bake_file.h"
#include "tests/cli/cli_fixture.h"
#include "tests/formats/corrupt_file.h"

#include <cstring>
#include <limits>

namespace relume {
namespace {

class HostileBakes : public CliFixture {
 protected:
  void SetUp() override {
    CliFixture::SetUp();
    bake(room_, out_);
  }

  static std::string nested(std::size_t depth) {
    std::string text;
    for (std::size_t i = 0; i < depth; ++i) text += "{\"a\":";
    text += "1";
    for (std::size_t i = 0; i < depth; ++i) text += "}";
    return text;
  }

  // The room's bake with other options in its provenance.
  std::string bakeWithOptions(const std::string& name, const std::string& json) {
    Result<Bake> bake = readBake(out_);
    EXPECT_TRUE(bake);
    bake->provenance.optionsJson = json;
    EXPECT_TRUE(writeBake(*bake, at(name)));
    return at(name);
  }

  // The room's bake with one float of a chunk replaced, sealed again.
  std::string bakeWithFloat(const std::string& name, const std::string& chunk, std::size_t index, float value) {
    const std::string text = readAll(out_);
    Bytes file(text.size());
    std::memcpy(file.data(), text.data(), text.size());
    const std::size_t row = findRow(file, chunk);
    EXPECT_LT(row, chunkCount(file)) << chunk;
    putAt(file, static_cast<std::size_t>(getAt<std::uint64_t>(file, rowOffset(row) + 40)) + 4 * index, value);
    reseal(file);
    return put(name, std::string(reinterpret_cast<const char*>(file.data()), file.size()));
  }

  void expectRefused(const ProgramResult& result, int status, const std::string& words) {
    EXPECT_EQ(result.status, status) << result.err;
    EXPECT_NE(result.err.find(words), std::string::npos) << "\"" << words << "\" in: " << result.err;
  }
};

TEST_F(HostileBakes, optionsNestedWithoutEndAreTextToEveryCommand) {
  for (const std::size_t depth : {std::size_t{129}, std::size_t{1'000'000}}) {
    const std::string hostile = bakeWithOptions("nested.relume", nested(depth));
    EXPECT_EQ(run({"info", hostile}).status, 0);
    EXPECT_EQ(run({"info", hostile, "--json"}).status, 0);
    EXPECT_EQ(run({"validate", hostile}).status, 0);
    EXPECT_EQ(run({"compare", hostile, out_, "--html", at("page.html")}).status, 0);
    EXPECT_EQ(run({"compare", out_, hostile, "--json"}).status, 0);
    const ProgramResult status = run({"status", room_, hostile});
    EXPECT_LT(status.status, 128) << status.err;
  }
  // A bake over such a bake is a bake, and afterwards there is a good one.
  const ProgramResult over = run(bakeArguments(room_, at("nested.relume"), {"--force"}));
  EXPECT_EQ(over.status, 0) << over.err;
  bakeWithOptions("nested.relume", nested(1'000'000));
  const ProgramResult again = run(bakeArguments(room_, at("nested.relume")));
  EXPECT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(readAll(at("nested.relume")), readAll(out_));
}

TEST_F(HostileBakes, sideFilesNestedWithoutEndAreRefused) {
  for (const std::size_t depth : {std::size_t{129}, std::size_t{1'000'000}}) {
    const std::string list(depth, '[');
    const std::string object = put("object.json", nested(depth)), lights = put("lights.json", list);
    if (depth < 200'000 / 6)  // beyond, the options file is too long
      expectRefused(run(bakeArguments(room_, at("a.relume"), {"--options", object})), 1, "nested more than 128 deep");
    EXPECT_EQ(run(bakeArguments(room_, at("a.relume"), {"--options", object})).status, 1);
    const std::string other = bakeWithOptions("other.relume", "{}");
    expectRefused(run({"compare", out_, other, "--html", at("page.html"), "--report-a", object}), 3,
                  "nested more than 128 deep");
    expectRefused(run({"render", room_, "--bake", out_, "-o", at("a.exr"), "--lights-file", lights, "--size", "8x8"}),
                  3, "nested more than 128 deep");
    EXPECT_FALSE(std::filesystem::exists(at("a.relume")));
  }
}

// Every command that reads positions, with each kind of a position that is none.
TEST_F(HostileBakes, positionsThatAreNowhereAreRefusedByNumberAndElement) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float value : {3e38f, -3e38f, 2e9f, kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN()}) {
    for (const char* chunk : {"cache.position", "surfel.position"}) {
      for (const std::size_t axis : {0, 1, 2}) {
        const std::string hostile = bakeWithFloat("far.relume", chunk, 6 + axis, value);
        const std::string words =
            std::string("E135 position is not finite, or beyond the coordinates a bake may have: ") + chunk +
            "[2]: expected within 1e9 m";
        if (axis == 0) {
          expectRefused(run({"info", hostile}), 3, words);
          expectRefused(run({"compare", out_, hostile}), 3, words);
          EXPECT_EQ(run({"validate", hostile}).status, 3);
        }
        expectRefused(run({"render", room_, "--bake", hostile, "-o", at("a.exr"), "--size", "8x8"}), 3, words);
      }
    }
  }
}

}  // namespace
}  // namespace relume
