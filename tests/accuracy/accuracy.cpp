// SPDX-License-Identifier: MIT
// The accuracy suite: bakes each level with the `relume` binary, once a setting, renders every reference's camera and
// lights, and compares. Prints tables, writes them as Markdown on request, and fails when a figure is above its bound
// (levels.h).
// Indirect light answers to DiffInd; of emitters, `bounced` answers to DiffInd and `indirect` to DiffDir + DiffInd.
#include "tests/accuracy/compare_images.h"
#include "tests/accuracy/levels.h"
#include "tests/accuracy/report.h"
#include "tests/long_tests.h"
#include "tools/images/image_io.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

extern char** environ;

namespace relume {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string relume, shared, source, work, report, date, seed;
  std::vector<std::string> levels, settings{"paper"}, preview;
  bool all = false, reuse = false;

  // The run by default: rows that could not fail are of the others.
  bool holdsBoundsAlone() const { return !all && levels.empty() && settings == std::vector<std::string>{"paper"}; }
};

// Run a program to its end; its exit status, or -1.
int run(const std::vector<std::string>& words) {
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  std::fflush(nullptr);
  if (posix_spawnp(&child, argv[0], nullptr, nullptr, argv.data(), environ) != 0) return -1;
  int status = 0;
  if (waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

Status runRelume(const Arguments& arguments, std::vector<std::string> words) {
  words.insert(words.begin(), arguments.relume);
  const int status = run(words);
  if (status == 0) return done();
  std::string line;
  for (const std::string& word : words) line += word + ' ';
  return Error{ErrorCode::failed, "exit status " + std::to_string(status) + " of: " + line};
}

// "<camera>__<light>[+<light>...][__1bounce]", taken apart.
struct View {
  std::string camera, lights, bounces = "converged";
  bool emissive = false;
};

Result<View> parseName(const std::string& stem) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t at; (at = stem.find("__", begin)) != std::string::npos; begin = at + 2)
    parts.push_back(stem.substr(begin, at - begin));
  parts.push_back(stem.substr(begin));
  if (parts.size() == 3 && parts[2] == "1bounce")
    parts.pop_back();
  else if (parts.size() != 2)
    return Error{ErrorCode::invalidFile, "\"" + stem + "\": <camera>__<lights>[__1bounce] expected"};
  View view{parts[0], parts[1]};
  std::replace(view.lights.begin(), view.lights.end(), '+', ',');
  view.emissive = ("," + view.lights + ",").find(",emissive,") != std::string::npos;
  // `render` counts frames: punctual light is reflected once in the first, an emitter's light in the second.
  if (stem.ends_with("__1bounce")) view.bounces = view.emissive ? "2" : "1";
  return view;
}

const AccuracyBound* boundOf(const AccuracySetting& setting, const std::string& image, const std::string& aov) {
  for (const AccuracyBound& bound : kAccuracyBounds) {
    if (std::string_view(bound.setting) == setting.name && bound.image == image && bound.aov == aov) return &bound;
  }
  return nullptr;
}

bool isWithin(const ImageDifference& d, const AccuracyBound* bound) {
  if (d.nonfinite > 0) return false;
  if (bound == nullptr) return true;
  return (bound->rmseClean <= 0 || d.rmseClean <= bound->rmseClean) &&
         (bound->rmseTrimmed <= 0 || d.rmseTrimmed <= bound->rmseTrimmed) &&
         (bound->energy <= 0 || std::abs(d.energy - 1.0) <= bound->energy);
}

