// SPDX-License-Identifier: MIT
// libFuzzer: text that begins with '{' as an options file, other text as the value of one option of the command line,
// which its first byte chooses. What is read must come back from its own JSON unchanged.
#include "relume/bake/options.h"
#include "tests/fuzz/mutate.h"

#include <cstdlib>

using namespace relume;

namespace {

constexpr const char* kNames[] = {"surfels.count",      "caches.gridResolution", "links.kind",          "embreeIsa",
                                  "caches.gridSpacing", "playSpace.mode",        "caches.useTexcoord1", "seed",
                                  "lumaBands",          "links.raysPerCache",    "no.such.option"};
constexpr const char* kWords[] = {"surfels",
                                  "count",
                                  "placement",
                                  "halton",
                                  "relaxed",
                                  "eliminated",
                                  "relaxIterations",
                                  "candidateFactor",
                                  "clustering",
                                  "method",
                                  "exact",
                                  "approximate",
                                  "caches",
                                  "gridResolution",
                                  "gridSpacing",
                                  "gridCaches",
                                  "lightmapSize",
                                  "lightmapCaches",
                                  "minChartTexels",
                                  "useTexcoord1",
                                  "links",
                                  "kind",
                                  "cone",
                                  "sh",
                                  "oct6",
                                  "irradiance",
                                  "bands",
                                  "linksPerCache",
                                  "raysPerCache",
                                  "skyPatches",
                                  "pull",
                                  "importance",
                                  "area",
                                  "key",
                                  "playSpace",
                                  "mode",
                                  "seen",
                                  "all",
                                  "walks",
                                  "maxBounces",
                                  "seed",
                                  "lumaBands",
                                  "chromaBands",
                                  "embreeIsa",
                                  "avx2",
                                  "avx512",
                                  "sse2"};

void readFile(const std::string& text) {
  const Result<BakeOptions> options = optionsFromJson(text, presetOptions(Preset::high));
  if (!options || !checkOptions(*options)) return;
  const std::string json = optionsToJson(*options);
  const Result<BakeOptions> again = optionsFromJson(json, BakeOptions{});
  if (!again || optionsToJson(*again) != json) std::abort();
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  fuzz::Random random(seed);
  if (size == 0 || data[0] != '{') {
    fuzz::Bytes bytes(data, data + size);
    fuzz::mutateBytes(bytes, std::min<std::size_t>(max, 64));
    return fuzz::store(bytes, data, max);
  }
  const std::string text = fuzz::mutateJson({reinterpret_cast<const char*>(data), size}, max, kWords, random);
  return fuzz::store(fuzz::Bytes(text.begin(), text.end()), data, max);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (data[0] == '{') {
    readFile(text);
  } else {
    BakeOptions target;
    (void)static_cast<bool>(setOption(target, kNames[data[0] % std::size(kNames)], text.substr(1)));
  }
  return 0;
}
