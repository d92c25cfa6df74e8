// SPDX-License-Identifier: MIT
// The accuracy suite: bakes each level once with the `relume` binary, renders every reference's camera and lights, and
// compares. Prints a table, writes it as Markdown on request, and fails when a figure is above its bound (levels.h).
// Indirect light answers to DiffInd; of emitters, `bounced` answers to DiffInd and `indirect` to DiffDir + DiffInd.
#include "bake/tools/image_io.h"
#include "tests/accuracy/compare_images.h"
#include "tests/accuracy/levels.h"

#include <CLI/CLI.hpp>

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
  std::string relume, shared, source, work, report, date;
  std::vector<std::string> levels;
  bool all = false, reuse = false;
};

struct Row {
  std::string image, aov;
  ImageDifference difference;
  const AccuracyBound* bound = nullptr;
  bool passed = true;
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
  if (parts.size() == 3 && parts[2] == "1bounce") parts.pop_back();
  else if (parts.size() != 2)
    return Error{ErrorCode::invalidFile, "\"" + stem + "\": <camera>__<lights>[__1bounce] expected"};
  View view{parts[0], parts[1]};
  std::replace(view.lights.begin(), view.lights.end(), '+', ',');
  view.emissive = ("," + view.lights + ",").find(",emissive,") != std::string::npos;
  // `render` counts frames: punctual light is reflected once in the first, an emitter's light in the second.
  if (stem.ends_with("__1bounce")) view.bounces = view.emissive ? "2" : "1";
  return view;
}

