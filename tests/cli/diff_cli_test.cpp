// SPDX-License-Identifier: MIT
// `relume diff`: figures with known values, the picture of the error, bounds, and what it refuses.
#include "formats/color.h"
#include "tests/cli/cli_fixture.h"
#include "tools/images/image_io.h"

#include <nlohmann/json.hpp>

#include <sys/mman.h>

#include <limits>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kWidth = 24, kHeight = 16;
using Pixels = std::vector<glm::vec3>;

class DiffCommand : public CliFixture {
 protected:
  void SetUp() override {
    CliFixture::SetUp();
    half_ = exr("half.exr", Pixels(kWidth * kHeight, glm::vec3(0.5f)));
  }

  std::string exr(const std::string& name, const Pixels& pixels, const std::string& layer = "",
                  std::uint32_t width = kWidth) {
    ChannelImage image{width, static_cast<std::uint32_t>(pixels.size()) / width, {}};
    image.setLayer(layer, pixels);
    EXPECT_TRUE(writeExr(at(name), image));
    return at(name);
  }
  std::string png(const std::string& name, const Pixels& pixels) {
    EXPECT_TRUE(writePng(at(name), kWidth, kHeight, std::span<const glm::vec3>(pixels)));
    return at(name);
  }
  nlohmann::json figures(std::vector<std::string> arguments, int status = 0) {
    arguments.insert(arguments.begin(), "diff");
    arguments.push_back("--json");
    const ProgramResult r = run(arguments);
    EXPECT_EQ(r.status, status) << r.err;
    return nlohmann::json::parse(r.out, nullptr, false);
  }
  void expectRefused(std::vector<std::string> arguments, int status, const std::vector<std::string>& words) {
    arguments.insert(arguments.begin(), "diff");
    const ProgramResult r = run(arguments);
    EXPECT_EQ(r.status, status) << r.err;
    for (const std::string& word : words)
      EXPECT_NE(r.err.find(word), std::string::npos) << "\"" << word << "\" in: " << r.err;
    EXPECT_EQ(r.out, "");
  }

  std::string half_;  // every pixel 0.5
};

TEST_F(DiffCommand, anImageAgainstItselfHasNoError) {
  const auto d = figures({half_, half_, "--max-rmse", "0", "--max-flip", "0"});
  EXPECT_EQ(d.at("rmse"), 0.0);
  EXPECT_EQ(d.at("relativeRmse"), 0.0);
  EXPECT_EQ(d.at("flip"), 0.0);
  EXPECT_EQ(d.at("energy"), 1.0);
}

