// SPDX-License-Identifier: MIT
// kAlgorithmVersion is raised whenever a bake's bytes can change: the sample level is baked with each value of each
// option that is a choice, and with others that take a path of their own; the sums of the bytes are held against
// algorithm_version.txt, one line a set: its name, the version of the algorithm, the version of the format, the sum.
// RELUME_STORE_ALGORITHM=1 in the environment writes that file anew; it refuses to give new sums to an old version.
#include "formats/chunks.h"
#include "formats/decimal.h"
#include "relume/bake/bake.h"
#include "relume/bake/provenance.h"
#include "relume/bake_file.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace relume {
namespace {

constexpr const char* kStored = RELUME_SOURCE_DIR "/tests/pipeline/algorithm_version.txt";
constexpr const char* kHowToStore =
    "To store the new sums: RELUME_STORE_ALGORITHM=1 build/release/tests/pipeline/test_algorithm_version";

// Options that differ from tinyBakeOptions(), as names and texts of the table of options.
using OptionSet = std::vector<std::pair<std::string, std::string>>;

struct Line {
  std::uint32_t algorithm = 0, format = 0;
  std::string sum;
  bool operator==(const Line&) const = default;
};

std::string textOf(const Line& line) {
  return std::to_string(line.algorithm) + " " + std::to_string(line.format) + " " + line.sum;
}

std::string nameOf(const OptionSet& set) {
  std::string name;
  for (const auto& [option, value] : set) name += (name.empty() ? "" : "+") + option + "=" + value;
  return name.empty() ? "tiny" : name;
}

// Every value of every option that is a choice or a switch. Not the instruction set: a processor may lack one.
void addChoices(std::vector<OptionSet>& sets) {
  for (const OptionInfo& option : listOptions(test::tinyBakeOptions())) {
    if (option.range.find('|') == std::string::npos || option.name == "embreeIsa") continue;
    std::istringstream values(option.range);
    for (std::string value; std::getline(values, value, '|');) sets.push_back({{option.name, value}});
  }
}

std::vector<OptionSet> optionSets() {
  std::vector<OptionSet> sets = {{}};
  addChoices(sets);
  // Numbers whose zero, or other end, is an algorithm of its own.
  sets.push_back({{"caches.gridResolution", "3,2,2"}});
  sets.push_back({{"caches.gridSpacing", "1.5"}});
  sets.push_back({{"caches.gridCaches", "0"}});
  sets.push_back({{"caches.lightmapCaches", "0"}});
  sets.push_back({{"caches.lightmapSize", "32"}});
  sets.push_back({{"caches.gutterTexels", "2"}});
  sets.push_back({{"links.emitterRays", "0"}});
  sets.push_back({{"links.maxError", "0.2"}});
  sets.push_back({{"links.linksTotal", "300"}});
  sets.push_back({{"links.maxLinksPerCache", "16"}});
  sets.push_back({{"links.skyPatches", "0"}});
  sets.push_back({{"links.kind", "sh"}, {"links.bands", "8"}, {"lumaBands", "4"}});
  sets.push_back({{"surfels.count", "2048"}, {"links.linksPerCache", "64"}, {"links.raysPerCache", "256"}});
  // The target that is not used for a given size still chooses how rays are traced: thorough, and in bundles.
  for (const char* rays : {"128", "256"})
    sets.push_back({{"caches.lightmapSize", "32"}, {"caches.lightmapCaches", "1000000"}, {"links.raysPerCache", rays}});
  sets.push_back({{"seed", "2"}});
  return sets;
}

// FNV-1a.
std::string sumOf(std::span<const std::byte> bytes) {
  std::uint64_t sum = 0xcbf29ce484222325u;
  for (const std::byte b : bytes) sum = (sum ^ static_cast<std::uint64_t>(b)) * 0x100000001b3u;
  return hexadecimal(sum);
}

// The sum of a bake without what names the program and its packages, and without the texts of options: an option more,
// whose default does what was done before, is no other algorithm.
std::string bakeSum(const Scene& scene, const OptionSet& set, Context& context) {
  BakeOptions options = test::tinyBakeOptions();
  for (const auto& [name, value] : set) {
    const Status status = setOption(options, name, value);
    EXPECT_TRUE(status) << (status ? "" : status.error().message);
  }
  Result<Bake> baked = bake(scene, options, context);
  if (!baked) return baked.error().message;
  baked->provenance.toolVersion = baked->provenance.optionsJson = baked->provenance.rayTracer = "";
  baked->provenance.algorithmVersion = 0;
  const Result<std::vector<std::byte>> bytes = serializeBake(*baked);
  return bytes ? sumOf(*bytes) : bytes.error().message;
}

std::map<std::string, Line> bakeAll() {
  std::map<std::string, Line> lines;
  Context context;
  const Result<Scene> scene = importGltf(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", context);
  EXPECT_TRUE(scene);
  if (!scene) return lines;
  for (const OptionSet& set : optionSets())
    lines[nameOf(set)] = {kAlgorithmVersion, kBakeFormatVersion, bakeSum(*scene, set, context)};
  return lines;
}

std::map<std::string, Line> readStored() {
  std::map<std::string, Line> lines;
  std::ifstream file(kStored);
  for (std::string text; std::getline(file, text);) {
    if (text.empty() || text[0] == '#') continue;
    std::istringstream words(text);
    std::string name;
    Line line;
    EXPECT_TRUE(words >> name >> line.algorithm >> line.format >> line.sum) << kStored << ": " << text;
    lines[name] = line;
  }
  return lines;
}

// What is wrong with a stored line; empty when nothing is.
std::string judge(const Line& stored, const Line& now) {
  if (stored == now) return "";
  if (stored.algorithm != now.algorithm || stored.format != now.format)
    return "kAlgorithmVersion or kBakeFormatVersion was raised and the sums are of the old one.";
  return "the bytes of a bake changed: raise kAlgorithmVersion (provenance.h), say in CHANGELOG.md what must be "
         "rebaked, and store the new sums.";
}

void store(const std::map<std::string, Line>& lines) {
  std::ofstream file(kStored);
  file << "# Sums of bakes of samples/level/two_rooms.glb: options, kAlgorithmVersion, kBakeFormatVersion, FNV-1a of "
          "the\n"
          "# bytes. Written by algorithm_version_test.cpp, which says when and how.\n";
  for (const auto& [name, line] : lines) file << name << " " << textOf(line) << "\n";
  EXPECT_TRUE(file.flush()) << kStored << " cannot be written";
}

TEST(AlgorithmVersion, isRaisedWhenBytesChange) {
  const char* const asked = std::getenv("RELUME_STORE_ALGORITHM");
  const bool storing = asked != nullptr && std::string_view(asked) == "1";
  const std::map<std::string, Line> stored = readStored(), now = bakeAll();
  for (const auto& [name, line] : now) {
    const auto old = stored.find(name);
    if (old == stored.end()) {
      EXPECT_TRUE(storing) << name << " is new: " << textOf(line) << "\n" << kHowToStore;
      continue;
    }
    const std::string wrong = judge(old->second, line);
    const bool raised = old->second.algorithm != line.algorithm || old->second.format != line.format;
    EXPECT_TRUE(wrong.empty() || (storing && raised))
        << name << ": " << textOf(old->second) << " stored, " << textOf(line) << " found: " << wrong << "\n"
        << kHowToStore;
  }
  for (const auto& [name, line] : stored)
    EXPECT_TRUE(storing || now.contains(name)) << name << " is stored and no longer baked.\n" << kHowToStore;
  if (storing && !HasFailure()) store(now);
}

}  // namespace
}  // namespace relume