const AccuracyBound* boundOf(const std::string& image, const std::string& aov) {
  for (const AccuracyBound& bound : kAccuracyBounds) {
    if (bound.image == image && bound.aov == aov) return &bound;
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

// Render one reference's view and compare; a row per quantity.
Status compareView(const Arguments& arguments, const AccuracyLevel& level, const fs::path& scene, const fs::path& bake,
                   const fs::path& referencePath, std::vector<Row>& rows) {
  const auto reference = readExr(referencePath);
  if (!reference) return reference.error();
  const auto view = parseName(referencePath.stem().string());
  if (!view) return view.error();
  std::vector<std::pair<std::string, std::vector<std::string>>> quantities{{"indirect", {"DiffInd"}}};
  if (view->emissive) quantities = {{"bounced", {"DiffInd"}}, {"indirect", {"DiffDir", "DiffInd"}}};

  for (const auto& [aov, layers] : quantities) {
    const fs::path image = fs::path(arguments.work) / (std::string(level.name) + "." + referencePath.stem().string() + "." + aov + ".exr");
    const std::string size = std::to_string(reference->width) + "x" + std::to_string(reference->height);
    Status drawn = runRelume(arguments, {"render", scene.string(), "--bake", bake.string(), "--camera", view->camera,
                                         "--lights", view->lights, "--bounces", view->bounces, "--aov", aov, "--size",
                                         size, "--progress", "none", "-o", image.string()});
    if (!drawn) return drawn;
    const auto candidate = readExr(image);
    if (!candidate) return candidate.error();
    CompareOptions options;
    options.layers = layers;
    const auto difference = compareImages(*reference, *candidate, options);
    if (!difference) return Error{difference.error().code, image.string() + ": " + difference.error().message};
    Row row{std::string(level.name) + "/" + referencePath.stem().string(), aov, *difference, nullptr, true};
    row.bound = boundOf(row.image, aov);
    row.passed = isWithin(row.difference, row.bound);
    rows.push_back(row);
  }
  return done();
}

Status measureLevel(const Arguments& arguments, const AccuracyLevel& level, std::vector<Row>& rows) {
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

  const fs::path bake = fs::path(arguments.work) / (std::string(level.name) + ".relume");
  if (!arguments.reuse || !fs::exists(bake)) {
    std::vector<std::string> words{"bake", scene.string(), "-o", bake.string(), "--progress", "none"};
    words.insert(words.end(), level.bakeOptions.begin(), level.bakeOptions.end());
    if (Status baked = runRelume(arguments, words); !baked) return baked;
  }
  for (const fs::path& reference : references) {
    if (Status ok = compareView(arguments, level, scene, bake, reference, rows); !ok) return ok;
  }
  return done();
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", 100.0 * share);
  return text;
}

std::string boundText(const AccuracyBound* bound) {
  if (bound == nullptr) return "";
  std::string text;
  if (bound->rmseClean > 0) text += "rmse ≤ " + percent(bound->rmseClean);
  if (bound->rmseTrimmed > 0) text += std::string(text.empty() ? "" : ", ") + "t1 ≤ " + percent(bound->rmseTrimmed);
  if (bound->energy > 0) text += std::string(text.empty() ? "" : ", ") + "energy ± " + percent(bound->energy);
  return text;
}

std::string table(const std::vector<Row>& rows) {
  std::string text =
      "| reference | quantity | rmse % | t1 % | energy | p95 % | noise % | bound % | |\n"
      "| --- | --- | ---: | ---: | ---: | ---: | ---: | --- | --- |\n";
  for (const Row& row : rows) {
    char energy[32];
    std::snprintf(energy, sizeof energy, "%.3f", row.difference.energy);
    const ImageDifference& d = row.difference;
    text += "| `" + row.image + "` | " + row.aov + " | " + percent(d.rmseClean) + " | " + percent(d.rmseTrimmed) + " | " +
            energy + " | " + percent(d.blockP95) + " | " + percent(d.noise) + " | " + boundText(row.bound) + " | " +
            (row.passed ? (row.bound ? "ok" : "") : "**above**") + " |\n";
  }
  return text;
}

std::string reportText(const Arguments& arguments, const std::vector<Row>& rows) {
  std::string text =
      "# Accuracy\n\n"
      "Relume's light against path-traced references (Cycles; `two_rooms`: `relume reference`), made by "
      "`tests/accuracy`" + (arguments.date.empty() ? std::string() : " on " + arguments.date) + ".\n\n"
      "`rmse` is the relative root mean square error with the reference's own noise removed, `t1` the same without the "
      "worst 1 % of the pixels, `energy` the sum of light over the reference's, `p95` the 95th percentile of the "
      "relative error of 4 x 4 pixel blocks, `noise` what the reference itself is off by. `indirect` is reflected light "
      "(of emitters: all their light), `bounced` only what was reflected. Pixels at edges, of emitters and of nearly "
      "black surfaces do not count.\n\n" + table(rows) + "\n## How they were baked\n\n";
  for (const AccuracyLevel& level : kAccuracyLevels) {
    const auto shown = [&](const Row& row) { return row.image.starts_with(std::string(level.name) + "/"); };
    if (std::none_of(rows.begin(), rows.end(), shown)) continue;
    text += std::string("- `") + level.name + "`: `relume bake";
    for (const std::string& word : level.bakeOptions) text += " " + word;
    text += "`\n";
  }
  bool first = true;
  for (const AccuracyNote& note : kAccuracyNotes) {
    const auto shown = [&](const Row& row) { return row.image.starts_with(std::string(note.level) + "/"); };
    if (std::none_of(rows.begin(), rows.end(), shown)) continue;
    if (first) text += "\n## Notes\n\n";
    first = false;
    text += std::string("- `") + note.level + "`: " + note.text + "\n";
  }
  return text;
}

int measure(const Arguments& arguments) {
  std::error_code ec;
  fs::create_directories(arguments.work, ec);
  std::vector<Row> rows;
  bool failed = false;
  for (const AccuracyLevel& level : kAccuracyLevels) {
    const bool named = std::count(arguments.levels.begin(), arguments.levels.end(), level.name) > 0;
    if (!named && (!arguments.levels.empty() || !(arguments.all || level.quick))) continue;
    if (const Status ok = measureLevel(arguments, level, rows); !ok) {
      std::fprintf(stderr, "accuracy: %s: %s\n", level.name, ok.error().message.c_str());
      failed = true;
    }
  }
  std::printf("%s", table(rows).c_str());
  for (const Row& row : rows) failed = failed || !row.passed;
  if (!arguments.report.empty()) {
    std::ofstream(arguments.report) << reportText(arguments, rows);
    std::printf("wrote %s\n", arguments.report.c_str());
  }
  if (rows.empty()) std::fprintf(stderr, "accuracy: nothing was measured\n");
  return failed || rows.empty() ? 1 : 0;
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
  app.add_option("--report", arguments.report, "write the table as Markdown");
  app.add_option("--date", arguments.date, "date named in the report");
  app.add_flag("--all", arguments.all, "all levels; also by RELUME_LONG_TESTS=1 in the environment");
  app.add_flag("--reuse", arguments.reuse, "use bakes that lie in the work folder");
  CLI11_PARSE(app, argc, argv);
  const char* longTests = std::getenv("RELUME_LONG_TESTS");
  if (longTests != nullptr && std::string(longTests) == "1") arguments.all = true;
  return relume::measure(arguments);
}