TEST_F(DiffCommand, figuresAreThoseOfTheirFormulas) {
  // Half of the pixels a tenth brighter: RMSE sqrt(0.05² / 2), a tenth of which 0.5 is the mean of.
  Pixels brighter(kWidth * kHeight, glm::vec3(0.5f));
  for (std::size_t i = 0; i < brighter.size(); i += 2) brighter[i] = glm::vec3(0.55f);
  const auto d = figures({exr("brighter.exr", brighter), half_});
  EXPECT_NEAR(d.at("rmse"), 0.05 / std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(d.at("relativeRmse"), 0.1 / std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(d.at("energy"), 1.05, 1e-6);
  EXPECT_GT(d.at("flip"), 0.0);
  EXPECT_NEAR(d.at("worst").at("difference"), 0.05, 1e-6);
  // Black against white is as different as FLIP tells of these two.
  const auto max = figures({exr("black.exr", Pixels(kWidth * kHeight, glm::vec3(0.0f))),
                            exr("white.exr", Pixels(kWidth * kHeight, glm::vec3(1.0f))), "--exposure", "0"});
  EXPECT_GT(max.at("flip"), 0.9);
  EXPECT_EQ(max.at("energy"), 0.0);
  // The other way round there is nothing to divide by.
  const auto none = figures({at("white.exr"), at("black.exr")});
  EXPECT_TRUE(none.at("relativeRmse").is_null());
  EXPECT_TRUE(none.at("energy").is_null());
  figures({at("white.exr"), at("black.exr"), "--max-rmse", "1e9"}, 7);
}

TEST_F(DiffCommand, theErrorIsRedWhereTooBrightAndBlueWhereTooDark) {
  Pixels image(kWidth * kHeight, glm::vec3(0.5f));
  image[3 * kWidth + 4] = glm::vec3(0.9f);
  image[5 * kWidth + 6] = glm::vec3(0.1f);
  const auto d = figures({exr("image.exr", image), half_, "-o", at("error.png")});
  EXPECT_EQ(d.at("errorPicture"), at("error.png"));
  EXPECT_EQ(d.at("errorPictureScale"), 0.01);  // nine in ten have no error at all
  // Full red and full blue on white: no error against that picture, made linear here.
  const auto linear = [](float r, float g, float b) {
    return glm::vec3(srgbToLinear(r), srgbToLinear(g), srgbToLinear(b));
  };
  Pixels expected(kWidth * kHeight, glm::vec3(1.0f));
  expected[3 * kWidth + 4] = linear(0.70f, 0.09f, 0.17f);
  expected[5 * kWidth + 6] = linear(0.13f, 0.40f, 0.67f);
  EXPECT_EQ(figures({at("error.png"), png("expected.png", expected)}).at("rmse"), 0.0);
  figures({at("image.exr"), half_, "-o", at("error.exr")});
  const auto raw = readExr(at("error.exr"));
  ASSERT_TRUE(raw);
  EXPECT_NEAR(raw->layer("")[3 * kWidth + 4].r, 0.4f, 1e-6f);
  EXPECT_NEAR(raw->layer("")[5 * kWidth + 6].r, -0.4f, 1e-6f);
}

TEST_F(DiffCommand, boundsDecideTheExitStatus) {
  const std::string a = exr("a.exr", Pixels(kWidth * kHeight, glm::vec3(0.51f)));
  EXPECT_TRUE(figures({a, half_, "--max-rmse", "0.03", "--max-flip", "0.5"}).at("withinBounds"));
  EXPECT_FALSE(figures({a, half_, "--max-rmse", "0.01"}, 7).at("withinBounds"));
  EXPECT_FALSE(figures({a, half_, "--max-flip", "1e-6"}, 7).at("withinBounds"));
  // As of a script whose variable is not set: no bound at all would pass everything.
  for (const char* bound : {"nan", "-1", "inf", "x", ""}) {
    expectRefused({a, half_, "--max-rmse", bound}, 1, {"--max-rmse", bound});
    expectRefused({a, half_, "--max-flip", bound}, 1, {"--max-flip", bound});
  }
}

TEST_F(DiffCommand, endsBySigtermAsOtherCommandsDo) {
  const std::string large = exr("large.exr", Pixels(2048 * 2048, glm::vec3(0.5f)), "", 2048);
  Program program({"diff", large, large, "-o", at("out/error.png")}, folder_);
  EXPECT_TRUE(program.waitForHandler(SIGTERM));
  program.send(SIGTERM);
  const ProgramResult ended = program.wait();
  EXPECT_EQ(ended.status, 130) << ended.err;
  EXPECT_EQ(ended.err, "relume: error: cancelled\n");
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "out"));
}

TEST_F(DiffCommand, pngsAreComparedInLinearLight) {
  const std::string a = png("a.png", Pixels(kWidth * kHeight, glm::vec3(0.25f)));
  const std::string b = png("b.png", Pixels(kWidth * kHeight, glm::vec3(0.5f)));
  const auto d = figures({a, b});
  EXPECT_NEAR(d.at("energy"), 0.5, 0.01);
  EXPECT_EQ(d.at("flipExposureStops"), 0.0);
  expectRefused({a, half_}, 1, {"PNG", "a.png"});
}

// A PNG with a tRNS chunk, which makes pixels of 188 transparent: 0.5 in sRGB.
std::string halfWithTransparency(std::string png) {
  const std::string chunk("\0\0\0\6tRNS\0\xbc\0\xbc\0\xbc\xb5\x02\x1a\x57", 18);
  return png.insert(png.find("IDAT") - 4, chunk);
}