// The command that draws a view.
std::vector<std::string> drawCommand(const Arguments& arguments, const AccuracySetting& setting, const fs::path& scene,
                                     const fs::path& bake, const View& view) {
  const bool preview = *setting.source != 0;
  std::vector<std::string> words{
      preview ? "preview" : "render", scene.string(), "--camera", view.camera, "--lights", view.lights};
  const auto add = [&words](const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  if (*setting.bake != 0) add({"--bake", bake.string()});
  if (*setting.bake == 0 && !preview) words.push_back("--live");
  if (*setting.transport != 0) add({"--live-transport", setting.transport});
  if (preview) {
    add({"--source", setting.source});
    add(arguments.preview);
  } else {
    add({"--bounces", view.bounces});
  }
  return words;
}

// Render one reference's view and compare; a row per quantity.
Status compareView(const Arguments& arguments, const AccuracyLevel& level, const AccuracySetting& setting,
                   const fs::path& scene, const fs::path& bake, const fs::path& referencePath,
                   std::vector<AccuracyRow>& rows) {
  const auto reference = readExr(referencePath);
  if (!reference) return reference.error();
  const auto view = parseName(referencePath.stem().string());
  if (!view) return view.error();
  std::vector<std::pair<std::string, std::vector<std::string>>> quantities{{"indirect", {"DiffInd"}}};
  if (view->emissive) quantities = {{"bounced", {"DiffInd"}}, {"indirect", {"DiffDir", "DiffInd"}}};
  // Reflective shadow maps are of punctual lights.
  if (*setting.transport != 0 && view->emissive) return done();
  // A preview reflects light once, or until it converges.
  if (*setting.source != 0 && (view->bounces != "converged") != (*setting.bake == 0)) return done();

  for (const auto& [aov, layers] : quantities) {
    const std::string compared = std::string(level.name) + "/" + referencePath.stem().string();
    const AccuracyBound* const bound = boundOf(setting, compared, aov);
    if (bound == nullptr && arguments.holdsBoundsAlone()) continue;
    const fs::path image = fs::path(arguments.work) / (std::string(level.name) + "." + setting.name + "." +
                                                       referencePath.stem().string() + "." + aov + ".exr");
    const std::string size = std::to_string(reference->width) + "x" + std::to_string(reference->height);
    std::vector<std::string> words = drawCommand(arguments, setting, scene, bake, *view);
    words.insert(words.end(), {"--aov", aov, "--size", size, "--progress", "none", "-o", image.string()});
    if (Status drawn = runRelume(arguments, words); !drawn) return drawn;
    const auto candidate = readExr(image);
    if (!candidate) return candidate.error();
    CompareOptions options;
    options.layers = layers;
    const auto difference = compareImages(*reference, *candidate, options);
    if (!difference) return Error{difference.error().code, image.string() + ": " + difference.error().message};
    rows.push_back({compared, aov, *difference, bound, isWithin(*difference, bound)});
  }
  return done();
}

// What `relume bake --report` says of a bake.
Result<AccuracyBake> readBakeReport(const std::string& level, const fs::path& path) {
  std::ifstream file(path);
  const nlohmann::json json = nlohmann::json::parse(file, nullptr, false);
  if (json.is_discarded() || !json.contains("seconds")) {
    return Error{ErrorCode::invalidFile, path.string() + ": a report of `relume bake` expected"};
  }
  AccuracyBake bake{level, json["seconds"], json["peakMemoryMiB"], json["surfels"], json["caches"], json["links"], 0};
  for (const nlohmann::json& stage : json["stages"]) {
    if (stage["figures"].contains("triangles"))
      bake.triangles = static_cast<std::uint64_t>(stage["figures"]["triangles"].get<double>());
  }
  return bake;
}

Status measureLevel(const Arguments& arguments, const AccuracyLevel& level, const AccuracySetting& setting,
                    AccuracyTable& table) {
  const fs::path scene = fs::path(level.shipped ? arguments.source : arguments.shared) / level.scene;
  const fs::path folder = level.shipped ? fs::path(arguments.source) / "tests/accuracy/references" / level.name
                                        : fs::path(arguments.shared) / "references" / level.name;
  if (!fs::exists(scene) || !fs::is_directory(folder)) {
    std::printf("%s skipped: needs %s and %s\n", level.name, scene.c_str(), folder.c_str());
    return done();
  }
  std::vector<fs::path> references;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".exr") references.push_back(entry.path());
  }
  std::sort(references.begin(), references.end());

  const bool isPreset = *setting.bake != '-';
  const std::string stem = std::string(level.name) + "." + (isPreset ? setting.bake : setting.name);
  const fs::path bake = fs::path(arguments.work) / (stem + ".relume"),
                 report = fs::path(arguments.work) / (stem + ".json");
  if (*setting.bake == 0) {
    for (const fs::path& reference : references) {
      if (Status ok = compareView(arguments, level, setting, scene, bake, reference, table.rows); !ok) return ok;
    }
    return done();
  }
  if (!arguments.reuse || !fs::exists(bake) || !fs::exists(report)) {
    std::vector<std::string> words{"bake",          scene.string(), "-o",         bake.string(), "--report",
                                   report.string(), "--force",      "--progress", "none"};
    const std::vector<std::string> options = bakeOptionsOf(level, setting);
    words.insert(words.end(), options.begin(), options.end());
    if (!arguments.seed.empty()) words.insert(words.end(), {"--seed", arguments.seed});
    if (Status baked = runRelume(arguments, words); !baked) return baked;
  }
  const Result<AccuracyBake> baked = readBakeReport(level.name, report);
  if (!baked) return baked.error();
  table.bakes.push_back(*baked);
  fs::path drawn = bake;
  if (*setting.pack != 0) {
    drawn.replace_extension(".packed.relume");
    if (Status packed = runRelume(
            arguments, {"pack", bake.string(), "-o", drawn.string(), "--profile", setting.pack, "--keep-coordinates"});
        !packed)
      return packed;
  }
  for (const fs::path& reference : references) {
    if (Status ok = compareView(arguments, level, setting, scene, drawn, reference, table.rows); !ok) return ok;
  }
  return done();
}

