// SPDX-License-Identifier: MIT
// The table of options: presets are valid, JSON round-trips and is canonical, every range is enforced at both ends.
#include "relume/bake/options.h"

#include "tests/comma_locale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

namespace relume {
namespace {

TEST(Options, presetsAreValidAndGrow) {
  std::uint32_t surfels = 0;
  std::uint64_t links = 0;
  for (const Preset preset : {Preset::draft, Preset::medium, Preset::high, Preset::best}) {
    const BakeOptions options = presetOptions(preset);
    EXPECT_TRUE(checkOptions(options));
    EXPECT_GT(options.surfels.count, surfels);
    surfels = options.surfels.count;
    const std::uint64_t all = std::uint64_t{options.caches.lightmapCaches} * options.links.linksPerCache;
    EXPECT_GT(all, links);
    links = all;
  }
  EXPECT_TRUE(checkOptions(presetOptions(Preset::web)));
  EXPECT_EQ(optionsToJson(presetOptions(Preset::high)), optionsToJson(BakeOptions{}));
  // PIC Table 2: as many links for every cache.
  const BakeOptions paper = presetOptions(Preset::paper);
  EXPECT_TRUE(checkOptions(paper));
  EXPECT_EQ(paper.surfels.count, 131072u);
  EXPECT_EQ(paper.caches.lightmapCaches, 8281u);
  EXPECT_EQ(paper.links.linksPerCache, 254u);
  EXPECT_EQ(paper.links.maxLinksPerCache, 254u);
  EXPECT_EQ(paper.lumaBands, 4u);
}

TEST(Options, theMostLinksAreNoFewerThanTheMean) {
  BakeOptions options;
  options.links.maxLinksPerCache = options.links.linksPerCache - 1;
  const Status status = checkOptions(options);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::usage);
  EXPECT_NE(status.error().message.find("--max-links) is 127, expected 0 or at least"), std::string::npos)
      << status.error().message;
  options.links.maxLinksPerCache = options.links.linksPerCache;
  EXPECT_TRUE(checkOptions(options));
}

TEST(Options, jsonRoundTripsEveryOption) {
  BakeOptions changed;
  // Change every option to another value of its range, then carry them over by JSON.
  for (const OptionInfo& info : listOptions(changed)) {
    std::string text;
    const std::size_t bar = info.range.find('|');
    if (bar != std::string::npos) {
      const std::string first = info.range.substr(0, bar);
      text = info.value.find(first) == std::string::npos || first.empty() ? first : info.range.substr(bar + 1);
      text = text.substr(0, text.find('|'));
    } else if (info.range.find("each") != std::string::npos) {
      text = "3,4,5";
    } else if (info.value.find('.') != std::string::npos) {
      text = info.range.starts_with("0..1") ? "0.375" : "1.625";
    } else {
      text = info.range.find("..8") != std::string::npos ? "5" : "17";
    }
    const Status status = setOption(changed, info.name, text);
    ASSERT_TRUE(status) << status.error().message;
  }
  const std::vector<OptionInfo> before = listOptions(BakeOptions{}), after = listOptions(changed);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NE(before[i].value, after[i].value) << before[i].name;
  const std::string json = optionsToJson(changed);
  const Result<BakeOptions> again = optionsFromJson(json, BakeOptions{});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(optionsToJson(*again), json);
}

TEST(Options, jsonGivesAnOptionOnce) {
  for (const char* json : {R"({"surfels.count":7000})", R"({"surfels":{"count":7000}})",
                           R"({"surfels":{"count":7000},"surfels.relaxIterations":3})"}) {
    const Result<BakeOptions> read = optionsFromJson(json, BakeOptions{});
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->surfels.count, 7000u);
  }
  for (const char* json :
       {R"({"surfels.count":7000,"surfels":{"count":6000}})", R"({"surfels":{"count":7000},"surfels.count":7000})"}) {
    const Result<BakeOptions> read = optionsFromJson(json, BakeOptions{});
    ASSERT_FALSE(read) << json;
    EXPECT_EQ(read.error().code, ErrorCode::usage);
    EXPECT_EQ(read.error().message,
              "options: surfels.count is given twice, as \"surfels.count\" and in \"surfels\"; keep one of them");
  }
}

TEST(Options, aHostsCommasChangeNothing) {
  const auto write = [] {
    BakeOptions options;
    EXPECT_TRUE(setOption(options, "surfels.candidateFactor", "2.25"));
    EXPECT_FALSE(setOption(options, "surfels.candidateFactor", "2,25"));
    std::string all = optionsToJson(options);
    const Result<BakeOptions> again = optionsFromJson(all, BakeOptions{});
    EXPECT_TRUE(again && again->surfels.candidateFactor == 2.25f);
    for (const OptionInfo& info : listOptions(options)) all += "\n" + info.name + " " + info.value + " " + info.range;
    options.surfels.candidateFactor = 0.125f;
    const Status refused = checkOptions(options);
    return all + "\n" + (refused ? "" : refused.error().message);
  };
  const std::string before = write();
  EXPECT_NE(before.find("2.25"), std::string::npos);
  EXPECT_NE(before.find("0.125"), std::string::npos);
  const test::CommaLocale commas;
  EXPECT_EQ(write(), before);
  if (!commas.ofC()) GTEST_SKIP() << test::kNoCommaLocale;
}