TEST_F(DiffCommand, alphaIsLeftOutAndSaid) {
  const std::string whole = png("whole.png", Pixels(kWidth * kHeight, glm::vec3(0.5f)));
  const std::string clear = put("clear.png", halfWithTransparency(readAll(whole)));
  const auto warning = [&](const std::string& image, const std::string& reference) {
    const ProgramResult r = run({"diff", image, reference, "--max-rmse", "0"});
    EXPECT_EQ(r.status, 0) << r.err;
    return r.err;
  };
  const std::string says =
      ": some pixels are transparent; their alpha is left out, their colours compared as they are\n";
  EXPECT_EQ(warning(whole, whole), "");
  EXPECT_EQ(warning(clear, whole), "relume: warning: \"" + clear + "\"" + says);
  EXPECT_EQ(warning(whole, clear), "relume: warning: \"" + clear + "\"" + says);
  EXPECT_EQ(warning(clear, clear), "relume: warning: \"" + clear + "\" and \"" + clear + "\"" + says);
}

TEST_F(DiffCommand, aPngWithAWrongChecksumIsRefused) {
  const std::string whole = readAll(png("whole.png", Pixels(kWidth * kHeight, glm::vec3(0.5f))));
  const std::pair<std::string, std::string> chunks[] = {{"IHDR", "IDAT"}, {"IDAT", "IEND"}};
  for (const auto& [type, next] : chunks) {
    std::string damaged = whole;
    damaged[damaged.find(next) - 5] ^= 1;
    const std::string place = "\"" + type + "\" at byte " + std::to_string(whole.find(type) - 4);
    expectRefused({at("whole.png"), put("damaged.png", damaged)}, 3,
                  {"damaged.png\": damaged: the checksum of chunk " + place});
  }
}

// What -o writes is read again, of differences that a float does not hold as well.
TEST_F(DiffCommand, aDifferenceBeyondAllNumbersIsWrittenAsTheLargest) {
  const std::string up = exr("up.exr", Pixels(kWidth * kHeight, glm::vec3(3e38f))),
                    down = exr("down.exr", Pixels(kWidth * kHeight, glm::vec3(-3e38f)));
  figures({up, down, "-o", at("error.exr")});
  figures({down, up, "-o", at("negative.exr")});
  EXPECT_EQ(readExr(at("error.exr"))->layer("")[0], glm::vec3(std::numeric_limits<float>::max()));
  EXPECT_EQ(readExr(at("negative.exr"))->layer("")[0], glm::vec3(-std::numeric_limits<float>::max()));
  EXPECT_EQ(figures({at("error.exr"), at("error.exr")}).at("rmse"), 0.0);
}

TEST_F(DiffCommand, layersAreNamedAndSummed) {
  ChannelImage image{kWidth, kHeight, {}};
  image.setLayer("Direct", Pixels(kWidth * kHeight, glm::vec3(0.2f)));
  image.setLayer("Indirect", Pixels(kWidth * kHeight, glm::vec3(0.3f)));
  ASSERT_TRUE(writeExr(at("layers.exr"), image));
  expectRefused({half_, at("layers.exr")}, 3, {"layers.exr", "--layer", "Direct", "Indirect"});
  expectRefused({half_, at("layers.exr"), "--layer", "Direct+Glossy"}, 1, {"Glossy", "Indirect"});
  expectRefused({half_, at("layers.exr"), "--layer", "direct"}, 1,
                {"--layer: expected layers of", "layers.exr\", found \"direct\"; it has Direct, Indirect"});
  const auto d = figures({half_, at("layers.exr"), "--layer", "Direct+Indirect"});
  EXPECT_NEAR(d.at("rmse"), 0.0, 1e-6);
  EXPECT_EQ(d.at("referenceChannels"), "Direct+Indirect");
  EXPECT_EQ(d.at("imageChannels"), "R,G,B");
}

