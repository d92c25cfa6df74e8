// SPDX-License-Identifier: MIT
// relume compare A B: do two bakes differ, in what, and does it matter for light? Exit status 7 when a bound is
// exceeded.
#include "bake/base/memory_budget.h"
#include "bake/base/read_json.h"
#include "bake/import/gltf_file.h"
#include "formats/chunks.h"
#include "formats/validate.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/base/number_check.h"
#include "tools/base/output_files.h"
#include "tools/base/printable.h"
#include "tools/base/usage_message.h"
#include "tools/cli/commands.h"
#include "tools/cli/reserve_bake.h"
#include "tools/cli/terminal.h"
#include "tools/compare/compare_light.h"
#include "tools/compare/compare_page.h"
#include "tools/compare/compare_report.h"
#include "tools/compare/fit_bake.h"
#include "tools/compare/staleness.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using Json = nlohmann::json;

struct CompareArguments {
  std::string a, b;
  CompareBounds bounds;
  std::vector<std::string> ignore;  // as they were given
  std::string scene, page, runA, runB;
  bool allowStale = false, json = false, force = false;
  TerminalOptions terminal;
};

// Read and check whole: light is relit from every number of it. Not mapped, for a file that is cut short meanwhile
// would end the process.
Result<BakeFile> readChecked(const std::string& path, Context& context) {
  if (Status ok = reserveBake(context, "compare", path); !ok) return ok.error();
  Result<Bake> bake = readBake(path);
  if (!bake) return bake.error();
  for (const Finding& finding : validateBake(*bake)) {
    if (finding.severity == FindingSeverity::error)
      return Error{ErrorCode::invalidFile, path + ": " + toString(finding)};
  }
  Result<std::vector<ChunkInfo>> chunks = listChunks(path);
  if (!chunks) return chunks.error();
  return BakeFile{path, std::move(*bake), std::move(*chunks)};
}

// The table's hashes cover every byte of the data.
bool sameBytes(const BakeFile& a, const BakeFile& b) {
  return std::equal(a.chunks.begin(), a.chunks.end(), b.chunks.begin(), b.chunks.end(),
                    [](const ChunkInfo& x, const ChunkInfo& y) {
                      return x.name == y.name && x.shape == y.shape && x.offset == y.offset && x.hash == y.hash;
                    });
}

std::uint64_t sizeOf(const BakeFile& file) {
  return file.chunks.empty() ? 0 : file.chunks.back().offset + file.chunks.back().bytes;
}

// What `relume bake --report` wrote; null without a file.
Result<Json> readRun(const std::string& path) {
  if (path.empty()) return Json();
  constexpr std::size_t kMaxReportBytes = 16 << 20;
  const Result<FileBytes> file = readFile(path, kMaxReportBytes);
  if (!file) return file.error();
  const auto* text = reinterpret_cast<const char*>(file->bytes.data());
  Result<Json> json = readJson({text, file->bytes.size()});
  if (!json) return Error{ErrorCode::invalidFile, path + ": " + json.error().message};
  if (!json->is_object() || !json->contains("stages") || !(*json)["stages"].is_array())
    return Error{ErrorCode::invalidFile,
                 path + ": expected a report of relume bake --report, a JSON object with a list of \"stages\""};
  return json;
}

CommandFiles filesOf(const CompareArguments& arguments) {
  CommandFiles files;
  files.read("bake A", arguments.a);
  files.read("bake B", arguments.b);
  files.read("the scene", arguments.scene);
  files.read("the file of --report-a", arguments.runA);
  files.read("the file of --report-b", arguments.runB);
  files.write("--html", arguments.page, FileKind::comparePage);
  files.force = arguments.force;
  return files;
}

// What a bound on receivers judges must be there: receivers on the light map need its coordinates.
Status checkReceivers(const CompareArguments& arguments, const Bake& a, const Bake& b) {
  if (!std::isfinite(arguments.bounds.maxReceiverChange)) return done();
  for (const auto& [bake, file] : {std::pair{&a, &arguments.a}, std::pair{&b, &arguments.b}}) {
    const Status status = checkCoordinates(*bake, *file);
    if (!status) return usage("--max-receiver-change: " + status.error().message);
  }
  return done();
}

// The scene to place receivers in, when one is given. B must be of it; A may be of an earlier state.
Result<std::optional<Scene>> readScene(const CompareArguments& arguments, const Bake& a, const Bake& b,
                                       Context& context) {
  if (arguments.scene.empty()) return std::optional<Scene>();
  if (const Status status = checkCoordinates(a, arguments.a); !status) return status.error();
  if (const Status status = checkCoordinates(b, arguments.b); !status) return status.error();
  Result<Scene> scene = loadScene(arguments.scene, context);
  if (!scene) return scene.error();
  CommandFiles files = filesOf(arguments);
  files.read("a file of the scene", scene->files);
  if (const Status status = checkApart(files); !status) return status.error();
  if (!arguments.allowStale) {
    if (const Status same = checkSameScene(*scene, b, arguments.b, arguments.scene); !same) return same.error();
  }
  return std::optional<Scene>(std::move(*scene));
}

