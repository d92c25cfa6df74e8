// SPDX-License-Identifier: MIT
// relume pack: every profile gives a bake that all commands read, and refuses what it cannot do by name.
#include "tests/cli/cli_fixture.h"

#include <nlohmann/json.hpp>

#include <set>

namespace relume {
namespace {

const std::string kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

class PackCli : public CliFixture {
 protected:
  void SetUp() override {
    CliFixture::SetUp();
    bake_ = at("level.relume");
    const ProgramResult baked = run({"bake", kLevel, "-o", bake_, "--preset", "draft", "--surfels", "2048", "--rays",
                                     "128", "--walks", "20000", "--progress", "none"});
    ASSERT_EQ(baked.status, 0) << baked.err;
    packed_ = at("packed.relume");
  }
  std::string bake_, packed_;
};

TEST_F(PackCli, losslessIsTheSameBake) {
  const ProgramResult packed = run({"pack", bake_, "-o", packed_, "--json"});
  ASSERT_EQ(packed.status, 0) << packed.err;
  const auto report = nlohmann::json::parse(packed.out);
  EXPECT_EQ(report["bytes"], readAll(packed_).size());
  EXPECT_EQ(report["bakeBytes"], readAll(bake_).size());
  EXPECT_LT(report["gzipBytes"], readAll(bake_).size());
  EXPECT_EQ(run({"validate", packed_}).status, 0);
  const auto info = [&](const std::string& file) { return nlohmann::json::parse(run({"info", "--json", file}).out); };
  EXPECT_EQ(info(packed_)["hash"], info(bake_)["hash"]);
  EXPECT_EQ(info(packed_)["formatVersion"], 9);
  EXPECT_EQ(info(bake_)["formatVersion"], 8);
  EXPECT_EQ(run({"status", kLevel, packed_}).status, 0);
  const ProgramResult compared = run({"compare", bake_, packed_, "--scene", kLevel, "--max-rmse", "0"});
  EXPECT_EQ(compared.status, 0) << compared.out << compared.err;

  const std::string plain = at("plain.relume");
  ASSERT_EQ(run({"pack", packed_, "-o", plain, "--profile", "plain"}).status, 0);
  EXPECT_TRUE(readAll(plain) == readAll(bake_));
}

// Packed is ordered for gzip, and may be larger as it lies.
TEST_F(PackCli, whatIsNoSmallerIsToldOf) {
  std::set<bool> seen;
  for (const std::string& output : {packed_, packed_ + ".gz"}) {
    for (const char* profile : {"lossless", "web", "plain"}) {
      const ProgramResult packed = run({"pack", bake_, "-o", output, "--profile", profile});
      ASSERT_EQ(packed.status, 0) << packed.err;
      const bool isNoSmaller = readAll(output).size() >= readAll(bake_).size() && profile != std::string("plain");
      EXPECT_EQ(packed.out.find("no smaller as it lies: serve it through gzip") != std::string::npos, isNoSmaller)
          << packed.out;
      seen.insert(isNoSmaller);
    }
  }
  EXPECT_EQ(seen.size(), 2u);
}

TEST_F(PackCli, whatWasSimplifiedIsNotUnpacked) {
  const std::string plain = at("plain.relume"), again = at("again.relume");
  ASSERT_EQ(run({"pack", bake_, "-o", packed_, "--profile", "web"}).status, 0);
  ASSERT_EQ(run({"pack", packed_, "-o", again}).status, 0);
  for (const std::string& simplified : {packed_, again}) {
    const ProgramResult refused = run({"pack", simplified, "-o", plain, "--profile", "plain"});
    EXPECT_EQ(refused.status, 1) << refused.err;
    EXPECT_NE(refused.err.find(simplified + "\" was simplified (--profile web)"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("take the bake that it was packed from"), std::string::npos) << refused.err;
  }
  EXPECT_FALSE(std::filesystem::exists(plain));
  // What is plain already stays as it is.
  ASSERT_EQ(run({"pack", bake_, "-o", plain, "--profile", "plain"}).status, 0);
  EXPECT_TRUE(readAll(plain) == readAll(bake_));
}

TEST_F(PackCli, gzipHoldsThePackedBake) {
  const std::string zipped = packed_ + ".gz";
  ASSERT_EQ(run({"pack", bake_, "-o", packed_, "--profile", "web"}).status, 0);
  ASSERT_EQ(run({"pack", bake_, "-o", zipped, "--profile", "web"}).status, 0);
  const ProgramResult refused = run({"info", zipped});
  EXPECT_EQ(refused.status, 3);
  EXPECT_NE(refused.err.find("a file of gzip: unpack it by gunzip first"), std::string::npos) << refused.err;
  const std::string again = at("again.relume");
  ASSERT_EQ(std::system(("gunzip -c '" + zipped + "' > '" + again + "'").c_str()), 0);
  EXPECT_TRUE(readAll(again) == readAll(packed_));
}

TEST_F(PackCli, onlyBakesThroughGzipAreWrittenOver) {
  const auto zip = [&](const std::string& content, const std::string& file) {
    ASSERT_EQ(std::system(("gzip -c '" + content + "' > '" + file + "'").c_str()), 0);
  };
  const std::string backup = at("backup.tar.gz"), cut = put("cut.relume.gz", "\x1f\x8b");
  zip(put("notes.txt", "years of work"), backup);
  const std::string before = readAll(backup);
  for (const std::string& other : {backup, cut}) {
    const ProgramResult refused = run({"pack", bake_, "-o", other});
    EXPECT_EQ(refused.status, 1) << refused.err;
    EXPECT_NE(refused.err.find("exists and is not a bake through gzip; choose another name, or --force"),
              std::string::npos)
        << refused.err;
  }
  EXPECT_TRUE(readAll(backup) == before);
  EXPECT_EQ(run({"pack", bake_, "-o", backup, "--force"}).status, 0);

  // Of pack or of gzip, packed or not.
  const std::string zipped = at("level.relume.gz");
  zip(bake_, zipped);
  for (const char* profile : {"plain", "lossless", "web"}) {
    const ProgramResult packed = run({"pack", bake_, "-o", zipped, "--profile", profile});
    EXPECT_EQ(packed.status, 0) << packed.err;
  }
}

TEST_F(PackCli, drawingNeedsCoordinates) {
  ASSERT_EQ(run({"pack", bake_, "-o", packed_, "--profile", "web"}).status, 0);
  EXPECT_EQ(run({"validate", packed_}).status, 0);
  const std::string picture = at("picture.exr");
  const std::vector<std::string> render = {"render", kLevel, "--bake", packed_, "--size", "32x18", "-o", picture};
  for (const auto& words :
       {render, {"compare", bake_, packed_, "--scene", kLevel}, {"export", kLevel, packed_, "-o", at("level.glb")}}) {
    const ProgramResult result = run(words);
    EXPECT_EQ(result.status, 1) << words.front() << ": " << result.err;
    EXPECT_NE(result.err.find("its light-map coordinates were left out"), std::string::npos) << result.err;
  }
  EXPECT_FALSE(std::filesystem::exists(picture));
  ASSERT_EQ(run({"pack", bake_, "-o", packed_, "--profile", "web", "--keep-coordinates"}).status, 0);
  const ProgramResult drawn = run(render);
  EXPECT_EQ(drawn.status, 0) << drawn.err;
}

// What packing holds at once is asked for before anything is read.
TEST_F(PackCli, memoryIsAskedForFirst) {
  const std::string large = at("large.relume");
  std::filesystem::copy_file(bake_, large);
  std::filesystem::resize_file(large, 64 << 20);
  const ProgramResult refused = run({"pack", large, "-o", packed_, "--max-memory", "256M"});
  EXPECT_EQ(refused.status, 4) << refused.err;
  EXPECT_NE(refused.err.find("pack needs about 256 MiB"), std::string::npos) << refused.err;
  const ProgramResult read = run({"pack", large, "-o", packed_, "--max-memory", "1G"});
  EXPECT_NE(read.err.find("bytes were appended"), std::string::npos) << read.err;
}

TEST_F(PackCli, refusesByName) {
  const std::string other = at("notes.txt");
  std::ofstream(other) << "keep me";
  const auto expectRefused = [&](const std::vector<std::string>& words, int status, const char* message) {
    const ProgramResult result = run(words);
    EXPECT_EQ(result.status, status) << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
  };
  expectRefused({"pack", bake_, "-o", bake_}, 1, "is the bake");
  expectRefused({"pack", bake_, "-o", other}, 1, "choose another name, or --force");
  expectRefused({"pack", bake_, "-o", packed_, "--profile", "small"}, 1, "--profile");
  expectRefused({"pack", bake_, "-o", packed_, "--keep-coordinates"}, 1, "--profile web alone");
  expectRefused({"pack", at("none.relume"), "-o", packed_}, 2, "none.relume");
  expectRefused({"pack", other, "-o", packed_}, 3, "expected a Relume bake");
  expectRefused({"pack", bake_, "-o", "/dev/full"}, 2, "/dev/full");
  EXPECT_EQ(readAll(other), "keep me");
  EXPECT_FALSE(std::filesystem::exists(packed_));
}

}  // namespace
}  // namespace relume