TEST_F(DiffCommand, aGreyImageIsReadAndOtherChannelsAreNamed) {
  const auto write = [&](const std::string& name, const std::vector<std::string>& channels) {
    ChannelImage image{kWidth, kHeight, {}};
    for (const std::string& channel : channels) image.channels[channel].assign(kWidth * kHeight, 0.5f);
    EXPECT_TRUE(writeExr(at(name), image));
    return at(name);
  };
  const auto d = figures({write("grey.exr", {"Y"}), half_});
  EXPECT_EQ(d.at("imageChannels"), "Y");
  EXPECT_EQ(d.at("rmse"), 0.0);
  expectRefused({half_, write("coded.exr", {"Y", "RY", "BY"})}, 3, {"coded.exr", "its channels: BY, RY, Y"});
  expectRefused({half_, write("two.exr", {"R", "G"}), "--layer", "Y"}, 3, {"two.exr", "its channels: G, R"});
}

// R, G and B in the place of a layer are of one file, which has none; of both, the name is misspelt.
TEST_F(DiffCommand, aLayerThatNeitherFileHasIsRefused) {
  ChannelImage image{kWidth, kHeight, {}};
  image.setLayer("", Pixels(kWidth * kHeight, glm::vec3(0.5f)));
  image.setLayer("DiffInd", Pixels(kWidth * kHeight, glm::vec3(0.5f)));
  ASSERT_TRUE(writeExr(at("layers.exr"), image));
  for (const char* layer : {"diffind", "Depth"})
    expectRefused({half_, at("layers.exr"), "--layer", layer, "--max-rmse", "0"}, 1,
                  {"--layer", layer, "half.exr\" has none", "layers.exr\" has DiffInd"});
  const std::string flat = png("flat.png", Pixels(kWidth * kHeight, glm::vec3(0.5f)));
  expectRefused({flat, flat, "--layer", "DiffInd"}, 1, {"--layer", "flat.png\" has none"});
  EXPECT_EQ(figures({at("layers.exr"), half_, "--layer", "DiffInd"}).at("referenceChannels"), "R,G,B");
}

// Of one kind of light against all light, which a forgotten --layer compares, the text names the layers; otherwise not.
TEST_F(DiffCommand, layersThatWereNotAskedForAreNamed) {
  ChannelImage image{kWidth, kHeight, {}};
  image.setLayer("", Pixels(kWidth * kHeight, glm::vec3(0.5f)));
  image.setLayer("DiffDir", Pixels(kWidth * kHeight, glm::vec3(0.2f)));
  image.setLayer("DiffInd", Pixels(kWidth * kHeight, glm::vec3(0.3f)));
  image.channels["Depth.R"].resize(kWidth * kHeight);
  ASSERT_TRUE(writeExr(at("all.exr"), image));
  const auto says = [&](const std::vector<std::string>& arguments) {
    const ProgramResult r = run(arguments);
    EXPECT_EQ(r.status, 0) << r.err;
    return r.out.find("for --layer: DiffDir, DiffInd\n") != std::string::npos;
  };
  EXPECT_TRUE(says({"diff", half_, at("all.exr")}));
  EXPECT_FALSE(says({"diff", half_, at("all.exr"), "--layer", "DiffInd"}));
  EXPECT_FALSE(says({"diff", at("all.exr"), at("all.exr")}));
  EXPECT_FALSE(says({"diff", half_, half_}));
}

TEST_F(DiffCommand, refusesWhatCannotBeComparedByName) {
  expectRefused({half_, exr("wide.exr", Pixels(2 * kWidth * kHeight, glm::vec3(0.5f)), "", 2 * kWidth)}, 3,
                {"sizes differ", "half.exr", "24 x 16", "wide.exr", "48 x 16"});
  for (const float wrong : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Pixels pixels(kWidth * kHeight, glm::vec3(0.5f));
    pixels[2 * kWidth + 7].y = wrong;
    expectRefused({half_, exr("wrong.exr", pixels)}, 3, {"wrong.exr", "7,2", "not finite"});
  }
  expectRefused({half_, put("text.exr", "no image at all")}, 3, {"text.exr"});
  expectRefused({half_, put("empty.png", "")}, 3, {"empty.png"});
  expectRefused({half_, put("cut.exr", readAll(half_).substr(0, 200))}, 3, {"cut.exr"});
  const std::string whole = readAll(png("whole.png", Pixels(kWidth * kHeight, glm::vec3(0.5f))));
  expectRefused({at("whole.png"), put("cut.png", whole.substr(0, 40))}, 3, {"cut.png"});
  expectRefused({half_, at("none.exr")}, 2, {"none.exr"});
  expectRefused({half_, folder_.string()}, 2, {folder_.string()});
  expectRefused({half_, half_, "-o", at("error.jpg")}, 1, {".exr", ".png", "error.jpg"});
  expectRefused({half_, half_, "-o", at("no/such/error.png")}, 2, {"error.png"});
}