TEST(Options, jsonIsCanonical) {
  const std::string json = optionsToJson(BakeOptions{});
  EXPECT_EQ(json.find_first_of(" \n"), std::string::npos);
  EXPECT_NE(json.find("\"normalWeight\":0.1,"), std::string::npos) << json;  // not 0.10000000149
  EXPECT_LT(json.find("\"caches\""), json.find("\"links\""));
  EXPECT_NE(json.find("\"pull\":\"importance\""), std::string::npos);
}

TEST(Options, rangesAreEnforcedAtBothEnds) {
  struct Case {
    const char* name;
    const char* good;
    const char* bad;
  };
  const Case cases[] = {
      {"playSpace.walks", "1000", "999"},
      {"playSpace.maxBounces", "64", "65"},
      {"surfels.count", "16777216", "16777217"},
      {"surfels.relaxIterations", "1000", "1001"},
      {"surfels.candidateFactor", "1.5", "1.4"},
      {"clustering.normalWeight", "0", "-0.1"},
      {"clustering.normalWeight", "1e6", "3e38"},
      {"caches.gridSpacing", "0", "-1"},
      {"caches.gridCaches", "10000000", "10000001"},
      {"caches.lightmapSize", "16384", "16385"},
      {"caches.lightmapSize", "16", "15"},
      {"caches.maxBackFaceShare", "1", "1.01"},
      {"caches.gutterTexels", "8", "8.5"},
      {"links.linksPerCache", "65535", "65536"},
      {"links.raysPerCache", "16", "15"},
      {"links.bands", "8", "9"},
      {"links.skyPatches", "4096", "4097"},
      {"lumaBands", "8", "9"},
      {"links.maxError", "1", "1.5"},
      {"links.emitterRays", "1", "1.1"},
      {"chromaBands", "1", "0"},
      {"caches.gridResolution", "1024,1,1", "1025,1,1"},
      {"caches.gridResolution", "2,2,2", "2,0,2"},
      {"embreeIsa", "avx512", "neon"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    BakeOptions options;
    options.links.kind = LinkKind::cone;  // compact links reach fewer surfels
    ASSERT_TRUE(setOption(options, c.name, c.good));
    EXPECT_TRUE(checkOptions(options));
    ASSERT_TRUE(setOption(options, c.name, c.bad));
    const Status status = checkOptions(options);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::usage);
    EXPECT_NE(status.error().message.find(c.name), std::string::npos) << status.error().message;
  }
}

// 1e-6 as a float is a little less than 1e-6.
TEST(Options, bothEndsOfARangeAreInIt) {
  int ranges = 0;
  for (const OptionInfo& info : listOptions(BakeOptions{})) {
    const std::size_t dots = info.range.find("..");
    std::vector<std::string> ends;
    if (dots != std::string::npos && info.range.find("each") == std::string::npos && info.name != "seed")
      ends = {info.range.substr(0, dots), info.range.substr(dots + 2)};
    for (const std::string& end : ends) {
      BakeOptions options;
      ASSERT_TRUE(setOption(options, info.name, end)) << info.name << " " << end;
      const Status status = checkOptions(options);
      // What options must be to each other is another matter, and names two of them.
      EXPECT_TRUE(status || status.error().message.find(" is " + end + ", expected " + info.range) == std::string::npos)
          << status.error().message;
      ++ranges;
    }
  }
  EXPECT_GT(ranges, 30);
}

TEST(Options, numbersThatAreNotFiniteAreRefused) {
  for (const float value : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    BakeOptions options;
    options.clustering.balanceWeight = value;
    EXPECT_FALSE(checkOptions(options));
  }
}

// A flag's text is read as compare reads its bounds; JSON stays JSON.
TEST(Options, textIsANumberWithoutAllOfItsDigits) {
  const auto read = [](const char* text) {
    BakeOptions options;
    const Status status = setOption(options, "links.maxError", text);
    return status ? optionsToJson(options) : status.error().message;
  };
  for (const char* half : {".5", "+0.5", "+.5", "00.5", "5.e-1", "0.5"}) EXPECT_EQ(read(half), read("0.50")) << half;
  EXPECT_EQ(read("1."), read("1"));
  for (const char* none : {"", ".", "+", "+-0.5", "++1", ".5x", "0,5", "nan", "inf", "1e999", "0x1"}) {
    EXPECT_NE(read(none).find("(--link-error): expected a number, 0..1, found \"" + std::string(none) + "\""),
              std::string::npos)
        << read(none);
  }
  BakeOptions options;
  EXPECT_FALSE(setOption(options, "surfels.count", "+300"));
  EXPECT_FALSE(optionsFromJson("{\"links\":{\"maxError\":.5}}", options));
}

TEST(Options, namesAndFlagsAreUnique) {
  std::set<std::string> names, flags;
  for (const OptionInfo& info : listOptions(BakeOptions{})) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_TRUE(info.flag.empty() || flags.insert(info.flag).second) << info.flag;
    EXPECT_FALSE(info.comment.empty());
  }
  EXPECT_FALSE(setOption(*std::make_unique<BakeOptions>(), "surfels", "1"));
}

}  // namespace
}  // namespace relume