// Of bakes with the same bytes no receiver is placed: that --scene is a level at all is told without importing it.
Status checkSceneFile(const std::string& path) {
  if (path.empty()) return done();
  const std::string file = std::filesystem::path(path).filename().string();
  Result<std::vector<std::uint8_t>> bytes = readSceneBytes(path, file);
  if (!bytes) return bytes.error();
  const Result<GltfContainer> level = splitContainer(std::move(*bytes), file);
  if (!level) return level.error();
  const Result<Json> json = readJson(level->json);
  return json ? done() : Status(Error{ErrorCode::invalidFile, file + ": " + json.error().message});
}

int runCompare(const CompareArguments& arguments) {
  Terminal terminal(arguments.terminal);
  Context& context = terminal.context();
  if (const Status status = checkOutputs(filesOf(arguments), context); !status) return fail(status.error());
  const Result<BakeFile> a = readChecked(arguments.a, context);
  if (!a) return fail(a.error());
  const Result<BakeFile> b = readChecked(arguments.b, context);
  if (!b) return fail(b.error());

  const Result<Json> runA = readRun(arguments.runA), runB = readRun(arguments.runB);
  if (!runA) return fail(runA.error());
  if (!runB) return fail(runB.error());

  const LightIgnore ignore = splitIgnore(arguments.ignore, a->bake, b->bake);
  Json report;
  std::optional<LightDifference> difference;
  if (sameBytes(*a, *b)) {
    if (const Status ok = checkIgnore(ignore, a->bake, b->bake, context); !ok)
      return terminal.finish(), fail(ok.error());
    if (const Status ok = checkSceneFile(arguments.scene); !ok) return terminal.finish(), fail(ok.error());
    report = reportSame(arguments.a, arguments.b, sizeOf(*a), ignore, arguments.bounds);
  } else {
    // Each bake once more, as its relighter holds it.
    const double relit = static_cast<double>(sizeOf(*a)) + static_cast<double>(sizeOf(*b));
    if (const Status ok = reserveMemory(context, "compare", relit, "relighting both bakes", "compare smaller bakes");
        !ok)
      return fail(ok.error());
    if (const Status ok = checkReceivers(arguments, a->bake, b->bake); !ok) return fail(ok.error());
    Result<std::optional<Scene>> scene = readScene(arguments, a->bake, b->bake, context);
    if (!scene) return terminal.finish(), fail(scene.error());
    Result<LightDifference> light = compareLight(a->bake, b->bake, *scene ? &**scene : nullptr, ignore, context);
    terminal.finish();
    if (!light) return fail(light.error());
    difference = std::move(*light);
    report = reportDifference(*a, *b, *difference, ignore, arguments.bounds);
  }
  if (!arguments.page.empty()) {
    const std::string page = reportAsPage(report, *a, *b, difference ? &*difference : nullptr, {*runA, *runB});
    const Status written =
        writeFileAtomically(arguments.page, [&](const ByteSink& sink) { return sink(std::as_bytes(std::span(page))); });
    if (!written) return fail(written.error());
  }
  const std::string text = arguments.json ? jsonText(report) + "\n" : reportAsText(report);
  std::fputs(text.c_str(), stdout);
  return boundExceeded(report) ? kDifferenceFound : 0;
}

}  // namespace

void addCompareCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "compare",
      "Say what differs between two bakes and what it means for light; exit status 7 when a bound is exceeded");
  auto arguments = std::make_shared<CompareArguments>();
  command->add_option("A", arguments->a, "Bake to compare with (.relume)")->type_name("FILE")->required();
  command->add_option("B", arguments->b, "Bake to judge (.relume)")->type_name("FILE")->required();
  const auto bound = [&](const char* flag, double& value, const char* help) {
    command->add_option(flag, value, help)->option_text("X [none]")->check(numberFrom(0.0));
  };
  bound("--max-rmse", arguments->bounds.maxRmse,
        "Bound on each lighting's relative RMSE over the caches, sqrt(sum |B-A|^2 / sum |A|^2) [>= 0]");
  bound("--max-cache-change", arguments->bounds.maxCacheChange,
        "Bound on each cache's relative change of irradiance, |B-A| / (|A| + a twentieth of the mean) [>= 0]");
  bound("--max-receiver-change", arguments->bounds.maxReceiverChange,
        "Bound on what receivers read: of each node's surfaces, and of the air, rms |B-A| / (rms |A| + a twentieth of "
        "the mean) [>= 0]");
  command
      ->add_option(
          "--ignore", arguments->ignore,
          "What the bounds leave out, separated by commas: sky, suns, points, emitters, a lighting by its name, "
          "node:NAME; a name with commas in it by an --ignore of its own")
      ->allow_extra_args(false)
      ->option_text("LIST");
  command
      ->add_option(
          "--scene", arguments->scene,
          "Level that B was baked from (.glb, .gltf): places receivers exactly, on surfaces that read the grid too")
      ->option_text("FILE");
  command->add_flag("--allow-stale", arguments->allowStale,
                    "Take --scene although B was baked from another state of it");
  command->add_option("--html", arguments->page, "Write the report as one self-contained page")->option_text("FILE");
  command->add_option("--report-a", arguments->runA, "What relume bake --report wrote for A: stage times for the page")
      ->option_text("FILE");
  command->add_option("--report-b", arguments->runB, "The same for B")->option_text("FILE");
  command->add_flag("--force", arguments->force, "Let --html write over a file that is something else, or read-only");
  command->add_flag("--json", arguments->json, "Print JSON (docs/compare.schema.json)");
  addTerminalOptions(*command, arguments->terminal);
  command->callback([arguments, &action] { action = [arguments] { return runCompare(*arguments); }; });
}

}  // namespace relume
