// SPDX-License-Identifier: MIT
// libFuzzer: any text as the JSON that stands beside a bake: a lights file, a report of `relume bake` that compare's
// page shows, the options in a bake's provenance.
#include "bake/base/read_json.h"
#include "bake/scene/check_limits.h"
#include "tests/fuzz/memory_folder.h"
#include "tests/fuzz/mutate.h"
#include "tools/compare/compare_page.h"
#include "tools/compare/compare_report.h"
#include "tools/render/lights_file.h"

#include <cstdlib>

using namespace relume;

namespace {

constexpr const char* kWords[] = {"type",   "name",           "position",       "direction", "color",   "intensity",
                                  "range",  "innerConeAngle", "outerConeAngle", "point",     "spot",    "directional",
                                  "stages", "stage",          "seconds",        "figures",   "options", "links",
                                  "kind",   "peakMemoryMiB",  "<script>",       "&amp;",     "\"",      "\x1b[2J"};

void readLights(std::span<const std::uint8_t> text) {
  const Result<std::vector<SceneLight>> lights = readLightsFile(fuzz::writeToMemory("lights.json", text));
  if (!lights) return;
  Scene scene;
  scene.lights = *lights;
  if (!checkLimits(scene)) std::abort();  // a light of a file is held to what a level's lights are held to
}

void showReport(std::string_view text) {
  const Result<nlohmann::json> json = readJson(text);
  if (!json) return;
  (void)json->dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  if (!json->is_object()) return;
  (void)json->flatten();
  const BakeFile none{};
  const std::string page = reportAsPage(reportSame("a", "b", 1, {}, {}), none, none, nullptr, {*json, *json});
  if (page.find("<script>") != std::string::npos) std::abort();
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  fuzz::Random random(seed);
  const std::string text = fuzz::mutateJson({reinterpret_cast<const char*>(data), size}, max, kWords, random);
  return fuzz::store(fuzz::Bytes(text.begin(), text.end()), data, max);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  readLights({data, size});
  showReport({reinterpret_cast<const char*>(data), size});
  return 0;
}
