// SPDX-License-Identifier: MIT
// `relume preview` as a user runs it: what it writes, and what it says when it cannot.
#include "tests/cli/cli_fixture.h"
#include "tools/images/image_io.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace relume {
namespace {

const std::string kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

class PreviewCommand : public CliFixture {
 protected:
  ProgramResult preview(std::vector<std::string> more) {
    std::vector<std::string> arguments{"preview", kLevel,       "--size", "48x27", "--rays",
                                       "256",     "--progress", "none",   "-o",    image()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  std::string image() const { return (folder_ / "image.exr").string(); }
  void expectRefused(const ProgramResult& r, int status, const std::vector<std::string>& words) {
    EXPECT_EQ(r.status, status) << r.err;
    for (const std::string& word : words)
      EXPECT_NE(r.err.find(word), std::string::npos) << "\"" << word << "\" in: " << r.err;
  }
  // Root of the mean square difference of two layers over the root of the mean square of the second.
  static double differenceOf(const std::filesystem::path& a, const std::filesystem::path& b, const std::string& layer) {
    const auto first = readExr(a), second = readExr(b);
    EXPECT_TRUE(first && second);
    const auto x = first->layer(""), y = second->layer(layer);
    double square = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < y.size(); ++i) {
      square += glm::dot(x[i] - y[i], x[i] - y[i]);
      sum += glm::dot(y[i], y[i]);
    }
    return std::sqrt(square / sum);
  }
};

TEST_F(PreviewCommand, withoutABakeItIsNearThePathTracer) {
  const std::vector<std::string> view{"--camera", "cam_hall", "--lights", "spot"};
  std::vector<std::string> reference{"reference",  kLevel, "--size",    "48x27",
                                     "--spp",      "256",  "--dynamic", "receivers",
                                     "--progress", "none", "-o",        (folder_ / "truth.exr").string()};
  reference.insert(reference.end(), view.begin(), view.end());
  ASSERT_EQ(run(reference).status, 0);
  std::vector<std::string> arguments = view;
  arguments.insert(arguments.end(), {"--aov", "bounced", "--json"});
  const ProgramResult made = preview(arguments);
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_LT(differenceOf(image(), folder_ / "truth.exr", "DiffInd"), 0.25);
  const auto json = nlohmann::json::parse(made.out);
  EXPECT_GT(json["records"].get<int>(), 50);
  EXPECT_GT(json["rays"].get<double>(), 256.0 * 50);
  EXPECT_NEAR(json["accuracy"].get<double>(), 0.15, 1e-6);
  EXPECT_EQ(json["images"][0], image());
  EXPECT_TRUE(json["stageMs"].contains("records"));
}

TEST_F(PreviewCommand, allSourcesGiveTheSameLightButForBounces) {
  const std::string bake = (folder_ / "level.relume").string();
  ASSERT_EQ(run({"bake", kLevel, "-o", bake, "--preset", "medium", "--surfels", "8192", "--progress", "none"}).status,
            0);
  const auto meanOf = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--camera", "cam_hall", "--aov", "bounced", "--force"};
    if (std::find(more.begin(), more.end(), "--lights") == more.end())
      arguments.insert(arguments.end(), {"--lights", "spot"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult made = preview(arguments);
    EXPECT_EQ(made.status, 0) << made.err;
    const auto read = readExr(image());
    double sum = 0.0;
    for (const glm::vec3& v : read->layer("")) sum += v.x + v.y + v.z;
    return sum;
  };
  const double hits = meanOf({"--bake", bake}), surfels = meanOf({"--bake", bake, "--source", "surfels"}),
               direct = meanOf({"--source", "direct"});
  EXPECT_NEAR(surfels, hits, 0.05 * hits);
  EXPECT_LT(direct, 0.95 * hits);
  EXPECT_GT(direct, 0.3 * hits);

  // Of emitters, hits have points, and surfels what links have.
  const double points = meanOf({"--lights", "emissive", "--bake", bake}),
               links = meanOf({"--lights", "emissive", "--bake", bake, "--source", "surfels"});
  EXPECT_GT(links, 0.0);
  EXPECT_NEAR(points, links, 0.06 * links);
}

// Many rays for few records: many of them meet cells that other threads are filling.
TEST_F(PreviewCommand, sameBytesAtAnyNumberOfThreads) {
  const std::string bake = (folder_ / "level.relume").string();
  ASSERT_EQ(run({"bake", kLevel, "-o", bake, "--preset", "draft", "--surfels", "2048", "--progress", "none"}).status,
            0);
  for (const std::string source : {"hits", "surfels", "direct"}) {
    const auto bytesOf = [&](const char* threads) {
      std::vector<std::string> arguments{"--lights", "spot,emissive", "--size",    "24x14",  "--samples",
                                         "1",        "--rounds",      "0",         "--rays", "4096",
                                         "--source", source,          "--threads", threads,  "--force"};
      if (source != "direct") arguments.insert(arguments.end(), {"--bake", bake});
      EXPECT_EQ(preview(arguments).status, 0);
      return readAll(image());
    };
    const std::string one = bytesOf("1");
    ASSERT_GT(one.size(), 1000u);
    for (const char* threads : {"2", "7", "7"}) EXPECT_TRUE(bytesOf(threads) == one) << source << ", " << threads;
  }
}

TEST_F(PreviewCommand, aTimeLimitIsKeptAndAPngIsWritten) {
  const std::string png = (folder_ / "image.png").string();
  const ProgramResult made = run({"preview", kLevel, "--size", "48x27", "--source", "direct", "--time-limit", "0.001",
                                  "--progress", "none", "--json", "-o", png});
  ASSERT_EQ(made.status, 0) << made.err;
  const auto json = nlohmann::json::parse(made.out);
  EXPECT_GT(json["accuracy"].get<double>(), 0.15);
  EXPECT_TRUE(json["png"].contains("exposureStops"));
  EXPECT_EQ(readAll(png).substr(1, 3), "PNG");
  // Less than a float holds is a limit all the same.
  const ProgramResult least = preview({"--source", "direct", "--time-limit", "1e-300", "--json"});
  ASSERT_EQ(least.status, 0) << least.err;
  EXPECT_EQ(nlohmann::json::parse(least.out)["accuracy"].get<double>(), 1.0);
}

TEST_F(PreviewCommand, recordsAndTheirWeightsCanBeLookedAt) {
  const ProgramResult made = preview({"--aov", "records,weight", "--source", "direct", "--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  const auto records = readExr(folder_ / "image.records.exr"), weight = readExr(folder_ / "image.weight.exr");
  ASSERT_TRUE(records && weight);
  const auto dots = records->layer(""), weights = weight->layer("");
  int marked = 0;
  for (std::size_t i = 0; i < dots.size(); ++i) {
    ASSERT_TRUE(dots[i].x == 0.0f || dots[i].x == 1.0f);
    EXPECT_GE(weights[i].x, dots[i].x > 0.0f ? 1e-3f : 0.0f);
    marked += dots[i].x == 1.0f ? 1 : 0;
  }
  const int count = nlohmann::json::parse(made.out)["records"];
  EXPECT_LE(marked, count);
  EXPECT_GT(marked, count / 2);
  const std::string png = (folder_ / "look.png").string();
  EXPECT_EQ(run({"preview", kLevel, "--size", "48x27", "--source", "direct", "--aov", "records,weight", "--progress",
                 "none", "-o", png})
                .status,
            0);
  EXPECT_EQ(readAll(folder_ / "look.weight.png").substr(1, 3), "PNG");
  expectRefused(run({"render", kLevel, "--aov", "weight", "-o", image()}), 1, {"--aov weight", "relume preview"});
}

// What surfaces mirror is a layer of its own and part of the whole; without --gloss materials mirror nothing.
TEST_F(PreviewCommand, glossIsWhatTheReferenceMirrors) {
  const std::vector<std::string> view{"--camera", "cam_hall", "--lights", "spot", "--gloss", "--aov", "glossy"};
  std::vector<std::string> reference{"reference",  kLevel, "--size",    "48x27",
                                     "--spp",      "400",  "--dynamic", "receivers",
                                     "--progress", "none", "-o",        (folder_ / "truth.exr").string()};
  reference.insert(reference.end(), view.begin(), view.end());
  ASSERT_EQ(run(reference).status, 0);
  std::vector<std::string> arguments = view;
  arguments.push_back("--json");
  const ProgramResult made = preview(arguments);
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_GT(nlohmann::json::parse(made.out)["glossyRecords"].get<int>(), 10);
  EXPECT_LT(differenceOf(image(), folder_ / "truth.exr", ""), 0.25);
}

// OpenGL draws what records see: the same light as rays through the pixels of the same plane find.
TEST_F(PreviewCommand, openGlGivesTheLightThatRaysDo) {
  const auto draw = [&](const char* backend) {
    return preview({"--camera", "cam_hall", "--lights", "spot", "--source", "direct", "--hemisphere", "border",
                    "--plane-side", "32", "--backend", backend, "--aov", "bounced", "--json"});
  };
  const ProgramResult byRays = draw("cpu");
  ASSERT_EQ(byRays.status, 0) << byRays.err;
  std::filesystem::rename(image(), folder_ / "rays.exr");
  const ProgramResult drawn = draw("gl");
  if (drawn.status == 5) GTEST_SKIP() << drawn.err;
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_LT(differenceOf(image(), folder_ / "rays.exr", ""), 0.1);
  EXPECT_EQ(nlohmann::json::parse(byRays.out)["hemispheres"], "cpu");
  EXPECT_EQ(nlohmann::json::parse(drawn.out)["hemispheres"].get<std::string>().substr(0, 3), "gl:");
}

// Records whose rays are traced, splatted by either: the same records, and the same light but for the last digits.
TEST_F(PreviewCommand, openGlSplatsAsTheProcessorDoes) {
  const auto draw = [&](const char* backend) {
    return preview({"--camera", "cam_hall", "--lights", "spot", "--source", "direct", "--sky", "0.1,0.2,0.3",
                    "--backend", backend, "--json"});
  };
  const ProgramResult byCpu = draw("cpu");
  ASSERT_EQ(byCpu.status, 0) << byCpu.err;
  std::filesystem::rename(image(), folder_ / "cpu.exr");
  const ProgramResult byGl = draw("gl");
  if (byGl.status == 5) GTEST_SKIP() << byGl.err;
  ASSERT_EQ(byGl.status, 0) << byGl.err;
  EXPECT_LT(differenceOf(image(), folder_ / "cpu.exr", ""), 1e-3);
  const auto cpu = nlohmann::json::parse(byCpu.out), gl = nlohmann::json::parse(byGl.out);
  EXPECT_EQ(cpu["records"], gl["records"]);
  EXPECT_EQ(cpu["splats"], "cpu");
  EXPECT_EQ(gl["splats"].get<std::string>().substr(0, 3), "gl:");
  EXPECT_EQ(gl["hemispheres"], "cpu") << "rays look around";
}

// What surfaces mirror is that of the pixels' centres, where their lobes are alike.
TEST_F(PreviewCommand, openGlSplatsWhatSurfacesMirror) {
  const auto draw = [&](const char* backend) {
    return preview({"--camera", "cam_hall", "--lights", "spot", "--source", "direct", "--gloss", "--aov", "glossy",
                    "--samples", "2", "--backend", backend, "--json"});
  };
  const ProgramResult byCpu = draw("cpu");
  ASSERT_EQ(byCpu.status, 0) << byCpu.err;
  std::filesystem::rename(image(), folder_ / "cpu.exr");
  const ProgramResult byGl = draw("gl");
  if (byGl.status == 5) GTEST_SKIP() << byGl.err;
  ASSERT_EQ(byGl.status, 0) << byGl.err;
  const double difference = differenceOf(image(), folder_ / "cpu.exr", "");
  EXPECT_LT(difference, 0.01);
  EXPECT_GT(difference, 0.0) << "OpenGL did draw";
  EXPECT_GT(nlohmann::json::parse(byGl.out)["glossyRecords"].get<int>(), 10);
}

TEST_F(PreviewCommand, thePapersReachMakesFewerRecords) {
  const auto records = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--camera", "cam_hall", "--lights", "spot",  "--source",
                                       "direct",   "--rounds", "0",        "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult made = preview(arguments);
    EXPECT_EQ(made.status, 0) << made.err;
    return nlohmann::json::parse(made.out)["records"].get<int>();
  };
  const int guarded = records({}), printed = records({"--reach", "printed"}),
            wide = records({"--reach", "printed", "--min-reach", "8"});
  EXPECT_LT(printed, guarded);
  EXPECT_LT(wide, printed);
  EXPECT_GT(wide, 5);
}

TEST_F(PreviewCommand, namesWhatOpenGlCannotDraw) {
  const std::string border = "border";
  expectRefused(preview({"--backend", "gl", "--hemisphere", border, "--source", "hits"}), 1,
                {"--source direct", "--hemisphere fan", "hits"});
  expectRefused(preview({"--backend", "gl", "--hemisphere", border, "--bake", kLevel}), 1, {"--bake"});
  expectRefused(preview({"--backend", "gl", "--hemisphere", border, "--sky", "1,1,1"}), 1, {"--sky", "--lights"});
  expectRefused(preview({"--backend", "gpu"}), 1, {"--backend", "gpu"});
  expectRefused(preview({"--hemisphere", "dome"}), 1, {"--hemisphere", "dome"});
  expectRefused(preview({"--shadow-size", "63"}), 1, {"--shadow-size"});
  expectRefused(preview({"--reach", "far"}), 1, {"--reach", "far"});
  for (const char* pixels : {"-1", "65", "nan"}) expectRefused(preview({"--min-reach", pixels}), 1, {"--min-reach"});
  for (const char* fov : {"9", "176", "inf", ""}) expectRefused(preview({"--plane-fov", fov}), 1, {"--plane-fov"});
  for (const char* side : {"257", "-64", "6.5"}) expectRefused(preview({"--plane-side", side}), 1, {"--plane-side"});
  EXPECT_FALSE(std::filesystem::exists(image()));
}

TEST_F(PreviewCommand, namesWhatIsWrong) {
  expectRefused(preview({"--camera", "nowhere"}), 1, {"--camera", "nowhere", "cam_living"});
  expectRefused(preview({"--aov", "shine"}), 1, {"--aov", "shine", "indirect"});
  expectRefused(preview({"--aov", "glossy"}), 1, {"--aov glossy", "--gloss"});
  expectRefused(preview({"--aov", "unbounced", "--gloss"}), 1, {"--aov unbounced", "--gloss"});
  expectRefused(preview({"--source", "grid"}), 1, {"--source"});
  expectRefused(preview({"--source", "direct", "--bake", kLevel}), 1, {"--source direct", "--bake"});
  for (const char* accuracy : {"0", "-1", "nan", "inf", "3", "x", ""})
    expectRefused(preview({"--accuracy", accuracy}), 1, {"--accuracy: a number of 0.02..2 expected"});
  for (const char* rays : {"0", "15", "65537", "1e3", "-16"}) expectRefused(preview({"--rays", rays}), 1, {"--rays"});
  for (const char* limit : {"-1", "nan", "inf", "1e9"})
    expectRefused(preview({"--time-limit", limit}), 1, {"--time-limit"});
  expectRefused(preview({"--plane-fov", "180"}), 1, {"--plane-fov"});
  expectRefused(preview({"--plane-side", "1"}), 1, {"--plane-side"});
  for (const char* plane : {"--plane-side", "--plane-fov"})
    for (const char* size : {"32", "64"}) expectRefused(preview({plane, size}), 1, {plane, "--hemisphere plane"});
  expectRefused(preview({"--allow-stale"}), 1, {"--allow-stale needs --bake"});
  expectRefused(preview({"--max-records", "0"}), 1, {"--max-records"});
  expectRefused(preview({"--weight", "heavy"}), 1, {"--weight"});
  expectRefused(preview({"--bake", kLevel}), 3, {"two_rooms.glb"});
  expectRefused(run({"preview", kLevel, "-o", (folder_ / "image.jpg").string()}), 1, {".exr", ".png"});
  expectRefused(run({"preview", (folder_ / "none.glb").string(), "-o", image()}), 2, {"none.glb"});
  expectRefused(run({"preview", kLevel, "--size", "16384x16384", "--max-memory", "1G", "-o", image()}), 4,
                {"preview", "--size"});
  EXPECT_FALSE(std::filesystem::exists(image()));
}

TEST_F(PreviewCommand, writesOverNothingThatItReads) {
  const std::string copy = (folder_ / "copy.glb").string();
  std::filesystem::copy_file(kLevel, copy);
  const std::string before = readAll(copy);
  const std::string linked = (folder_ / "linked.png").string();
  std::filesystem::create_symlink(copy, linked);
  expectRefused(run({"preview", copy, "-o", linked, "--force"}), 1, {"is the scene"});
  std::ofstream(folder_ / "other.exr") << "no image";
  expectRefused(run({"preview", copy, "-o", (folder_ / "other.exr").string()}), 1, {"is not an OpenEXR image"});
  EXPECT_EQ(readAll(copy), before);
}

}  // namespace
}  // namespace relume