// Layers side by side may be more than the encoder counts in 32 bits, which then writes beyond its memory.
TEST_F(DiffCommand, aPngOfTooManyPixelsIsRefused) {
  constexpr std::uint32_t kSide = 65536, kRows = 22000;
  constexpr std::size_t kBytes = std::size_t{3} * kSide * kRows;
  void* const zeros = ::mmap(nullptr, kBytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (zeros == MAP_FAILED) GTEST_SKIP() << "no address space";
  const Status written = writePng(at("large.png"), kSide, kRows,
                                  std::span<const std::uint8_t>(static_cast<const std::uint8_t*>(zeros), kBytes));
  ::munmap(zeros, kBytes);
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find("65536 x 22000 pixels are too many for a PNG"), std::string::npos)
      << written.error().message;
}

// An OpenEXR of an uncompressed pixel (or, with another number, a packed one) whose header claims 16384 x 16384.
std::string exrThatClaims(char compression, std::size_t bytes) {
  std::string file("\x76\x2f\x31\x01\x02\0\0\0", 8);
  const auto number = [](std::uint32_t v) { return std::string(reinterpret_cast<const char*>(&v), 4); };
  const auto attribute = [&](const std::string& name, const std::string& type, const std::string& value) {
    file += name + '\0' + type + '\0' + number(static_cast<std::uint32_t>(value.size())) + value;
  };
  std::string channels;
  for (const char* name : {"B", "G", "R"})
    channels += std::string(name, 2) + number(2) + number(0) + number(1) + number(1);
  const std::string window = number(0) + number(0) + number(16383) + number(16383), one = number(0x3f800000u);
  attribute("channels", "chlist", channels + '\0');
  attribute("compression", "compression", std::string(1, compression));
  attribute("dataWindow", "box2i", window);
  attribute("displayWindow", "box2i", window);
  attribute("lineOrder", "lineOrder", std::string(1, '\0'));
  attribute("pixelAspectRatio", "float", one);
  attribute("screenWindowCenter", "v2f", number(0) + number(0));
  attribute("screenWindowWidth", "float", one);
  file += '\0';
  file.resize(bytes, '\0');
  return file;
}

TEST_F(DiffCommand, anImageThatClaimsMoreThanItsFileHoldsIsRefused) {
  for (const char compression : {'\0', '\1', '\3'}) {
    const std::string claims = put("claims.exr", exrThatClaims(compression, 140000));
    expectRefused({claims, half_}, 3, {"claims.exr", "claims 268435456 pixels of 3 channels in 140000 bytes"});
  }
}

TEST_F(DiffCommand, imagesBeyondTheBudgetAreRefusedBeforeTheyAreRead) {
  const std::string large = exr("large.exr", Pixels(1024 * 1024, glm::vec3(0.5f)), "", 1024);
  expectRefused({large, large, "--max-memory", "8M"}, 4, {"diff needs about 12 MiB", "large.exr", "--max-memory"});
  // PIZ, for which no packing is too good: what it claims is beyond any budget of a test machine's.
  const std::string claims = put("claims.exr", exrThatClaims('\4', 140000));
  expectRefused({claims, half_, "--max-memory", "1G"}, 4, {"diff needs about 3072 MiB", "claims.exr"});
}

}  // namespace
}  // namespace relume