int measure(const Arguments& arguments) {
  std::error_code ec;
  fs::create_directories(arguments.work, ec);
  std::vector<AccuracyTable> tables;
  bool failed = false, empty = true;
  for (const AccuracySetting& setting : kAccuracySettings) {
    if (std::count(arguments.settings.begin(), arguments.settings.end(), setting.name) == 0) continue;
    AccuracyTable& table = tables.emplace_back(AccuracyTable{&setting, {}, {}});
    for (const AccuracyLevel& level : kAccuracyLevels) {
      const bool named = std::count(arguments.levels.begin(), arguments.levels.end(), level.name) > 0;
      if (!named && (!arguments.levels.empty() || !(arguments.all || level.quick))) continue;
      if (const Status ok = measureLevel(arguments, level, setting, table); !ok) {
        std::fprintf(stderr, "accuracy: %s: %s\n", level.name, ok.error().message.c_str());
        failed = true;
      }
    }
    std::printf("%s\n%s\n", setting.title, accuracyRows(table).c_str());
    for (const AccuracyRow& row : table.rows) failed = failed || !row.passed;
    empty = empty && table.rows.empty();
  }
  if (!arguments.report.empty()) {
    std::ofstream(arguments.report) << accuracyReport(tables, arguments.date);
    std::printf("wrote %s\n", arguments.report.c_str());
  }
  if (empty) std::fprintf(stderr, "accuracy: nothing was measured\n");
  return failed || empty ? 1 : 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  relume::Arguments arguments;
  CLI::App app{"Compares relit views with path-traced references.", "accuracy"};
  app.add_option("--relume", arguments.relume, "the relume binary")->required();
  app.add_option("--shared", arguments.shared, "folder with scenes/ and references/");
  app.add_option("--source", arguments.source, "the project's folder, with samples/ and tests/accuracy/references/");
  app.add_option("--work", arguments.work, "folder for bakes and images")->required();
  app.add_option("--levels", arguments.levels, "only these levels, separated by commas")->delimiter(',');
  std::vector<std::string> names;
  for (const relume::AccuracySetting& setting : relume::kAccuracySettings) names.push_back(setting.name);
  app.add_option(
         "--settings", arguments.settings,
         "how to bake and draw: paper, medium, web, high, best, preview, preview_surfels, preview_direct, live, "
         "live_rsm, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  app.add_option("--preview", arguments.preview, "more options of `relume preview`, separated by commas")
      ->delimiter(',');
  app.add_option("--seed", arguments.seed, "of the bakes' random numbers, for how far figures are of one set of them");
  app.add_option("--report", arguments.report, "write the table as Markdown");
  app.add_option("--date", arguments.date, "date named in the report");
  app.add_flag("--all", arguments.all, "all levels; also by RELUME_LONG_TESTS=1 in the environment");
  app.add_flag("--reuse", arguments.reuse, "use bakes that lie in the work folder");
  CLI11_PARSE(app, argc, argv);
  if (relume::test::longTests()) arguments.all = true;
  return relume::measure(arguments);
}
